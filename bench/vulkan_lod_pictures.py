"""The animation of docs/vulkan.md: a flight to a model, beside its clusters.

    python -m bench vulkan_lod_pictures

Draws docs/vulkan_lod.gif, of the dragon with each triangle cut into 2 x 2 and noise, without a GPU
in about two minutes. Left the picture, right the same frame with a colour for each cluster.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from bench.common import DOCS, progress
from bench.vulkan_lod import KEYS, camera_at, model
from gltf_meshlet.demo.model import meshlet_colors

CUTS = 2
WIDTH, HEIGHT, FRAMES = 320, 200, 40
MILLISECONDS = 100  # of a frame
COLORS = 64  # of the animation
BACKGROUND = 255
PIXELS = 1.0


def clusters_in_color(picture) -> np.ndarray:
    """uint8[height, width, 3] of a picture with ids: a colour for each cluster, shaded."""
    numbers, places = np.unique(picture.ids[..., 1] // 64, return_inverse=True)
    colors = np.asarray(meshlet_colors(numbers), np.float64)[places].reshape(HEIGHT, WIDTH, -1)
    light = picture.color[..., :3].max(axis=2, keepdims=True) / 255
    shaded = 255 * colors[..., :3] * (0.3 + 0.7 * light)
    return np.where(picture.covered[..., None], shaded, BACKGROUND).astype(np.uint8)


def frame(picture) -> Image.Image:
    """Both halves with a line of text."""
    color = picture.color.astype(np.float64)
    share = color[..., 3:] / 255
    shown = (color[..., :3] * share + BACKGROUND * (1 - share)).astype(np.uint8)
    image = Image.fromarray(np.concatenate([shown, clusters_in_color(picture)], axis=1))
    levels = picture.levels
    text = f"{levels.triangles:,} triangles drawn, {levels.resident_pages} pages in memory"
    ImageDraw.Draw(image).text((6, HEIGHT - 14), text, fill=(60, 60, 60))
    return image


def draw_all() -> list[Path]:
    """docs/vulkan_lod.gif."""
    from vk_backend import Renderer, load_scene

    output = DOCS / "vulkan_lod.gif"
    with tempfile.TemporaryDirectory() as folder, Renderer() as renderer:
        scene = load_scene(model(CUTS, Path(folder)), levels=True)
        size = float((scene.high - scene.low).max())
        images = []
        for moment in np.linspace(0, KEYS[-1][0], FRAMES):
            camera = camera_at(moment, scene.low, scene.high, size)
            picture = renderer.render(scene, camera, None, WIDTH, HEIGHT, lod_error=PIXELS)
            images.append(frame(picture).quantize(COLORS, dither=Image.Dither.NONE))
        progress(f"{FRAMES} frames of {scene.triangles:,} triangles")
    images[0].save(output, save_all=True, append_images=images[1:], duration=MILLISECONDS, loop=0)
    return [output]

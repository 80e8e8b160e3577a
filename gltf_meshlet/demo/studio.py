"""Renders the demo's model in a studio with Mitsuba.

The plugin renders the compressed file; the original becomes a mesh of Mitsuba's own.

Needs the "mitsuba" extra and the plugin; importing this raises ImportError without.
"""

from __future__ import annotations

from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from PIL import Image, ImageDraw, ImageFont

import gltf_ext
import mitsuba_plugin
from gltf_ext.files import write_files
from gltf_ext.progress import progress_bar
from gltf_meshlet.demo.model import meshlet_colors
from mitsuba_plugin import llvm
from mitsuba_plugin.command import render
from mitsuba_plugin.scene import ordinary_mesh

EYE, TARGET, FIELD_OF_VIEW = (-1.55, 2.9, 5.8), (0.0, 0.24, 0.0), 25.8  # vertical, degrees
FLOOR = -0.36  # the height of the plinth's bottom
FLOOR_COLOR = (0.62, 0.62, 0.64)
# Direction towards the lamp, angular radius in degrees, radiance.
LAMPS = (
    ((-0.7, 0.9, 0.55), 24.0, (7.6, 7.6, 7.3)),  # large and soft, from the left
    ((1.0, 0.35, 0.5), 14.0, (4.6, 3.7, 2.8)),  # warm
    ((0.35, 0.55, -1.0), 18.0, (3.6, 4.2, 5.2)),  # cool rim light
)
# Radiance between the lamps.
SKY = (0.30, 0.32, 0.36)  # straight up
HORIZON = (0.12, 0.12, 0.13)
SOFT_EDGE = 6.0  # degrees over which a lamp fades
ROWS = 128  # of the environment map
ALBEDO = 0.5  # of the brightest colour of a meshlet
CAPTION_HEIGHT, CAPTION_SIZE = 40, 18  # pixels


def picture(path: Path, width: int, height: int, spp: int) -> np.ndarray:
    """uint8[height, width, 3] of a file's scene, without decompressing it first."""
    _choose_variant()
    scene = mitsuba_plugin.scene_dict(path, default_light=0)
    scene.pop("sensor")
    return _rendered(path.name, scene, width, height, spp)


def meshlets_picture(path: Path, width: int, height: int, spp: int) -> np.ndarray:
    """uint8[height, width, 3] of a compressed file; each colour is a meshlet."""
    _choose_variant()
    scene: dict[str, Any] = {"type": "scene"}
    for number, (primitive, decoder) in enumerate(
        zip(gltf_ext.load(path), gltf_ext.decoders(path))
    ):
        properties = mi.Properties()
        reflectance = {"type": "mesh_attribute", "name": "face_color"}
        properties["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": reflectance})
        counts = [len(decoder.decode_meshlet(m)[0]) for m in range(decoder.meshlet_count)]
        positions, normals = (primitive.attributes[name] for name in ("POSITION", "NORMAL"))
        mesh = ordinary_mesh(
            "meshlets", primitive.indices, positions, normals, properties=properties
        )
        colors: Any = ALBEDO * meshlet_colors(np.repeat(np.arange(len(counts)), counts))
        mesh.add_attribute("face_color", 3, colors.astype(np.float32).ravel())
        scene[f"primitive_{number}"] = mesh
    return _rendered("meshlets", scene, width, height, spp)


def _choose_variant() -> None:
    mi.set_log_level(mi.LogLevel.Error)
    mi.set_variant("llvm_ad_rgb" if llvm.choose() else "scalar_rgb")


def _rendered(title: str, scene: dict[str, Any], width: int, height: int, spp: int) -> np.ndarray:
    """uint8[height, width, 3]: a scene of shapes in the studio."""
    film = {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb"}
    place = mi.ScalarTransform4f().look_at(origin=EYE, target=TARGET, up=[0, 1, 0])
    scene["sensor"] = {
        "type": "perspective",
        "fov": FIELD_OF_VIEW,
        "fov_axis": "y",
        "near_clip": 0.1,
        "far_clip": 100.0,
        "to_world": place,
        "film": film,
        "sampler": {"type": "multijitter", "sample_count": spp},
    }
    scene["integrator"] = {"type": "path", "max_depth": 5}
    with progress_bar(title, True) as advance:
        linear = render(mi.load_dict({**scene, **_studio()}), width, height, spp, advance)
    return np.array(
        mi.Bitmap(linear).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True)
    )


def _studio() -> dict[str, Any]:
    """Floor and lights. One environment map is less noisy than lamps sampled in turn."""
    floor = mi.ScalarTransform4f().translate([0, FLOOR, 0]).rotate([1, 0, 0], -90).scale(40)
    return {
        "floor": {
            "type": "rectangle",
            "to_world": floor,
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(FLOOR_COLOR)}},
        },
        "lights": {"type": "envmap", "bitmap": mi.Bitmap(_lights())},
    }


def _lights() -> np.ndarray:
    """float32[ROWS, 2 ROWS, 3]: radiance, in Mitsuba's layout of longitude and latitude."""
    latitude = (np.arange(ROWS)[:, None] + 0.5) * np.pi / ROWS
    longitude = (np.arange(2 * ROWS) + 0.5) * np.pi / ROWS
    up = np.broadcast_to(np.cos(latitude), (ROWS, 2 * ROWS))
    direction = np.stack(
        [np.sin(longitude) * np.sin(latitude), up, -np.cos(longitude) * np.sin(latitude)], axis=-1
    )
    light = np.array(HORIZON) + np.clip(up, 0, 1)[..., None] * np.subtract(SKY, HORIZON)
    for towards, radius, radiance in LAMPS:
        angle = np.degrees(
            np.arccos(np.clip(direction @ np.divide(towards, np.linalg.norm(towards)), -1, 1))
        )
        light += np.clip((radius - angle) / SOFT_EDGE, 0, 1)[..., None] * radiance
    radiance_map: np.ndarray = light.astype(np.float32)
    return radiance_map


def save(path: Path, pixels: np.ndarray, models: Iterable[Path]) -> None:
    """Writes a PNG. models: that it shows. Raises MeshletError, OSError."""
    content = BytesIO()
    Image.fromarray(pixels).save(content, "png", optimize=True)
    write_files({path: [content.getvalue()]}, models)


def save_side_by_side(path: Path, captioned: dict[str, np.ndarray], models: Iterable[Path]) -> None:
    """Writes a PNG of pictures of one size, each above its caption; otherwise as `save`."""
    height, width = next(iter(captioned.values())).shape[:2]
    sheet = Image.new("RGB", (width * len(captioned), height + CAPTION_HEIGHT), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(CAPTION_SIZE)
    for i, (caption, pixels) in enumerate(captioned.items()):
        sheet.paste(Image.fromarray(pixels), (i * width, 0))
        middle = (i * width + width // 2, height + CAPTION_HEIGHT // 2)
        draw.text(middle, caption, "black", font, anchor="mm")
    save(path, np.asarray(sheet), models)

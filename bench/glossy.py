"""Pictures of models as a glossy material shows them, and how they differ to the eye (FLIP).

Every surface reflects the same room of soft lights, so that errors of normals show; the texture of
its base colour, or a checkerboard of its texture coordinates, shows those of texture coordinates.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gltf_ext.attributes.extension import read_triangles
from gltf_ext.document.document import Document
from gltf_ext.errors import MeshletError
from gltf_ext.sources.importers import open_model
from gltf_scene.images import read_image
from gltf_scene.materials import read_material
from gltf_scene.scene import PlacedPrimitive, read_scene
from tools.rasterizer import Camera, Surface, visible_surface

SIZE, SAMPLES = 256, 2  # pixels along a side of a picture, samples of a pixel and axis
SQUARES = 32  # of the checkerboard along a tile
PLAIN = np.array([0.55, 0.53, 0.50])  # base colour without texture, linear
# Share of the light that is reflected: more at grazing angles, as of varnish.
REFLECTED, GRAZING = 0.3, 0.7
EXPOSURE = 0.9
# Directions of the room's lamps, and how sharp their reflections are: those of roughness 0.2.
LAMPS = np.array([[-0.5, 0.7, 0.5], [0.8, 0.3, 0.5], [0.0, -0.6, 0.8], [-0.7, 0.1, -0.7]])
SHARPNESS = 60.0


@dataclass
class Placed:
    """A primitive in the world.

    Attributes:
        positions, normals: float[V, 3]; faces: int[T, 3]; uv: float[V, 2]; colors: float[V, 3].
        image: float[height, width, 3] of the base colour, linear; None for a checkerboard.
    """

    positions: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None
    colors: np.ndarray
    image: np.ndarray | None


def read_placed(path: Path) -> list[Placed]:
    """All triangles of a model's scene. Raises MeshletError, OSError."""
    document = open_model(path)
    images: dict[int, np.ndarray | None] = {}
    return [
        placed
        for primitive in read_scene(document).primitives
        for placed in _placed(document, primitive, images)
    ]


def _placed(
    document: Document, primitive: PlacedPrimitive, images: dict[int, np.ndarray | None]
) -> Iterator[Placed]:
    arrays = read_triangles(document, primitive.mesh, primitive.primitive)[0]
    attributes, faces = arrays.attributes, arrays.indices.astype(np.int64)
    use = read_material(document, primitive.material).base_texture
    uv = _floats(attributes.get(f"TEXCOORD_{use.texcoord if use else 0}"))
    image = None
    if use and use.image is not None:
        if use.image not in images:
            images[use.image] = _linear_image(document, use.image)
        image = images[use.image]
    if uv is not None and use:
        uv = uv @ np.reshape(use.matrix, (2, 2)) + use.offset
    colors = _floats(attributes.get("COLOR_0"))
    colors = np.ones((arrays.vertex_count, 3)) if colors is None else colors[:, :3]
    for matrix in primitive.matrices:
        positions = attributes["POSITION"].astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        if "NORMAL" in attributes:
            normals = _floats(attributes["NORMAL"]) @ np.linalg.pinv(matrix[:3, :3])
            yield Placed(positions, normals, faces, uv, colors, image)
        else:  # flat: each triangle has its own vertices
            corners = faces.reshape(-1)
            flat = positions[corners]
            a, b, c = (flat[k::3] for k in range(3))
            normals = np.repeat(np.cross(b - a, c - a), 3, axis=0)
            rows = np.arange(len(corners)).reshape(-1, 3)
            yield Placed(
                flat, normals, rows, None if uv is None else uv[corners], colors[corners], image
            )


def _floats(values: np.ndarray | None) -> np.ndarray | None:
    """Values of an accessor as floats; integers are taken to be normalized."""
    if values is None:
        return None
    scale = 1.0 if values.dtype.kind == "f" else np.iinfo(values.dtype).max
    result: np.ndarray = values.astype(np.float64) / scale
    return result


def _linear_image(document: Document, index: int) -> np.ndarray | None:
    try:
        pixels = read_image(document, index)
    except MeshletError:
        return None
    if min(pixels.shape[:2]) < 8:  # a placeholder
        return None
    result: np.ndarray = (pixels[..., :3] / 255.0) ** 2.2
    return result


# --- pictures ---


def cameras_of(model: list[Placed]) -> list[Camera]:
    """A camera that shows the whole model, and two close to its surface."""
    positions = np.concatenate([placed.positions for placed in model])
    low, high = positions.min(axis=0), positions.max(axis=0)
    radius = max(float(np.linalg.norm(high - low)) / 2, 1e-6)
    middle = (low + high) / 2
    result = []
    for direction, closer, target in (
        ((0.35, 0.25, 1.0), 1.0, middle),
        ((-0.8, 0.5, 0.6), 1.1, middle),
        ((0.5, 0.4, 0.9), 5.0, None),
    ):
        towards = np.array(direction) / np.linalg.norm(direction)
        if target is None:  # the place that is nearest to the camera
            target = positions[np.argmax(positions @ towards)]
        result.append(Camera(tuple(target + towards * radius * 3.6 / closer), tuple(target), 32.0))
    return result


def picture(model: list[Placed], camera: Camera) -> np.ndarray:
    """float32[SIZE, SIZE, 3], sRGB in [0, 1]."""
    side = SIZE * SAMPLES
    first = np.cumsum([0, *(len(placed.positions) for placed in model)])
    positions = np.concatenate([placed.positions for placed in model])
    faces = np.concatenate([placed.faces + start for placed, start in zip(model, first)])
    front = (positions - camera.eye) @ (np.array(camera.target) - camera.eye) > 0
    faces_of = np.repeat(np.arange(len(model)), [len(placed.faces) for placed in model])
    is_before = front[faces].all(axis=1)
    faces, faces_of = faces[is_before], faces_of[is_before]
    surface = visible_surface(positions, faces, camera, side, side)
    light = np.full((side * side, 3), 0.18)
    light[surface.pixels] = _light(model, surface, positions, faces_of, camera)
    mean = light.reshape(SIZE, SAMPLES, SIZE, SAMPLES, 3).mean(axis=(1, 3)) * EXPOSURE
    mapped: np.ndarray = (mean / (1 + mean)) ** (1 / 2.2)
    return mapped.astype(np.float32)


def _light(
    model: list[Placed],
    surface: Surface,
    positions: np.ndarray,
    faces_of: np.ndarray,
    camera: Camera,
) -> np.ndarray:
    normals = surface.interpolate(np.concatenate([placed.normals for placed in model]))
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    view = np.array(camera.eye) - surface.interpolate(positions)
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    facing = (normals * view).sum(axis=1, keepdims=True)
    normals, facing = np.where(facing < 0, -normals, normals), np.abs(facing)
    mirrored = 2 * facing * normals - view
    gloss = REFLECTED + GRAZING * (1 - facing) ** 5
    base = surface.interpolate(np.concatenate([placed.colors for placed in model]))
    base = base * _base_colors(model, surface, faces_of[surface.triangles])
    diffuse = (
        0.45 + 0.25 * normals[:, 1:2] + 0.3 * np.maximum(normals @ _unit(LAMPS[0]), 0)[:, None]
    )
    result: np.ndarray = (1 - gloss) * base * diffuse + gloss * _room(mirrored)
    return result


def _room(directions: np.ndarray) -> np.ndarray:
    """Light from directions [n, 3]: a sky over a floor, stripes of windows, lamps."""
    up = directions[:, 1]
    sky = 0.25 + 0.35 / (1 + np.exp(-8 * up))
    windows = 0.35 / (1 + np.exp(-12 * np.sin(9 * np.arctan2(directions[:, 0], directions[:, 2]))))
    lamps = np.exp(SHARPNESS * (directions @ _unit(LAMPS).T - 1)).sum(axis=1)
    tint = np.array([1.0, 0.97, 0.92])
    result: np.ndarray = (sky + windows * (np.abs(up) < 0.6) + 4.0 * lamps)[:, None] * tint
    return result


def _unit(vectors: np.ndarray) -> np.ndarray:
    result: np.ndarray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return result


def _base_colors(model: list[Placed], surface: Surface, owners: np.ndarray) -> np.ndarray:
    """Base colours at the pixels, [n, 3]. owners: the primitives that they show."""
    width = np.concatenate(
        [np.zeros((len(p.positions), 2)) if p.uv is None else p.uv for p in model]
    )
    uv = surface.interpolate(width)
    result = np.tile(PLAIN, (len(owners), 1))
    for number in np.unique(owners):
        placed, rows = model[number], owners == number
        if placed.uv is None:
            continue
        if placed.image is None:
            result[rows] *= _checkerboard(uv[rows])
        else:
            result[rows] = _texels(placed.image, uv[rows])
    return result


def _checkerboard(uv: np.ndarray) -> np.ndarray:
    waves = np.sin(np.pi * SQUARES * uv)
    result: np.ndarray = 0.75 + 0.25 * np.tanh(6 * waves[:, :1] * waves[:, 1:])
    return result


def _texels(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Bilinear samples of a repeated image at uv [n, 2]."""
    height, width = image.shape[:2]
    at = np.mod(uv, 1.0) * [width, height] - 0.5
    low = np.floor(at)
    part = at - low
    x, y = (low[:, k].astype(np.int64) for k in range(2))
    result = np.zeros((len(uv), 3))
    for dx in (0, 1):
        for dy in (0, 1):
            weight = np.abs(1 - dx - part[:, 0]) * np.abs(1 - dy - part[:, 1])
            result += image[(y + dy) % height, (x + dx) % width] * weight[:, None]
    return result


def flip(reference: np.ndarray, test: np.ndarray) -> float:
    """The mean FLIP error of two pictures: 0 for no difference to the eye, 1 at most."""
    import flip_evaluator

    return float(flip_evaluator.evaluate(reference, test, "LDR", applyMagma=False)[1])

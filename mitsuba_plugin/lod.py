"""Levels of detail in Mitsuba scenes: primitives at a fixed cut for a camera."""

from __future__ import annotations

import numpy as np

from gltf_ext.compression.extension import read_compressed
from gltf_ext.compression.primitives import Primitive
from gltf_ext.gltf.camera import Camera
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.scene import PlacedPrimitive
from gltf_ext.lod.cuts import View, cut_of
from gltf_ext.lod.reading import read_lod


def primitive_for_camera(
    document: Document,
    placed: list[PlacedPrimitive],
    camera: Camera,
    size: tuple[int, int],
    max_pixels: float,
) -> Primitive | None:
    """A primitive whose error is at most max_pixels in a picture of size (width, height).

    placed: all places where it is shown; the nearest decides. None without levels. Transforms that
    scale axes differently change the errors along them. Raises MeshletError.
    """
    compressed = read_compressed(document, placed[0].mesh, placed[0].primitive)
    primitive = read_lod(document, compressed)
    if primitive is None:
        return None
    needed = np.zeros(len(primitive.tables.groups), bool)
    for place in placed:
        view = _view(camera, size, np.asarray(place.matrix, np.float64))
        needed |= view.pixels(primitive.tables) > max_pixels
    return primitive.mesh(cut_of(primitive.tables, needed))


def _view(camera: Camera, size: tuple[int, int], matrix: np.ndarray) -> View:
    """The camera in the coordinates of a primitive with this transform."""
    width, height = size
    if camera.yfov is None:
        scale = float(np.linalg.norm(matrix[:3, :3], axis=0).max())
        return View(None, scale * width / (2.0 * camera.xmag))
    eye = np.linalg.pinv(matrix) @ [*camera.to_world[:3, 3], 1.0]
    x, y, z = (float(v) for v in eye[:3])
    return View.perspective((x, y, z), float(np.degrees(camera.yfov)), height)

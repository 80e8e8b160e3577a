"""Levels of detail in Mitsuba scenes: a fixed cut for a camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext.lod.cuts import Cut, View, cut_for_view
from gltf_ext.lod.reading import LodPrimitive
from gltf_scene.camera import Camera

SIMILAR = 1e-6  # relative difference of scales that counts as none


@dataclass(frozen=True)
class LodView:
    """A camera, and the error in pixels that its picture may have."""

    view: View
    max_pixels: float

    @classmethod
    def of_camera(cls, camera: Camera, size: tuple[int, int], max_pixels: float) -> LodView:
        """size: width and height of the picture."""
        width, height = size
        if camera.yfov is None:
            return cls(View(None, width / (2.0 * camera.xmag)), max_pixels)
        x, y, z = (float(v) for v in camera.to_world[:3, 3])
        view = View.perspective((x, y, z), float(np.degrees(camera.yfov)), height)
        return cls(view, max_pixels)

    def cut(self, primitive: LodPrimitive, matrix: np.ndarray) -> Cut:
        """The coarsest cut within the error, for a primitive with this transform."""
        return cut_for_view(primitive.tables, self.view, self.max_pixels, matrix=matrix)

    def inside(self, matrix: np.ndarray) -> LodView:
        """The same in the coordinates before a transform that scales all axes alike."""
        view = self.view
        if view.eye is None:
            scale = float(np.linalg.norm(matrix[:3, :3], 2))
            return LodView(View(None, view.pixels_per_unit * scale), self.max_pixels)
        x, y, z = (float(v) for v in np.linalg.solve(matrix, [*view.eye, 1.0])[:3])
        return LodView(View((x, y, z), view.pixels_per_unit), self.max_pixels)


def scales_alike(matrix: np.ndarray) -> bool:
    """Whether a transform scales all axes by the same factor, which is not 0."""
    scales = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    return bool(scales[2] > (1.0 - SIMILAR) * scales[0] > 0.0)

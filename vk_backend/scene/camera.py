"""The camera of a Vulkan picture: the shared camera with its projection matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_scene import camera as gltf_camera
from gltf_scene.camera import DEFAULT_VIEW


@dataclass(frozen=True)
class Camera(gltf_camera.Camera):
    """A camera that looks along its -z axis; fields as in gltf_scene.camera."""

    @staticmethod
    def of(camera: gltf_camera.Camera) -> Camera:
        """The same camera, with matrices."""
        return Camera(camera.to_world, camera.yfov, camera.xmag, camera.near, camera.far)

    @staticmethod
    def fit(
        scene: Any,
        width: int,
        height: int,
        view: Sequence[float] = DEFAULT_VIEW,
        *,
        orthographic: bool = False,
    ) -> Camera:
        """The default view: the whole scene from the front, a little above and to the right.

        scene: has view_points, float64[n, 3]; view: direction from it towards the camera.
        """
        points = scene.view_points
        return Camera.fit_points(points, width, height, view, orthographic=orthographic)

    @property
    def eye(self) -> tuple[float, float, float, float]:
        """The position and 1, or of an orthographic camera the direction towards it and 0."""
        x, y, z = self.to_world[:3, 3] if self.yfov is not None else self.to_world[:3, 2]
        return float(x), float(y), float(z), 1.0 if self.yfov is not None else 0.0

    def pixels_per_unit(self, width: int, height: int) -> float:
        """Pixels of one unit at distance one; of an orthographic camera, at any distance."""
        if self.yfov is None:
            return width / (2 * self.xmag)
        return float(height / (2 * np.tan(self.yfov / 2)))

    def world_to_clip(self, width: int, height: int) -> np.ndarray:
        """float64[4, 4] for Vulkan: y down, depth 0 (near) to 1 (far)."""
        return self._projection(width / height) @ np.linalg.inv(self.to_world)

    def clip_to_world(self, width: int, height: int) -> np.ndarray:
        """float64[4, 4], the inverse of `world_to_clip`."""
        return self.to_world @ np.linalg.inv(self._projection(width / height))

    def distance(self, depth: np.ndarray) -> np.ndarray:
        """float64 distances along the viewing direction of depths in [0, 1]."""
        depth = np.asarray(depth, np.float64)
        if self.yfov is None:
            return self.near + depth * (self.far - self.near)
        rate, constant = self._depth_row()
        return constant / (depth + rate)

    def _depth_row(self) -> tuple[float, float]:
        """(a, b): a perspective depth is -a + b / distance."""
        if np.isinf(self.far):
            return -1.0, -self.near
        return -self.far / (self.far - self.near), -self.far * self.near / (self.far - self.near)

    def _projection(self, aspect: float) -> np.ndarray:
        matrix = np.zeros((4, 4))
        if self.yfov is None:
            matrix[0, 0] = 1 / self.xmag
            matrix[1, 1] = -aspect / self.xmag
            matrix[2, 2] = -1 / (self.far - self.near)
            matrix[2, 3] = -self.near / (self.far - self.near)
            matrix[3, 3] = 1
            return matrix
        focal = 1 / np.tan(self.yfov / 2)
        matrix[0, 0] = focal / aspect
        matrix[1, 1] = -focal
        matrix[2, 2], matrix[2, 3] = self._depth_row()
        matrix[3, 2] = -1
        return matrix

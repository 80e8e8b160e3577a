"""Cameras: from glTF or given, perspective or orthographic, and the matrices that they make."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pygltflib

from gltf_ext.errors import MeshletError

if TYPE_CHECKING:
    from .scene import Scene

DEFAULT_VIEW = (0.45, 0.35, 1.0)  # from the model's centre to the camera
DEFAULT_FIELD_OF_VIEW = 40.0  # degrees, of the smaller side
LIGHT_OVER_SHOULDER = (-0.45, 0.75, 0.55)  # towards the light, in the camera's coordinates
NEAREST = 1e-3  # of the far distance, where a file names no near plane


@dataclass(frozen=True)
class Camera:
    """A camera that looks along its -z with y up.

    to_world: float64[4, 4] without scale; yfov: vertical field of view in radians, or None for an orthographic camera, which shows
    xmag world units to each side and as many upwards as the picture's shape gives; near, far: distances, far may be infinite.
    """

    to_world: np.ndarray
    yfov: float | None = None
    xmag: float = 1.0
    near: float = 0.01
    far: float = np.inf

    @staticmethod
    def look_at(origin, target, up=(0.0, 1.0, 0.0), **options) -> "Camera":
        """From a place towards another; options: yfov, xmag, near, far."""
        back = _unit(np.subtract(origin, target, dtype=np.float64))
        up = (0.0, 0.0, 1.0) if np.linalg.norm(np.cross(up, back)) < 1e-6 else up
        right = _unit(np.cross(up, back))
        to_world = np.eye(4)
        to_world[:3] = np.column_stack([right, np.cross(back, right), back, origin])
        return Camera(to_world, **options)

    @staticmethod
    def fit(
        scene: "Scene", width: int, height: int, view=DEFAULT_VIEW, *, orthographic: bool = False
    ) -> "Camera":
        """From the front, a little above and to the right, with the whole scene in view. view: direction towards the camera."""
        center = (scene.low + scene.high) / 2
        radius = max(float(np.linalg.norm(scene.high - scene.low)) / 2, 1e-6)
        direction = _unit(np.array(view, np.float64))
        smaller = np.radians(DEFAULT_FIELD_OF_VIEW)
        yfov = smaller if height <= width else 2 * np.arctan(np.tan(smaller / 2) * height / width)
        distance = radius / np.sin(smaller / 2)
        planes = {
            "near": max(distance - 1.01 * radius, distance * NEAREST),
            "far": distance + 1.01 * radius,
        }
        shape = (
            {"xmag": radius * max(1.0, width / height)} if orthographic else {"yfov": float(yfov)}
        )
        return Camera.look_at(center + direction * distance, center, **shape, **planes)

    @property
    def eye(self) -> tuple[float, float, float, float]:
        """Its place with 1, or, orthographic, the direction towards it with 0."""
        x, y, z = self.to_world[:3, 3] if self.yfov is not None else self.to_world[:3, 2]
        return float(x), float(y), float(z), 1.0 if self.yfov is not None else 0.0

    def light_direction(self) -> tuple[float, float, float]:
        """Unit vector towards a light over the viewer's shoulder."""
        x, y, z = _unit(self.to_world[:3, :3] @ LIGHT_OVER_SHOULDER)
        return float(x), float(y), float(z)

    def world_to_clip(self, width: int, height: int) -> np.ndarray:
        """float64[4, 4] for Vulkan: y down, depth 0 (near) to 1 (far)."""
        return self._projection(width / height) @ np.linalg.inv(self.to_world)

    def clip_to_world(self, width: int, height: int) -> np.ndarray:
        """float64[4, 4], the inverse of `world_to_clip`."""
        return self.to_world @ np.linalg.inv(self._projection(width / height))

    def distance(self, depth: np.ndarray) -> np.ndarray:
        """Distances along the viewing direction, float64, of depths in [0, 1]."""
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
            matrix[0, 0], matrix[1, 1] = 1 / self.xmag, -aspect / self.xmag
            matrix[2, 2], matrix[2, 3] = (
                -1 / (self.far - self.near),
                -self.near / (self.far - self.near),
            )
            matrix[3, 3] = 1
            return matrix
        focal = 1 / np.tan(self.yfov / 2)
        rate, constant = self._depth_row()
        matrix[0, 0], matrix[1, 1], matrix[2, 2], matrix[2, 3], matrix[3, 2] = (
            focal / aspect,
            -focal,
            rate,
            constant,
            -1,
        )
        return matrix


def gltf_camera(camera: pygltflib.Camera, matrix: np.ndarray) -> Camera:
    """A node's camera; matrix: float64[4, 4], the node's. Scale is left out, as glTF says. Raises MeshletError."""
    to_world = matrix.copy()
    to_world[:3, :3] /= np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-30)
    shape = camera.orthographic if camera.type == "orthographic" else camera.perspective
    if shape is None:
        raise MeshletError(
            "a camera has neither perspective nor orthographic",
            "the file is not valid glTF; export it again",
        )
    near, far = shape.znear or 0.0, shape.zfar
    if camera.type == "orthographic":
        result = Camera(
            to_world, xmag=shape.xmag or 1.0, near=near, far=near + 1.0 if far is None else far
        )
    else:
        near = near or NEAREST * (far or 10.0)
        result = Camera(to_world, yfov=shape.yfov, near=near, far=far or np.inf)
    numbers = [result.xmag, result.near, 1.0 if result.yfov is None else result.yfov]
    if (
        not np.isfinite(numbers).all()
        or result.far <= result.near
        or abs(np.linalg.det(to_world[:3, :3])) < 1e-6
    ):
        raise MeshletError(
            "a camera's numbers make no picture", "the file is not valid glTF; export it again"
        )
    if result.yfov is not None and not 0 < result.yfov < np.pi or result.xmag == 0:
        raise MeshletError(
            "a camera's numbers make no picture", "the file is not valid glTF; export it again"
        )
    return result


def _unit(vector: np.ndarray) -> np.ndarray:
    return np.asarray(vector) / max(float(np.linalg.norm(vector)), 1e-30)

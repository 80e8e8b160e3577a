"""Cameras: read from glTF, or placed to show a box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.json_values import NOT_VALID
from gltf_ext.errors import MeshletError

DEFAULT_VIEW = (0.45, 0.35, 1.0)  # direction from the scene towards the camera
DEFAULT_FIELD_OF_VIEW = 40.0  # degrees, of the smaller side
LIGHT_OVER_SHOULDER = (-0.45, 0.75, 0.55)  # towards the light, in the camera's coordinates
NEAREST = 1e-3  # near plane as a share of the far distance, if the file gives none
SMALLEST_RADIUS = 1e-6  # of a scene that has no size
FILLED = 0.85  # share of the tighter side of the picture that a fitted scene fills
LARGEST = 1e15  # distance, and slope of a ray; their products must fit 32-bit floats
SLACK = 1.01  # of the planes around a fitted scene
BISECTIONS = 50

AnyCamera = TypeVar("AnyCamera", bound="Camera")


@dataclass(frozen=True)
class Camera:
    """A camera that looks along its -z axis, with y up.

    to_world: float64[4, 4] without scale. yfov: vertical field of view in radians, or None for an
    orthographic camera. xmag: half the width of an orthographic picture in world units; its
    height follows from the picture's shape. near, far: distances in world units; a perspective
    camera's far may be infinite.
    """

    to_world: np.ndarray
    yfov: float | None = None
    xmag: float = 1.0
    near: float = 0.01
    far: float = np.inf

    @classmethod
    def look_at(
        cls: type[AnyCamera],
        origin: Sequence[float] | np.ndarray,
        target: Sequence[float] | np.ndarray,
        up: Sequence[float] = (0.0, 1.0, 0.0),
        **options: Any,
    ) -> AnyCamera:
        """Return a camera at `origin` that looks at `target`; options: yfov, xmag, near, far."""
        back = unit(np.subtract(origin, target, dtype=np.float64))
        if np.linalg.norm(np.cross(up, back)) < 1e-6:
            up = (0.0, 0.0, 1.0)
        right = unit(np.cross(up, back))
        to_world = np.eye(4)
        to_world[:3] = np.column_stack([right, np.cross(back, right), back, origin])
        return cls(to_world, **options)

    @classmethod
    def fit_box(
        cls: type[AnyCamera],
        low: np.ndarray,
        high: np.ndarray,
        width: int,
        height: int,
        view: Sequence[float] = DEFAULT_VIEW,
    ) -> AnyCamera:
        """Return a camera that shows the whole box. view: direction from the box to the camera."""
        center = (low + high) / 2
        radius = max(float(np.linalg.norm(high - low)) / 2, SMALLEST_RADIUS)
        smaller = np.radians(DEFAULT_FIELD_OF_VIEW)
        yfov = smaller if height <= width else 2 * np.arctan(np.tan(smaller / 2) * height / width)
        distance = radius / np.sin(smaller / 2)
        return cls.look_at(
            center + unit(np.array(view)) * distance,
            center,
            near=max(distance - 1.01 * radius, distance * NEAREST),
            far=distance + 1.01 * radius,
            yfov=float(yfov),
        )

    @classmethod
    def fit_points(
        cls: type[AnyCamera],
        points: np.ndarray,
        width: int,
        height: int,
        view: Sequence[float] = DEFAULT_VIEW,
        *,
        orthographic: bool = False,
    ) -> AnyCamera:
        """Return a camera whose picture of the points fills FILLED of its tighter side, centred.

        points: float64[n, 3], at least one; view: direction from the scene towards the camera.
        """
        direction = unit(np.array(view))
        axes = cls.look_at(direction, np.zeros(3)).to_world[:3, :3]
        local = points @ axes
        low, high = local.min(axis=0), local.max(axis=0)
        size = max(float(np.linalg.norm(high - low)), 2 * SMALLEST_RADIUS)
        slopes = np.tan(np.radians(DEFAULT_FIELD_OF_VIEW) / 2) * np.array([width, height])
        slopes /= min(width, height)
        if orthographic:
            center = (low + high) / 2
            reach = np.maximum((high - low)[:2] / 2, size * 1e-3) / FILLED
            options: dict[str, Any] = {"xmag": float(max(reach[0], reach[1] * width / height))}
            distance = high[2] + size
        else:
            distance, center = _fitted_place(local, slopes * FILLED)
            distance = max(distance, high[2] + size * NEAREST)
            options = {"yfov": float(2 * np.arctan(slopes[1]))}
        far = (distance - low[2]) * SLACK
        options["near"] = max((distance - high[2]) / SLACK - size * NEAREST, far * NEAREST)
        options["far"] = far + size * NEAREST
        eye = axes @ [center[0], center[1], distance]
        return cls.look_at(eye, eye - direction, **options)

    def light_direction(self) -> tuple[float, float, float]:
        """Return the unit vector towards the default light, over the viewer's shoulder."""
        x, y, z = unit(self.to_world[:3, :3] @ LIGHT_OVER_SHOULDER)
        return float(x), float(y), float(z)


def _fitted_place(local: np.ndarray, slopes: np.ndarray) -> tuple[float, np.ndarray]:
    """Return (distance, centre) of a perspective camera along -z that sees the points.

    local: float64[n, 3] in the camera's axes; slopes: tangents of half the angles that the points
    fill at most, horizontally and vertically.
    """
    distance = -np.inf
    for axis, slope in enumerate(slopes):
        leaning = slope * local[:, 2]
        right_bound, left_bound = (local[:, axis] + leaning).max(), (leaning - local[:, axis]).max()
        distance = max(distance, (right_bound + left_bound) / (2 * slope))
    depth = np.maximum(distance - local[:, 2], 1e-30)
    center = np.zeros(2)
    for axis in range(2):
        low, high = local[:, axis].min(), local[:, axis].max()
        for _ in range(BISECTIONS):  # as far to the right of the picture's middle as to the left
            center[axis] = (low + high) / 2
            places = (local[:, axis] - center[axis]) / depth
            if places.max() + places.min() > 0:
                low = center[axis]
            else:
                high = center[axis]
    return float(distance), center


def read_camera(camera: gltf.Camera, matrix: np.ndarray) -> Camera:
    """Return a node's camera. Raises MeshletError.

    matrix: float64[4, 4], the node's; as glTF says, its scale is ignored.
    """
    to_world = matrix.copy()
    to_world[:3, :3] /= np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-30)
    orthographic = camera.get("type") == "orthographic"
    if orthographic and "orthographic" in camera:
        flat = camera["orthographic"]
        near = flat.get("znear", 0.0)
        far = flat.get("zfar", near + 1.0)
        result = Camera(to_world, xmag=flat.get("xmag", 0.0), near=near, far=far)
    elif not orthographic and "perspective" in camera:
        lens = camera["perspective"]
        near, far = lens.get("znear", 0.0), lens.get("zfar", 0.0)
        near = near if near >= 1.0 / LARGEST or near < 0.0 else NEAREST * (far or 10.0)
        far = far if far and far <= LARGEST else np.inf
        result = Camera(to_world, yfov=lens.get("yfov", 0.0), near=near, far=far)
    else:
        raise MeshletError("a camera has neither perspective nor orthographic", NOT_VALID)
    if not _is_usable(result, orthographic):
        raise MeshletError("a camera's numbers make no picture", NOT_VALID)
    return result


def _is_usable(camera: Camera, orthographic: bool) -> bool:
    lens = abs(camera.xmag) if orthographic else np.tan((camera.yfov or 0.0) / 2)
    return bool(
        1.0 / LARGEST <= lens <= LARGEST
        and 0.0 <= camera.near <= LARGEST
        and camera.far > camera.near
        and (camera.far <= LARGEST or not orthographic)
        and (camera.yfov is None or 0.0 < camera.yfov < np.pi)
        and abs(np.linalg.det(camera.to_world[:3, :3])) >= 1e-6
    )


def unit(vector: np.ndarray) -> np.ndarray:
    """Return the vector with length 1; zero stays zero."""
    return np.asarray(vector, np.float64) / max(float(np.linalg.norm(vector)), 1e-30)

"""The tests of meshlets by culling.glsl and occlusion.glsl of shaders/, in numpy.

In float64: each test says what surely passes and what possibly does, because the shaders round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CLOSE = 1e-5  # relative: the shaders' float32 may decide otherwise
MOST_TEXELS = 64
ROUNDING = 1e-6


@dataclass(frozen=True)
class Bounds:
    """Of meshlets, from their words.

    center, axis: float64[n, 3]; radius: float64[n], negative without bounds; sine: float64[n], 2
    without a cone.
    """

    center: np.ndarray
    radius: np.ndarray
    axis: np.ndarray
    sine: np.ndarray

    @staticmethod
    def of(words: np.ndarray, low: np.ndarray, size: np.ndarray) -> Bounds:
        """words: uint32[n]; low, size: float[3] or float[n, 3], of the primitives' boxes."""
        words = words.astype(np.int64)
        low, size = np.asarray(low, np.float64), np.asarray(size, np.float64)
        cell = np.stack([words, words >> 5, words >> 10], axis=1) & 31
        k = words >> 15 & 7
        diagonal = np.linalg.norm(size, axis=-1)
        x, y = (np.stack([words >> 18, words >> 23]) & 31) / 15 - 1
        z = 1 - abs(x) - abs(y)
        fold = np.maximum(-z, 0)
        axis = np.stack([x - np.copysign(fold, x), y - np.copysign(fold, y), z], axis=1)
        sine = words >> 28
        return Bounds(
            low + size * ((cell + 0.5) / 32),
            np.where(k == 0, -1.0, diagonal * 0.5**k),
            axis / np.linalg.norm(axis, axis=1, keepdims=True),
            np.where(sine == 15, 2.0, sine / 14),
        )


def in_view(bounds: Bounds, scene, number: int, camera, size: tuple[int, int]) -> tuple:
    """(bool[n] surely, bool[n] possibly): whether meshlets of an instance may be visible."""
    instance = scene.instances[number]
    rows = camera.world_to_clip(*size) @ instance.matrix
    planes = np.array([rows[3] + rows[0], rows[3] - rows[0], rows[3] + rows[1], rows[3] - rows[1]])
    planes = np.concatenate([planes, [rows[2], rows[3] - rows[2]]])
    distances = bounds.center @ planes[:, :3].T + planes[:, 3]
    limits = -bounds.radius[:, None] * np.linalg.norm(planes[:, :3], axis=1) * 1.0001
    spread = abs(bounds.center) @ abs(planes[:, :3]).T + abs(planes[:, 3]) - limits
    margins = [(distances - limits) / spread]
    if not scene.materials[instance.material].double_sided:
        eye = np.linalg.pinv(instance.matrix) @ camera.eye
        near = camera.eye[3] > 0
        toward = bounds.center - eye[:3] if near else -np.tile(eye[:3], (len(bounds.center), 1))
        length = np.linalg.norm(toward, axis=1)
        limit = bounds.sine * length * 1.0001 + np.where(near, bounds.radius, 0.0)
        along = (toward * bounds.axis).sum(axis=1)
        margins.append(((limit - along) / (length + limit))[:, None])
    least = np.where(bounds.radius < 0, 1.0, np.concatenate(margins, axis=1).min(axis=1))
    return least > CLOSE, least > -CLOSE


class Pyramid:
    """The greatest depths of squares of 4 to 64 pixels. depth: float32[height, width]."""

    def __init__(self, depth: np.ndarray):
        self.size = depth.shape[::-1]
        padded = np.zeros([-(-n // 64) * 64 for n in depth.shape], np.float32)
        padded[: depth.shape[0], : depth.shape[1]] = depth
        rows, columns = padded.shape
        self.levels = [
            padded.reshape(rows // side, side, columns // side, side).max(axis=(1, 3))
            for side in (4, 8, 16, 32, 64)
        ]

    def farthest(self, first: np.ndarray, last: np.ndarray) -> float:
        """Of the pixels [first, last]."""
        level = 0
        while level < 4 and ((last >> level + 2) - (first >> level + 2)).max() >= 4:
            level += 1
        low, high = first >> level + 2, last >> level + 2
        if np.prod(high - low + 1) > MOST_TEXELS:
            return 1.0
        return float(self.levels[level][low[1] : high[1] + 1, low[0] : high[0] + 1].max())


def hidden(bounds: Bounds, matrix: np.ndarray, pyramid: Pyramid) -> tuple:
    """(bool[n] surely, bool[n] possibly): whether meshlets are behind the pyramid's surfaces.

    matrix: float64[4, 4], to clip space.
    """
    decided = [_hides(c, r, matrix, pyramid) for c, r in zip(bounds.center, bounds.radius)]
    return tuple(np.array(decided, bool).reshape(-1, 2).T)


def _hides(center: np.ndarray, radius: float, rows: np.ndarray, pyramid: Pyramid) -> tuple:
    w = rows[3, :3] @ center + rows[3, 3]
    square = radius**2 * (rows[3, :3] @ rows[3, :3])
    if radius < 0 or not (w > 0 and w * w - square > 0.1 * w * w):
        return False, False
    size = np.array(pyramid.size)
    found = []
    for errors in (2.0, 0.0):  # the shader allows for one
        ranges = [_range_over_w(row, rows[3], center, radius, errors) for row in rows[:3]]
        near = ranges[2][0]
        low, high = np.array(ranges[:2]).T
        slack = 1 + 1e-3 * (errors - 1)
        first = np.clip((low * 0.5 + 0.5) * size - slack, 0, size - 1).astype(int)
        last = np.clip((high * 0.5 + 0.5) * size + slack, 0, size - 1).astype(int)
        inside = near > 0 and max(abs(low).max(), abs(high).max()) < 1e6
        found.append(inside and near > pyramid.farthest(first, last))
    return tuple(found)


def _range_over_w(
    row: np.ndarray, w_row: np.ndarray, center: np.ndarray, radius: float, errors: float
) -> tuple:
    """The least and greatest value of a coordinate over w in a sphere before the eye.

    errors: that the range is wider by, of those that rounding may cause.
    """
    x, w = row[:3] @ center + row[3], w_row[:3] @ center + w_row[3]
    xx, ww, xw = row[:3] @ row[:3], w_row[:3] @ w_row[:3], row[:3] @ w_row[:3]
    square = radius**2
    scale = w * w - square * ww
    across = w * row[:3] - x * w_row[:3]
    root = radius * np.sqrt(max(across @ across - square * (xx * ww - xw**2), 0.0))
    low, high = ((x * w - square * xw + side) / scale for side in (-root, root))
    farthest = abs(center) + radius
    terms, w_terms = (abs(r[:3]) @ farthest + abs(r[3]) for r in (row, w_row))
    share = errors * ROUNDING * w / scale
    return (
        low - share * (terms + (abs(low) + 1) * w_terms),
        high + share * (terms + (abs(high) + 1) * w_terms),
    )

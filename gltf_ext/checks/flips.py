"""Corners whose normals point against their triangles: they shade black or as speckles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.details import areas_of
from gltf_ext.lod.surface import face_normals
from gltf_ext.sources.primitives import Primitive

# The sine of the angle beyond 90 degrees from which a corner counts: of rounding.
AGAINST = 1e-6
SLIVER = 2.0**-22  # height of a triangle over the largest coordinate: of rounding to floats


@dataclass(frozen=True)
class Flips:
    """Flipped corners of a level.

    corners: their number; area_share: of the triangles that have one.
    """

    corners: int
    area_share: float


class FlipCounter:
    """Counts flipped corners of levels, but none at a position where the finest level has one."""

    def __init__(self, finest: Primitive) -> None:
        """Find the finest level's own."""
        is_flipped = flipped_corners(finest)
        rows = finest.attributes["POSITION"][finest.indices[is_flipped]]
        self._own_positions = np.unique(rows, axis=0)

    def count(self, level: Primitive) -> Flips:
        """Return the flips of a level."""
        is_flipped = flipped_corners(level)
        if is_flipped.any() and len(self._own_positions):
            rows = level.attributes["POSITION"][level.indices[is_flipped]]
            is_flipped[is_flipped] = ~_are_among(rows, self._own_positions)
        if not is_flipped.any():
            return Flips(0, 0.0)
        area = areas_of(level.attributes["POSITION"].astype(np.float64)[level.indices])
        share = area[is_flipped.any(axis=1)].sum() / area.sum()
        return Flips(int(np.count_nonzero(is_flipped)), float(share))


def flipped_corners(primitive: Primitive) -> np.ndarray:
    """Return bool[T, 3]: whether a corner's normal points against its triangle."""
    if "NORMAL" not in primitive.attributes:
        return np.zeros(primitive.indices.shape, bool)
    faces = face_normals(primitive.attributes["POSITION"], primitive.indices)
    faces[_are_slivers(primitive)] = 0.0
    normals = primitive.attributes["NORMAL"].astype(np.float64)
    length = np.linalg.norm(normals, axis=1)[primitive.indices]
    dots = np.einsum("tkc,tc->tk", normals[primitive.indices], faces)
    result: np.ndarray = dots < -AGAINST * length
    return result


def _are_slivers(primitive: Primitive) -> np.ndarray:
    """Return bool[T]: triangles with no more area than rounding of their positions gives them.

    Corners of a grid may lie on a line; as floats they do not.
    """
    positions = primitive.attributes["POSITION"].astype(np.float64)
    corners = positions[primitive.indices]
    longest = np.abs(corners - np.roll(corners, 1, axis=1)).max(axis=(1, 2), initial=0.0)
    rounding = SLIVER * np.abs(positions).max(initial=0.0)
    result: np.ndarray = areas_of(corners) <= rounding * longest
    return result


def _are_among(rows: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return bool[N]: whether rows, [N, C], are equal to one of the others, of the same type."""
    both = np.ascontiguousarray(np.concatenate([rows, others]))
    ids, count = _codec.weld(both.view(np.uint8).reshape(len(both), -1))
    is_known = np.zeros(count, bool)
    is_known[ids[len(rows) :]] = True
    result: np.ndarray = is_known[ids[: len(rows)]]
    return result

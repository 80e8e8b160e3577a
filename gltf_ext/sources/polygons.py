"""Polygons as triangles, and the numbers of rows at their corners."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gltf_ext import _codec
from gltf_ext.errors import EXPORT_AGAIN, MeshletError
from gltf_ext.sources.row_arrays import RowArray, Rows, RowsWithout


def triangles_of(
    sizes: np.ndarray, points: Callable[[], np.ndarray]
) -> tuple[np.ndarray | None, np.ndarray]:
    """Cut polygons into triangles, which do not overlap in a polygon that is planar.

    sizes: int64[F], corners of each polygon; those with fewer than 3 give no triangle. points:
    called if some are no triangles; float32[C, 3], at the corners of all. Returns (corners:
    uint32[T, 3], in the order of all polygons' corners, or None if all are triangles; triangles of
    each: int64[F]).
    """
    if (sizes == 3).all():
        return None, np.broadcast_to(np.int64(1), len(sizes))
    return _codec.triangulate(points(), sizes), np.maximum(sizes - 2, 0)


def at_corners(values: np.ndarray, corners: np.ndarray | None) -> np.ndarray:
    """[T, 3, ...]: values [C, ...] of all polygons' corners at those of `triangles_of`."""
    if corners is None:
        return values.reshape(-1, 3, *values.shape[1:])
    triangles: np.ndarray = values[corners]
    return triangles


class Points:
    """Positions at corners of polygons, while the file is read.

    Attributes:
        missing: number of corners whose positions come later in the file, if ever.
    """

    def __init__(self, positions: RowArray) -> None:
        """positions: as far as they are read, float32[n, 3]."""
        self._positions = positions
        self.missing = 0

    def at(self, numbers: np.ndarray) -> np.ndarray:
        """float32[C, 3]; NaN for those that are missing. numbers: int[C]. Raises OSError."""
        is_there = (numbers >= 0) & (numbers < self._positions.count)
        if is_there.all():
            return self._positions.gather(numbers)
        result = np.full((len(numbers), 3), np.nan, np.float32)
        if is_there.any():
            result[is_there] = self._positions.gather(numbers[is_there])
        self.missing += int(np.count_nonzero(~is_there))
        return result

    @property
    def warnings(self) -> list[str]:
        """One line if polygons could not be looked at."""
        if not self.missing:
            return []
        return [
            f"{self.missing} corners of polygons come before their vertices; polygons that are "
            "not convex may be shown wrong"
        ]


class CornerNumbers:
    """Numbers of rows at corners: int32[3 T, 1], and their range.

    Attributes:
        rows: these numbers, as far as none of them is negative.
        least, most: the smallest and the largest number; 0 and -1 while there is none.
    """

    def __init__(self, rows: RowArray) -> None:
        """Start with rows that are empty."""
        self.rows = rows
        self.least, self.most = 0, -1

    def add(self, numbers: np.ndarray) -> None:
        """Append numbers of more triangles: int32[n, 3]. Raises OSError."""
        if not numbers.size:
            return
        least, most = int(numbers.min()), int(numbers.max())
        is_first = self.most < self.least
        self.least = least if is_first else min(self.least, least)
        self.most = most if is_first else max(self.most, most)
        if self.least >= 0:
            self.rows.add(numbers.reshape(-1, 1))

    def check(self, count: int, kind: str, first: int) -> None:
        """Raise MeshletError for a number that is not in [0, count). The file counts from first."""
        if self.most >= count or self.least < 0:
            wrong = self.most if self.most >= count else self.least
            raise MeshletError(f"a face uses {kind} {wrong + first} of {count}", EXPORT_AGAIN)

    def from_least(self) -> Rows:
        """Return the numbers without those below the smallest, which becomes 0."""
        return RowsWithout(self.rows, self.least) if self.least > 0 else self.rows

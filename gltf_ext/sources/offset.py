"""Moves models that lie far from the origin, so that 32-bit floats hold their doubles.

Coordinates of maps have millions of metres and parts of one. The offset is subtracted while a file
is read and becomes the translation of its nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from gltf_ext.sources.mesh_files import to_floats

# Models that are farther away than so many times their size. Nearer, floats lose at most a
# 500,000th of the size, an eighth of what 16 bits do.
FAR = 64.0
INNER = (1.0, 99.0)  # percent of the vertices whose size counts: some files have one at the origin
SAMPLE = 1 << 16  # vertices that stand for all, and up to twice as many

Reader = TypeVar("Reader")


class Offset:
    """The offset of a file: its first vertices suggest one, and all of them decide.

    Attributes:
        rounding: the largest difference of a coordinate between the file and 32-bit floats.
    """

    def __init__(self, values: np.ndarray | None = None) -> None:
        """Take float64[3]; by default, the first vertices suggest it."""
        self._values = values
        self.rounding = 0.0
        self._sample = _Sample()

    @property
    def values(self) -> tuple[float, float, float]:
        """The offset along each axis; zero where there is none."""
        x, y, z = (0.0, 0.0, 0.0) if self._values is None else self._values.tolist()
        return x, y, z

    def to_local(self, positions: np.ndarray) -> np.ndarray:
        """Return positions, [n, 3] of any type, without the offset as float32[n, 3]."""
        self._sample.add(positions)
        if self._values is None and len(positions):
            self._values = _suggest(positions)
        if self._values is None or (positions.dtype == np.float32 and not self._values.any()):
            return to_floats(positions)
        values = positions.astype(np.float64) - self._values
        local = to_floats(values)
        with np.errstate(invalid="ignore"):
            rounding = np.nan_to_num(np.abs(values - local), nan=0.0, posinf=0.0)
        self.rounding = max(self.rounding, float(rounding.max(initial=0.0)))
        return local

    def better(self) -> Offset | None:
        """Return the offset that fits all vertices; None if this one serves as well."""
        if self._values is None or not self.rounding:
            return None
        values = self._sample.values()
        best = _far_offset(values)
        if best.any():
            is_good = not _far_offset(values - self._values).any()
        else:
            is_good = not self._values.any()
        return None if is_good else Offset(best)


def with_offset(read: Callable[[Offset], Reader]) -> Reader:
    """Return what reads a file, which reads it again if its first vertices mislead.

    read: takes the offset and reads all of the file. Raises what it raises.
    """
    offset = Offset()
    reader = read(offset)
    better = offset.better()
    if better is None:
        return reader
    del reader  # before the other one takes memory
    return read(better)


class _Sample:
    """Every so many of a file's vertices, in whatever blocks these come."""

    def __init__(self) -> None:
        self._blocks: list[np.ndarray] = []
        self._count, self._step = 0, 1
        self._seen = 0  # vertices of all blocks

    def add(self, positions: np.ndarray) -> None:
        """Take those whose number in the file the step divides."""
        first = -self._seen % self._step
        self._blocks.append(positions[first :: self._step].astype(np.float64))
        self._seen += len(positions)
        self._count += len(self._blocks[-1])
        while self._count > 2 * SAMPLE:
            self._blocks = [np.concatenate(self._blocks)[::2]]
            self._count, self._step = len(self._blocks[0]), 2 * self._step

    def values(self) -> np.ndarray:
        """float64[n, 3]: those that are finite."""
        return _finite(np.concatenate(self._blocks))


def _finite(values: np.ndarray) -> np.ndarray:
    finite: np.ndarray = values[np.isfinite(values).all(axis=1)]
    return finite


def _suggest(positions: np.ndarray) -> np.ndarray:
    """Return the offset of the first vertices, float64[3]; zero if 32-bit floats hold them."""
    values = _finite(positions.astype(np.float64))
    is_exact = np.array_equal(to_floats(values), values)
    return np.zeros(3) if is_exact else _far_offset(values)


def _far_offset(values: np.ndarray) -> np.ndarray:
    """Return an offset that 32-bit floats hold, of whole units where the model is that far.

    Zero for vertices, float64[n, 3], that are near the origin.
    """
    none = np.zeros(3)
    if not len(values):
        return none
    low, middle, high = np.percentile(values, [INNER[0], 50.0, INNER[1]], axis=0)
    size = float((high - low).max())
    if not size or np.abs(middle).max() <= FAR * size:
        return none
    with np.errstate(over="ignore"):
        offset = np.where(np.abs(middle) >= 1.0, np.rint(middle), middle).astype(np.float32)
    result: np.ndarray = offset.astype(np.float64)
    return result if np.isfinite(result).all() else none

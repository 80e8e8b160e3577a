"""Moves models that lie far from the origin, so that 32-bit floats hold their doubles.

Coordinates of maps have millions of metres and parts of one. The offset is subtracted while a file
is read and becomes the translation of its nodes.
"""

from __future__ import annotations

import numpy as np

from gltf_ext.sources.mesh_files import to_floats

# Models that are farther away than so many times their size. Nearer, floats lose at most a
# 500,000th of the size, an eighth of what 16 bits do.
FAR = 64.0
INNER = (1.0, 99.0)  # percent of the vertices whose size counts: some files have one at the origin


class Offset:
    """The offset of a file, which its first vertices choose.

    Attributes:
        rounding: the largest difference of a coordinate between the file and 32-bit floats.
    """

    def __init__(self) -> None:
        """Choose nothing yet."""
        self._values: np.ndarray | None = None
        self.rounding = 0.0

    @property
    def values(self) -> tuple[float, float, float]:
        """The offset along each axis; zero where there is none."""
        x, y, z = (0.0, 0.0, 0.0) if self._values is None else self._values.tolist()
        return x, y, z

    def to_local(self, positions: np.ndarray) -> np.ndarray:
        """Return positions, [n, 3] of any type, without the offset as float32[n, 3]."""
        if self._values is None and len(positions):
            self._values = _choose(positions)
        if self._values is None or (positions.dtype == np.float32 and not self._values.any()):
            return to_floats(positions)
        values = positions.astype(np.float64) - self._values
        local = to_floats(values)
        with np.errstate(invalid="ignore"):
            rounding = np.nan_to_num(np.abs(values - local), nan=0.0, posinf=0.0)
        self.rounding = max(self.rounding, float(rounding.max(initial=0.0)))
        return local


def _choose(positions: np.ndarray) -> np.ndarray:
    """Return an offset that 32-bit floats hold, of whole units where the model is that far."""
    none = np.zeros(3)
    values = positions.astype(np.float64)
    values = values[np.isfinite(values).all(axis=1)]
    if not len(values) or np.array_equal(to_floats(values), values):
        return none
    low, middle, high = np.percentile(values, [INNER[0], 50.0, INNER[1]], axis=0)
    size = float((high - low).max())
    if not size or np.abs(middle).max() <= FAR * size:
        return none
    with np.errstate(over="ignore"):
        offset = np.where(np.abs(middle) >= 1.0, np.rint(middle), middle).astype(np.float32)
    result: np.ndarray = offset.astype(np.float64)
    return result if np.isfinite(result).all() else none

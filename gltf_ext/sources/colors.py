"""Colours of vertices, whose range only the whole file tells."""

from __future__ import annotations

import numpy as np

from gltf_ext.sources.row_arrays import NewRows, RowArray

BLOCK = 1 << 16  # rows that are converted at a time
FULL = -np.inf  # stands for white and for an alpha that a file does not give
# Floats up to this may be colours from 0 to 1 that some lights exceed, unless all are whole.
BRIGHTEST = 16


class Colors:
    """Colours of consecutive rows, of which some have none: those are white."""

    def __init__(self, new_rows: NewRows) -> None:
        """Start without rows."""
        self._new_rows = new_rows
        self._rows = new_rows()
        self._dtype: np.dtype | None = None
        self._without = 0  # rows without colours since the last that has one
        self._most, self._is_whole = 0.0, True

    def add(self, values: np.ndarray, dtype: np.dtype) -> None:
        """Append colours: [n, 3 or 4]. dtype: as the file has them. Raises OSError."""
        self._dtype = self._dtype or dtype
        self._add_white()
        if self._is_bytes:
            self._rows.add(color_bytes(values, _range_of(dtype, 0, True)))
            return
        raw = np.full((len(values), 4), FULL, np.float32)
        with np.errstate(over="ignore"):
            raw[:, : values.shape[1]] = values
        colors = raw[:, : values.shape[1]]
        numbers = colors[np.isfinite(colors)]
        self._most = max(self._most, float(numbers.max(initial=0)))
        self._is_whole = self._is_whole and bool((numbers == np.floor(numbers)).all())
        self._rows.add(raw)

    def skip(self, count: int) -> None:
        """Append rows without colours."""
        self._without += count

    def finish(self) -> RowArray | None:
        """Return all rows as uint8[n, 4]; None if no row has a colour. Raises OSError."""
        if self._dtype is None:
            return None
        self._add_white()
        if self._is_bytes:
            return self._rows
        result, full = self._new_rows(), _range_of(self._dtype, self._most, self._is_whole)
        for first in range(0, self._rows.count, BLOCK):
            rows = self._rows.rows(first, min(first + BLOCK, self._rows.count))
            result.add(color_bytes(np.where(rows == FULL, full, rows), full))
        return result

    @property
    def _is_bytes(self) -> bool:
        return self._dtype is not None and self._dtype.str[1:] == "u1"

    def _add_white(self) -> None:
        while self._without:
            count = min(self._without, BLOCK)
            white, dtype = (255, np.uint8) if self._is_bytes else (FULL, np.float32)
            self._rows.add(np.full((count, 4), white, dtype))
            self._without -= count


def _range_of(dtype: np.dtype, most: float, is_whole: bool) -> float:
    """Return the number that stands for full intensity: 1, 255, 65535 or the type's largest.

    most: the largest of the file; is_whole: whether none of its numbers has a fraction.
    """
    if dtype.kind == "f":
        if most <= 1 or (most <= BRIGHTEST and not is_whole):
            return 1.0
        steps = [255.0, 65535.0]
    else:
        largest = float(np.iinfo(dtype).max)
        steps = [full for full in (255.0, 65535.0) if full < largest] + [largest]
    return next((full for full in steps if most <= full), most)


def color_bytes(values: np.ndarray, full: float) -> np.ndarray:
    """Return colours as uint8[n, 4]. values: [n, 3 or 4], from 0 to `full`; others are clamped."""
    levels = np.nan_to_num(values.astype(np.float64), posinf=0, neginf=0) * (255 / full)
    result = np.full((len(values), 4), 255, np.uint8)
    result[:, : values.shape[1]] = np.clip(levels, 0, 255).round()
    return result

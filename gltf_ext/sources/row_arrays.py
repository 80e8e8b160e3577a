"""Arrays of rows that grow while a file is read, in memory or in a work file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Mapping

import numpy as np

from gltf_ext.document.accessors import Format
from gltf_ext.work_files import WorkFile


class RowArray(ABC):
    """Rows of one type, which are added and read in blocks.

    Attributes:
        format: type and number of components; count: number of rows.
    """

    def __init__(self) -> None:
        """Start without rows."""
        self.format: Format = (np.dtype("<f4"), 0)
        self.count = 0

    def add(self, values: np.ndarray) -> None:
        """Append values: [n, components], of the same format each time. Raises OSError."""
        new_format = values.dtype, values.shape[1]
        assert not self.count or new_format == self.format
        self.format = new_format
        self._append(values)
        self.count += len(values)

    @abstractmethod
    def _append(self, values: np.ndarray) -> None:
        """Store more rows after those before."""

    @abstractmethod
    def rows(self, first: int, last: int) -> np.ndarray:
        """Return [last - first, components]. Raises OSError."""


def add_all(arrays: Mapping[str, RowArray], values: Mapping[str, np.ndarray]) -> None:
    """Append values to the arrays of the same names. Raises OSError."""
    for name, rows in values.items():
        arrays[name].add(rows)


NewRows = Callable[[], RowArray]  # where a reader stores its rows


class MemoryRows(RowArray):
    """Rows in memory.

    A bytearray grows in place: a binary .ply or .stl takes half the memory, and an .stl two thirds
    of the time, of keeping the blocks to join them.
    """

    def __init__(self) -> None:
        """Start without rows."""
        super().__init__()
        self._bytes = bytearray()

    def _append(self, values: np.ndarray) -> None:
        self._bytes += np.ascontiguousarray(values).data

    def rows(self, first: int, last: int) -> np.ndarray:
        """Return a view, [last - first, components]. No rows can be added while it is used."""
        dtype, width = self.format
        offset = first * width * dtype.itemsize
        values: np.ndarray = np.ndarray((last - first, width), dtype, self._bytes, offset)
        return values


class FileRows(RowArray):
    """Rows in a work file, which arrays share: an .obj may have thousands.

    Rows of all of them take a multiple of 4 bytes.
    """

    def __init__(self, file: WorkFile) -> None:
        """Start without rows."""
        super().__init__()
        self._file = file
        # Of each block: the rows before it, and then all; the bytes before it in the file.
        self._begins, self._offsets = [0], list[int]()

    def _append(self, values: np.ndarray) -> None:
        if len(values):
            self._offsets.append(self._file.size)
            self._begins.append(self._begins[-1] + len(values))
            self._file.append(values)

    def rows(self, first: int, last: int) -> np.ndarray:
        """Return a copy, [last - first, components]. Raises OSError."""
        (dtype, width), begins = self.format, self._begins
        result = np.empty((last - first, width), dtype)
        block = bisect_right(begins, first) - 1
        row = first
        while row < last:
            end = min(begins[block + 1], last)
            start = self._offsets[block] // dtype.itemsize + (row - begins[block]) * width
            values = self._file.rows(dtype, start, (end - row) * width)
            result[row - first : end - first] = values.reshape(-1, width)
            row, block = end, block + 1
        return result

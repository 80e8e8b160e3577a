"""Arrays of rows that grow while a file is read, in memory or in a work file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping

import numpy as np

from gltf_ext.gltf.accessors import Format
from gltf_ext.work_files import WorkFile


class RowArray(ABC):
    """Rows of one type, which are added and read in blocks.

    Attributes:
        form: type and number of components; count: number of rows.
    """

    def __init__(self) -> None:
        """Start without rows."""
        self.form: Format = (np.dtype("<f4"), 0)
        self.count = 0

    def add(self, values: np.ndarray) -> None:
        """Append values: [n, components], of the same form each time. Raises OSError."""
        form = values.dtype, values.shape[1]
        assert not self.count or form == self.form
        self.form = form
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
        dtype, width = self.form
        offset = first * width * dtype.itemsize
        values: np.ndarray = np.ndarray((last - first, width), dtype, self._bytes, offset)
        return values


class FileRows(RowArray):
    """Rows in a work file in a folder."""

    def __init__(self, folder: str) -> None:
        """Open the file. Raises OSError."""
        super().__init__()
        self._file = WorkFile(folder)

    def _append(self, values: np.ndarray) -> None:
        self._file.append(values)

    def rows(self, first: int, last: int) -> np.ndarray:
        """Return a copy, [last - first, components]. Raises OSError."""
        dtype, width = self.form
        return self._file.rows(dtype, first * width, (last - first) * width).reshape(-1, width)

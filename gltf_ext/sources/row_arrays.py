"""Arrays of rows that grow while a file is read, in memory or in a work file."""

from __future__ import annotations

import weakref
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gltf_ext.document.accessors import Format
from gltf_ext.errors import EXPORT_AGAIN, MeshletError
from gltf_ext.work_files import WorkFile

ALIGNMENT = 8  # bytes of the largest number
RUN_ROWS, GAP_ROWS = 1 << 18, 1 << 12  # read at a time; not needed, but read with those around


class Rows(Protocol):
    """Elements of `format` that are read in blocks."""

    @property
    def count(self) -> int:
        """The number of elements."""
        ...

    @property
    def format(self) -> Format:
        """Their type."""
        ...

    def rows(self, first: int, last: int) -> np.ndarray:
        """[last - first, components] elements. Raises MeshletError, OSError."""
        ...


# Attributes that have the same numbers at corners, and these: [3 T, 1]. None for 0, 1, 2 ...
Numbering = tuple[tuple[str, ...], Rows | None]


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

    @abstractmethod
    def gather(self, numbers: np.ndarray) -> np.ndarray:
        """Return a copy of these rows: [len(numbers), components]. Raises OSError."""


def add_all(arrays: Mapping[str, RowArray], values: Mapping[str, np.ndarray]) -> None:
    """Append values to the arrays of the same names. Raises MeshletError for others, OSError."""
    for name, rows in values.items():
        if arrays[name].count and arrays[name].format != (rows.dtype, rows.shape[1]):
            raise MeshletError(f"has values of {name} of different types", EXPORT_AGAIN)
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

    def gather(self, numbers: np.ndarray) -> np.ndarray:
        """Return a copy of these rows."""
        result: np.ndarray = self.rows(0, self.count)[numbers]
        return result


class FileRows(RowArray):
    """Rows in a work file, which arrays share: an .obj may have thousands.

    Blocks begin at multiples of ALIGNMENT bytes, since numbers are read by their index in the file.
    """

    def __init__(self, file: WorkFile) -> None:
        """Start without rows."""
        super().__init__()
        self._file = file
        # Of each block: the rows before it, and then all; the bytes before it in the file.
        self._begins, self._offsets = [0], list[int]()

    def _append(self, values: np.ndarray) -> None:
        if len(values):
            if padding := -self._file.size % ALIGNMENT:
                self._file.append(np.zeros(padding, np.uint8))
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

    def gather(self, numbers: np.ndarray) -> np.ndarray:
        """Return a copy of these rows, which are read in runs. Raises OSError."""
        different, inverse = np.unique(numbers, return_inverse=True)
        is_end = (np.diff(different) > GAP_ROWS) | (np.diff(different // RUN_ROWS) != 0)
        values = [
            self.rows(int(run[0]), int(run[-1]) + 1)[run - run[0]]
            for run in np.split(different, np.flatnonzero(is_end) + 1)
            if len(run)
        ]
        return np.concatenate([*values, np.empty((0, self.format[1]), self.format[0])])[inverse]


def rows_in_files(folder: str) -> NewRows:
    """Return what makes rows in one work file; in another one once all of these are gone.

    The file of a first reading then gives its space back before a second one.
    """
    last: weakref.ref[WorkFile] | None = None

    def new_rows() -> FileRows:
        nonlocal last
        file = last() if last else None
        if file is None:
            file = WorkFile(folder)
            last = weakref.ref(file)
        return FileRows(file)

    return new_rows


# --- parts of rows ---


@dataclass(frozen=True)
class RowRange:
    """The rows [first, last) of others."""

    source: Rows
    first: int
    last: int

    @property
    def count(self) -> int:
        """The number of rows."""
        return self.last - self.first

    @property
    def format(self) -> Format:
        """Their type."""
        return self.source.format

    def rows(self, first: int, last: int) -> np.ndarray:
        """[last - first, components] rows. Raises OSError."""
        return self.source.rows(self.first + first, self.first + last)


@dataclass(frozen=True)
class RowsWithout:
    """Integers from which a number is subtracted."""

    source: Rows
    number: int

    @property
    def count(self) -> int:
        """The number of rows."""
        return self.source.count

    @property
    def format(self) -> Format:
        """Their type."""
        return self.source.format

    def rows(self, first: int, last: int) -> np.ndarray:
        """[last - first, components] rows. Raises OSError."""
        rows = self.source.rows(first, last)
        result: np.ndarray = rows - rows.dtype.type(self.number)
        return result

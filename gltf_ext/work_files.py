"""Work files, of which nothing is left however the process ends."""

from __future__ import annotations

import ctypes
import mmap
import shutil
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from gltf_ext.errors import MeshletError
from gltf_ext.portable import allow_open_files

MAX_SPOOLED = 1 << 24  # bytes
BUCKET_BYTES = 1 << 24  # of the rows of a part: while it is worked on, it takes ten times as much
MAX_BUCKETS = 256  # files that are open at a time

Data = bytes | memoryview | np.ndarray


def check_space(folder: str, needed_bytes: int) -> None:
    """Raise MeshletError when the disk of a folder has less space than work files need."""
    free_bytes = shutil.disk_usage(folder).free
    if free_bytes < needed_bytes:
        raise MeshletError(
            f"work files need {needed_bytes:,} bytes, {free_bytes:,} are free",
            "free some space or use another work_dir",
            path=folder,
            options=("work_dir",),
        )


class WorkFile:
    """A file without a name, or on Windows with one that goes when the file is closed.

    Errors name its folder. Several threads may read and write at a time. They take turns: Python
    for Windows cannot read at a place without moving the file's position.
    """

    def __init__(self, folder: str = "") -> None:
        """folder: by default that of the system for temporary files."""
        self._folder = folder = folder or tempfile.gettempdir()
        self.size = 0
        self._turn = threading.RLock()
        with _naming(folder):
            self._file = tempfile.TemporaryFile(dir=folder, buffering=0)  # noqa: SIM115  kept open

    def append(self, data: Data) -> None:
        """Write bytes, or an array as it lies in memory. Raises OSError."""
        with self._turn:
            self.write(data, self.size)

    def write(self, data: Data, offset: int) -> None:
        """Write the same from byte `offset` on."""
        if isinstance(data, np.ndarray):
            data = np.ascontiguousarray(data).reshape(-1).view(np.uint8).data
        remainder = memoryview(data)
        with self._turn, _naming(self._folder):
            self._file.seek(offset)
            while len(remainder):
                remainder = remainder[self._file.write(remainder) :]
            self.size = max(self.size, self._file.tell())

    def truncate(self, size: int) -> None:
        """Give back the space of all bytes from `size` on."""
        with self._turn, _naming(self._folder):
            self._file.truncate(size)
            self.size = size

    def rows(self, dtype: np.dtype, first: int, count: int) -> np.ndarray:
        """Return dtype[count], from row `first` on. Raises OSError."""
        result = np.empty(count, dtype)
        remainder = result.view(np.uint8).data
        with self._turn, _naming(self._folder):
            self._file.seek(first * dtype.itemsize)
            while len(remainder):
                count_read = self._file.readinto(remainder)
                if not count_read:
                    raise OSError(0, "a work file was cut off")
                remainder = remainder[count_read:]
        return result

    def mapped(self) -> memoryview:
        """Return the contents, mapped into memory."""
        if not self.size:
            return memoryview(b"")
        return memoryview(mmap.mmap(self._file.fileno(), self.size, access=mmap.ACCESS_READ))

    def close(self) -> None:
        """Give the space on the disk back."""
        self._file.close()


def open_work_files(count: int, folder: str) -> list[WorkFile]:
    """Return so many work files that are open at a time. Raises OSError."""
    allow_open_files(count)
    return [WorkFile(folder) for _ in range(count)]


class Spool:
    """Bytes that wait to be written: in memory while they are few, then in a work file."""

    def __init__(self, folder: str | None, max_memory: int = MAX_SPOOLED) -> None:
        """folder: as for WorkFile; None to keep all in memory. max_memory: bytes in memory."""
        self._folder, self._max_memory = folder, max_memory
        self._parts, self._size = list[bytes](), 0
        self._file: WorkFile | None = None

    def append(self, data: Data) -> None:
        """Add bytes, or an array as it lies in memory. Raises OSError."""
        size = len(data) if isinstance(data, bytes) else data.nbytes
        if self._folder is not None and self._size + size > self._max_memory:
            self._file = self._file or WorkFile(self._folder)
            self._file.append(b"".join(self._parts))
            self._file.append(data)
            self._parts, self._size = [], 0
        else:
            self._parts.append(data if isinstance(data, bytes) else data.tobytes())
            self._size += size

    def contents(self) -> memoryview:
        """Return all bytes; those of a work file are mapped into memory."""
        tail = b"".join(self._parts)
        if self._file is None:
            return memoryview(tail)
        self._file.append(tail)
        return self._file.mapped()

    def close(self) -> None:
        """Give memory and disk back."""
        self._parts = []
        if self._file is not None:
            self._file.close()


class Buckets:
    """Rows, sorted by a key into parts that fit memory. Equal keys are in one part.

    They are in memory if there is one part only.
    """

    def __init__(self, dtype: np.dtype, total_bytes: int, folder: str = "") -> None:
        """total_bytes: about the bytes of all rows; folder: as for WorkFile."""
        self.dtype, self.count = dtype, 1 + min(total_bytes // BUCKET_BYTES, MAX_BUCKETS)
        self._rows: list[np.ndarray] = []
        self._files = open_work_files(self.count if self.count > 1 else 0, folder)

    def add(self, rows: np.ndarray, keys: np.ndarray) -> None:
        """keys: uint64[n], as hashes are. Raises OSError."""
        if self.count == 1:
            self._rows.append(rows)
            return
        part = (keys % np.uint64(self.count)).astype(np.int64)
        order = np.argsort(part, kind="stable")
        ends = np.cumsum(np.bincount(part, minlength=self.count))
        for file, selection in zip(self._files, np.split(order, ends[:-1])):
            file.append(rows[selection])

    def parts(self) -> Iterator[np.ndarray]:
        """Return the rows of each part; their file is given back. Raises OSError."""
        if self.count == 1:
            yield np.concatenate(self._rows) if self._rows else np.empty(0, self.dtype)
        for file in self._files:
            yield file.rows(self.dtype, 0, file.size // self.dtype.itemsize)
            file.close()


def hashes(rows: np.ndarray) -> np.ndarray:
    """Return uint64[n]: of the rows of an array of integers, [n, columns]. Rarely equal for two."""
    result = np.zeros(len(rows), np.uint64)
    for column in rows.T:
        result = (result + column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        result ^= result >> np.uint64(29)
    return result


def release(view: memoryview | bytes) -> None:
    """Give back the memory of a mapped file, which is read again when it is used again."""
    source = view.obj if isinstance(view, memoryview) else None
    if isinstance(source, mmap.mmap) and sys.platform != "win32":
        source.madvise(mmap.MADV_DONTNEED)


@contextmanager
def _naming(folder: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        error.filename = folder
        raise


def give_back_memory() -> None:
    """Return freed memory to the system, which glibc keeps for each thread.

    With 16 threads and 14 M triangles that was 55 MB more than with 2.
    """
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # musl has none
        if trim:
            trim(ctypes.c_size_t(0))

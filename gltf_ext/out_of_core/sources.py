"""Large primitives, read from their files in blocks."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pygltflib

from gltf_ext.compression.extension import is_compressed
from gltf_ext.compression.options import Options
from gltf_ext.compression.primitives import Box, place, triangle_primitives
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.accessors import Format, accessor_format, bounds
from gltf_ext.gltf.container import CHUNK_HEADER, GLB_HEADER
from gltf_ext.gltf.document import DAMAGED, Document, item
from gltf_ext.gltf.draco import DRACO
from gltf_ext.progress import Advance
from gltf_ext.scheduler import in_order

BLOCK = 1 << 17  # rows that are read at a time
# Bytes of memory for each triangle of a chunk, without and with levels of detail, and for all else.
CHUNK_BYTES, LOD_BYTES, BASE_BYTES = 220, 440, 80 << 20
VERTEX_SHARE = 0.6  # of the memory but BASE_BYTES, for vertices while triangles are read
BLOCK_BYTES = 64 << 20  # of memory, for each block but one that is read and sorted at a time
SMALLEST_CHUNK = 1 << 16  # triangles; smaller ones are mostly borders
# Several chunks fit memory, so that threads have one each; larger ones give no smaller files.
LARGE_CHUNK, AT_ONCE = 1 << 20, 16
MOST_CHUNKS = 512  # each has an open file
UNEVEN = 1.5  # triangles of a chunk over those that it aims at, which memory is left for


@dataclass
class FileArray:
    """The elements of an accessor in a file that stays closed until they are read.

    Attributes:
        path, offset, stride: of the first element, in bytes.
        count: number of elements; form: their type.
        stamp: of the file when it was found.
    """

    path: Path
    offset: int
    stride: int
    count: int
    form: Format
    stamp: tuple[int, int]

    def rows(self, first: int, last: int) -> np.ndarray:
        """[last - first, components] elements. Raises MeshletError, OSError."""
        dtype, components = self.form
        size = dtype.itemsize * components
        length = self.stride * (last - first - 1) + size
        with open(self.path, "rb") as file:
            file.seek(self.offset + self.stride * first)
            data = file.read(length)
        check_unchanged(self.path, self.stamp if len(data) == length else None)
        strides = (self.stride, dtype.itemsize)
        values: np.ndarray = np.ndarray((last - first, components), dtype, data, 0, strides)
        return values


class Rows(Protocol):
    """Elements of `form` that are read in blocks."""

    @property
    def count(self) -> int: ...

    @property
    def form(self) -> Format: ...

    def rows(self, first: int, last: int) -> np.ndarray:
        """[last - first, components] elements. Raises MeshletError, OSError."""
        ...


@dataclass
class LargePrimitive:
    """A list of triangles that is not in memory.

    Attributes:
        mesh, primitive: its place in the document.
        attributes: name -> elements.
        indices: the attributes that have the same numbers at corners, and these numbers; None for
            0, 1, 2 ...
        room: bytes of memory that vertices may take at a time.
        threads: number of blocks that are read at a time.
        bounds: name -> [2, components]: smallest and largest values at corners, once read.
    """

    mesh: int
    primitive: int
    attributes: dict[str, Rows]
    indices: list[tuple[tuple[str, ...], Rows | None]]
    room: int
    threads: int
    bounds: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def where(self) -> str:
        """Its place, for errors."""
        return place(self.mesh, self.primitive)

    def read_bounds(self, advance: Advance | None) -> None:
        """Sets `bounds`. Reads everything. Raises MeshletError for NaN and infinity, OSError."""
        for found in self.of_used_vertices(self._bounds, advance):
            for name, rows in found.items():
                rows = np.concatenate([self.bounds.get(name, rows), rows])
                self.bounds[name] = np.stack(bounds(rows))

    def of_used_vertices(
        self,
        function: Callable[[dict[str, np.ndarray]], Any],
        advance: Advance | None = None,
    ) -> Iterator[Any]:
        """What a function returns, on threads, for some vertices of triangles at a time: attributes
        that have numbers in common, [n, components]. Raises MeshletError, OSError."""
        whole = sum(self.attributes[names[0]].count for names, _ in self.indices)
        done = 0
        for names, numbers in self.indices:
            for low, high in blocks(self.attributes[names[0]].count, self.room):
                is_used = self._are_used(names, numbers, low, high)
                parts = list(blocks(high - low))
                tasks = ((function, names, low, is_used, *part) for part in parts)
                for (first, last), found in zip(parts, self.in_order(self._of_used, tasks)):
                    if found is not None:
                        yield found
                    done += last - first
                    if advance:
                        advance(done / whole)
                del is_used, tasks  # before the next flags are made

    def _of_used(
        self,
        function: Callable[[dict[str, np.ndarray]], Any],
        names: tuple[str, ...],
        low: int,
        is_used: np.ndarray,
        first: int,
        last: int,
    ) -> Any:
        here = is_used[first:last]
        if not here.any():
            return None
        values = self.vertices(names, low + first, low + last)
        return function({name: rows[here] for name, rows in values.items()})

    def in_order(
        self, function: Callable[..., Any], tasks: Iterable[tuple[Any, ...]]
    ) -> Iterator[Any]:
        """What a function returns for tasks, such as blocks, several of which run at a time."""
        return in_order(function, tasks, self.threads)

    def _are_used(
        self, names: tuple[str, ...], numbers: Rows | None, low: int, high: int
    ) -> np.ndarray:
        """bool[high - low]: whether triangles have these rows of the attributes."""
        is_used = np.full(high - low, numbers is None)

        def mark(first: int, last: int) -> None:
            rows = self.corners(names, numbers, first, last).reshape(-1)
            is_used[rows[(rows >= low) & (rows < high)] - low] = True

        for _ in self.in_order(mark, blocks(self.triangle_count if numbers else 0)):
            pass
        return is_used

    def _bounds(self, vertices: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        return {name: self._bounds_of(name, values) for name, values in vertices.items()}

    def _bounds_of(self, name: str, values: np.ndarray) -> np.ndarray:
        is_lossless = name.startswith("_")
        if values.dtype.kind == "f" and not is_lossless and not np.isfinite(values).all():
            raise MeshletError(
                f"{name} of {self.where} has a NaN or infinite value", "repair the model first"
            )
        low, high = bounds(values)
        is_weight = name.startswith("WEIGHTS_") and values.dtype.kind == "f"
        if is_weight and (low.min() < 0.0 or high.max() > 1.0):
            raise MeshletError(f"{name} of {self.where} is not in [0, 1]", "repair the model")
        return np.stack([low, high])

    @property
    def box(self) -> Box | None:
        """The bounds of its positions; None for integers."""
        low, high = self.bounds["POSITION"]
        return (low, high) if low.dtype.kind == "f" else None

    @property
    def triangle_count(self) -> int:
        names, numbers = self.indices[0]
        return (numbers or self.attributes[names[0]]).count // 3

    def vertices(self, names: tuple[str, ...], first: int, last: int) -> dict[str, np.ndarray]:
        """Name -> [last - first, components]. Raises MeshletError, OSError."""
        return {name: self.attributes[name].rows(first, last) for name in names}

    def corners(
        self, names: tuple[str, ...], numbers: Rows | None, first: int, last: int
    ) -> np.ndarray:
        """int64[last - first, 3]: rows of the attributes at the corners of triangles, from one of
        `indices`. Raises MeshletError, OSError."""
        if numbers is None:
            return np.arange(3 * first, 3 * last).reshape(-1, 3)
        rows = numbers.rows(3 * first, 3 * last).astype(np.int64).reshape(-1, 3)
        count = self.attributes[names[0]].count
        if len(rows) and not 0 <= rows.min() <= rows.max() < count:
            raise MeshletError(
                f"indices of {self.where} reach {rows.max()}, but it has {count} vertices",
                "export the model again",
            )
        return rows


def blocks(count: int, size: int = BLOCK) -> Iterator[tuple[int, int]]:
    """(first, last) of blocks of rows."""
    for first in range(0, count, size):
        yield first, min(first + size, count)


def stamp_of(path: Path) -> tuple[int, int]:
    """Size and time of the last change of a file."""
    status = os.stat(path)
    return status.st_size, status.st_mtime_ns


def check_unchanged(path: Path, stamp: tuple[int, int] | None) -> None:
    """Raises MeshletError for a file that has another stamp by now."""
    if stamp_of(path) != stamp:
        raise MeshletError("changed while it was read", "run the command again", str(path))


def large_primitives(
    document: Document, path: Path, options: Options
) -> dict[tuple[int, int], LargePrimitive]:
    """The primitives that do not fit memory, by (mesh, primitive): all but the smallest.

    path: the document's file. Raises MeshletError for one that has to be read as a whole.
    """
    limit = fitting(options)
    sizes = sorted(
        (_triangles(document, primitive), m, p) for m, p, primitive in triangle_primitives(document)
    )
    sums = np.cumsum([size for size, _, _ in sizes])
    return {
        (m, p): _large_primitive(document, path, m, p, options)
        for (_, m, p), total in zip(sizes, sums)
        if total > limit
    }


def _triangles(document: Document, primitive: pygltflib.Primitive) -> int:
    """About the number of triangles of a primitive."""
    index = primitive.indices
    if index is None:
        index = primitive.attributes.get("POSITION")
    return (item(document.accessors, index, "accessor").count or 0) // 3


def _large_primitive(
    document: Document, path: Path, mesh: int, index: int, options: Options
) -> LargePrimitive:
    primitive = document.meshes[mesh].primitives[index]
    where, reason = place(mesh, index), ""
    if is_compressed(primitive) or DRACO in (primitive.extensions or {}):
        reason = "is compressed"
    elif primitive.targets:
        reason = "has morph targets"
    elif primitive.mode != pygltflib.TRIANGLES:
        reason = "is a strip or a fan"
    if reason:
        raise _too_large(f"{where} {reason}")
    files = _Files(document, path)
    attributes: dict[str, Rows] = {
        name: files.array(accessor, f"{name} of {where}")
        for name, accessor in primitive.attributes.items()
    }
    if "POSITION" not in attributes:
        raise MeshletError(f"{where} has no POSITION", "export the model again")
    if len({array.count for array in attributes.values()}) > 1:
        raise MeshletError(f"{where} has attributes of unequal counts", "export the model again")
    widths = {"POSITION": 3, "NORMAL": 3, "TANGENT": 4}
    for name, array in attributes.items():
        if array.form[1] != widths.get(name, array.form[1]):
            raise MeshletError(f"{name} of {where} has {array.form[1]} components", DAMAGED)
    indices = None
    if primitive.indices is not None:
        indices = files.array(primitive.indices, f"indices of {where}")
        if indices.form[0].kind != "u" or indices.form[1] != 1:
            raise MeshletError(f"indices of {where} are not unsigned integers", DAMAGED)
    return LargePrimitive(
        mesh, index, attributes, [(tuple(attributes), indices)], *reading(options)
    )


def _too_large(problem: str) -> MeshletError:
    return MeshletError(
        f"{problem}, so it cannot be read in chunks",
        "allow more memory",
        options=("max_memory",),
    )


def reading(options: Options) -> tuple[int, int]:
    """(bytes of memory that vertices may take at a time, number of blocks at a time)."""
    free = options.memory - BASE_BYTES
    room = int(VERTEX_SHARE * free)
    return room, min(options.threads or os.cpu_count() or 1, 1 + (free - room) // BLOCK_BYTES)


def chunk_size(options: Options, triangles: int) -> int:
    """The number of triangles of a chunk, of so many in all. Raises MeshletError if memory does not
    hold one of MOST_CHUNKS."""
    most = fitting(options)
    if triangles > MOST_CHUNKS * most:
        raise _needs(options, -(-triangles // MOST_CHUNKS))
    return max(most // AT_ONCE, min(most, LARGE_CHUNK), triangles // MOST_CHUNKS)


def share_of_chunk(options: Options, triangles: int, largest: int = 0) -> tuple[int, int]:
    """(number of chunks that fit memory at a time, bytes that one takes with a process).

    largest: triangles of the largest one; up to UNEVEN times the size that chunks aim at is usual.
    """
    most, size = fitting(options), chunk_size(options, triangles)
    if largest > UNEVEN * size:
        size = min(largest, most)
    return most // size, BASE_BYTES + (options.memory - BASE_BYTES) * size // most


def fitting(options: Options) -> int:
    """The number of triangles that fit memory. Raises MeshletError for too few."""
    count = (options.memory - BASE_BYTES) // _triangle_bytes(options)
    if count < SMALLEST_CHUNK:
        raise _needs(options, SMALLEST_CHUNK)
    return count


def _triangle_bytes(options: Options) -> int:
    return LOD_BYTES if options.lod else CHUNK_BYTES


def _needs(options: Options, triangles: int) -> MeshletError:
    """The error for less memory than a chunk of so many triangles takes."""
    least = BASE_BYTES + triangles * _triangle_bytes(options)
    return MeshletError(
        f"max_memory is {options.max_memory}",
        f"use at least {-(-least >> 20)}M",
        options=("max_memory",),
    )


class _Files:
    """Finds accessors in the files of a document."""

    def __init__(self, document: Document, path: Path) -> None:
        self._document, self._path = document, path

    def array(self, index: int, name: str) -> FileArray:
        """Raises MeshletError."""
        document = self._document
        accessor = item(document.accessors, index, f"the accessor of {name},")
        form = accessor_format(accessor, name)
        if accessor.sparse is not None or accessor.bufferView is None or not accessor.count:
            raise _too_large(f"{name} is sparse or empty")
        view = item(document.bufferViews, accessor.bufferView, "bufferView")
        length = len(document.bytes_of_view(accessor.bufferView))
        size, offset = form[0].itemsize * form[1], accessor.byteOffset or 0
        stride = view.byteStride or size
        if offset < 0 or stride < size or offset + stride * (accessor.count - 1) + size > length:
            raise MeshletError(f"{name} reaches beyond bufferView {accessor.bufferView}", DAMAGED)
        file, start = self._file_of(view.buffer, name)
        start += (view.byteOffset or 0) + offset
        return FileArray(file, start, stride, accessor.count, form, stamp_of(file))

    def _file_of(self, buffer: int, name: str) -> tuple[Path, int]:
        """(file, byte of it at which the buffer begins)."""
        uri = self._document.buffers[buffer].uri
        if uri is None:
            with open(self._path, "rb") as file:
                file.seek(GLB_HEADER.size)
                json_length, _ = CHUNK_HEADER.unpack(file.read(CHUNK_HEADER.size))
            return self._path, GLB_HEADER.size + 2 * CHUNK_HEADER.size + json_length
        if uri.startswith("data:"):
            raise _too_large(f"{name} is in a data: uri")
        return self._document.path_of(uri), 0

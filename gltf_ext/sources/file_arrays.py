"""Sources that stay in their files."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.accessors import Format, accessor_format, element_count
from gltf_ext.document.container import CHUNK_HEADER, GLB_HEADER
from gltf_ext.document.document import DAMAGED, Document, item
from gltf_ext.document.draco import DRACO
from gltf_ext.errors import MeshletError
from gltf_ext.options import Options
from gltf_ext.sources.memory import reading_limits, triangles_that_fit
from gltf_ext.sources.primitives import is_compressed, place, triangle_primitives
from gltf_ext.sources.source import Source, read_source


@dataclass
class FileArray:
    """The elements of an accessor in a file that stays closed until they are read.

    Attributes:
        path, offset, stride: of the first element, in bytes.
        count: number of elements; format: their type.
        stamp: of the file when it was found.
    """

    path: Path
    offset: int
    stride: int
    count: int
    format: Format
    stamp: tuple[int, int]

    def rows(self, first: int, last: int) -> np.ndarray:
        """[last - first, components] elements. Raises MeshletError, OSError."""
        dtype, components = self.format
        size = dtype.itemsize * components
        length = self.stride * (last - first - 1) + size
        with open(self.path, "rb") as file:
            file.seek(self.offset + self.stride * first)
            data = file.read(length)
        check_unchanged(self.path, self.stamp if len(data) == length else None)
        strides = (self.stride, dtype.itemsize)
        values: np.ndarray = np.ndarray((last - first, components), dtype, data, 0, strides)
        return values


def stamp_of(path: Path) -> tuple[int, int]:
    """Size and time of the last change of a file."""
    status = os.stat(path)
    return status.st_size, status.st_mtime_ns


def check_unchanged(path: Path, stamp: tuple[int, int] | None) -> None:
    """Raise MeshletError for a file that has another stamp by now."""
    if stamp_of(path) != stamp:
        raise MeshletError("changed while it was read", "run the command again", str(path))


def large_primitives(
    document: Document, path: Path, options: Options
) -> dict[tuple[int, int], Source]:
    """Return the primitives that do not fit memory, by (mesh, primitive): all but the smallest.

    path: the document's file. Raises MeshletError for one that has to be read as a whole.
    """
    limit = triangles_that_fit(options)
    sizes = sorted(
        (_triangles(document, primitive), m, p) for m, p, primitive in triangle_primitives(document)
    )
    sums = np.cumsum([size for size, _, _ in sizes])
    return {
        (m, p): _large_primitive(document, path, m, p, options)
        for (_, m, p), total in zip(sizes, sums)
        if total > limit
    }


def _triangles(document: Document, primitive: gltf.Primitive) -> int:
    """About the number of triangles of a primitive."""
    index = primitive.get("indices", primitive["attributes"].get("POSITION"))
    return item(document.accessors, index, "accessor").get("count", 0) // 3


def _large_primitive(
    document: Document, path: Path, mesh: int, index: int, options: Options
) -> Source:
    primitive = document.primitive(mesh, index)
    reason = ""
    if is_compressed(primitive) or gltf.has_extension(primitive, DRACO):
        reason = "is compressed"
    elif gltf.mode(primitive) != gltf.TRIANGLES:
        reason = "is a strip or a fan"
    if reason:
        raise _too_large(f"{place(mesh, index)} {reason}")
    return read_source(
        document, mesh, index, _AccessorFiles(document, path).array, *reading_limits(options)
    )[0]


def _too_large(problem: str) -> MeshletError:
    return MeshletError(
        f"{problem}, so it cannot be read in chunks",
        "allow more memory",
        options=("max_memory",),
    )


class _AccessorFiles:
    """Finds accessors in the files of a document."""

    def __init__(self, document: Document, path: Path) -> None:
        self._document, self._path = document, path

    def array(self, index: int, name: str, count: int | None) -> FileArray:
        """Return an accessor, of `count` elements. Raises MeshletError."""
        document = self._document
        accessor = item(document.accessors, index, f"the accessor of {name},")
        format_ = accessor_format(accessor, name)
        elements = element_count(accessor, name, count)
        if "sparse" in accessor or "bufferView" not in accessor or not elements:
            raise _too_large(f"{name} is sparse or empty")
        index = accessor["bufferView"]
        if index in document.new_bytes:  # its bytes were packed in the file
            raise _too_large(f"{name} is compressed")
        length, view = len(document.bytes_of_view(index)), document.bufferViews[index]
        size, offset = format_[0].itemsize * format_[1], gltf.byte_offset(accessor)
        stride = gltf.stride(view, size)
        if offset < 0 or stride < size or offset + stride * (elements - 1) + size > length:
            raise MeshletError(f"{name} reaches beyond bufferView {index}", DAMAGED)
        file, start = self._file_of(view["buffer"], name)
        start += gltf.byte_offset(view) + offset
        return FileArray(file, start, stride, elements, format_, stamp_of(file))

    def _file_of(self, buffer: int, name: str) -> tuple[Path, int]:
        """(file, byte of it at which the buffer begins)."""
        uri = self._document.buffers[buffer].get("uri")
        if uri is None:
            with open(self._path, "rb") as file:
                file.seek(GLB_HEADER.size)
                json_length, _ = CHUNK_HEADER.unpack(file.read(CHUNK_HEADER.size))
            return self._path, GLB_HEADER.size + 2 * CHUNK_HEADER.size + json_length
        if uri.startswith("data:"):
            raise _too_large(f"{name} is in a data: uri")
        return self._document.path_of(uri), 0

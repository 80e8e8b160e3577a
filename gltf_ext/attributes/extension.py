"""Reads EXT_meshlet_edgebreaker: from a primitive's extension object to its decoded arrays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import Stream
from gltf_ext.attributes.streams import GRID, OCT, SIGN, streams_of, to_accessor
from gltf_ext.document import gltf
from gltf_ext.document.accessors import Format, accessor_format
from gltf_ext.document.document import Document, item
from gltf_ext.document.json_values import minified
from gltf_ext.errors import MeshletError
from gltf_ext.sources.attribute_names import pair_names
from gltf_ext.sources.primitives import (
    EXTENSION,
    DropCounts,
    Primitive,
    all_primitives,
    is_compressed,
    place,
)
from gltf_ext.sources.source import Source, read_primitive, read_source
from gltf_ext.work_files import release

PART_BYTES = 1 << 20  # of blobs that are decoded at a time: about 400,000 triangles


@dataclass
class Compressed:
    """One compressed primitive of a document.

    Attributes:
        mesh, primitive: its place in the document; name: the mesh's name.
        object: the extension's JSON object.
        view, blob: the buffer view of the compressed bytes, and the bytes: one blob, or several
            back to back (pages).
        attributes, targets: name -> (first stream, accessor format).
    """

    mesh: int
    primitive: int
    name: str
    object: dict[str, Any]
    view: int
    blob: memoryview
    streams: list[Stream]
    triangle_count: int
    vertex_count: int
    attributes: dict[str, tuple[int, Format]]
    targets: list[dict[str, tuple[int, Format]]]

    @property
    def where(self) -> str:
        """Its place, for errors."""
        return place(self.mesh, self.primitive)

    @property
    def blobs(self) -> list[bytes]:
        """The blobs of the view. Each decodes alone; their vertices and meshlets follow on."""
        return [bytes(self.blob[start : start + size]) for start, size in _codec.split(self.blob)]

    @property
    def source_vertices(self) -> int:
        """Vertices before the encoder duplicated any."""
        return int(self.object.get("sourceVertices", self.vertex_count))

    @property
    def json_bytes(self) -> int:
        """Size of the extension's JSON object."""
        return len(minified(self.object))

    @property
    def named_streams(self) -> list[tuple[str, range, Format]]:
        """(name, streams, format) of each attribute and target, targets as "targets[i].NAME"."""
        return [
            (name, streams_of(first, form[1], self.streams), form)
            for name, (first, form) in pair_names([self.attributes, *self.targets])
        ]

    def decode(self) -> Primitive:
        """Decode all triangles and attributes, in the accessors' types. Raises MeshletError."""
        with malformed_from(self.where):
            return self.as_primitive(*_codec.decode_values(self.blob))

    def parts(self) -> Iterator[tuple[np.ndarray, list[np.ndarray]]]:
        """Yield (triangles, values of streams) of some blobs at a time, for `as_primitive`.

        Indices number the vertices of all parts. Raises MeshletError.
        """
        first = 0
        for part in parts_of(self.blob):
            with malformed_from(self.where):
                triangles, values = _codec.decode_values(part)
            yield triangles + np.uint32(first), values
            first += len(values[0])

    def as_primitive(self, triangles: np.ndarray, values: list[np.ndarray]) -> Primitive:
        """Convert decoded triangles uint32[T, 3] and streams to the accessors' component types."""
        attributes, *targets = (
            {
                name: to_accessor(
                    [values[s] for s in streams_of(first, form[1], self.streams)], form[0]
                )
                for name, (first, form) in names.items()
            }
            for names in (self.attributes, *self.targets)
        )
        return Primitive(self.mesh, self.primitive, triangles, attributes, targets)


def parts_of(blobs: memoryview) -> Iterator[memoryview]:
    """Blobs that lie back to back, in parts of about PART_BYTES: they need not fit memory decoded.

    Mapped memory of the parts before is given back.
    """
    first = 0
    for start, size in [*_codec.split(blobs), (len(blobs), PART_BYTES)]:
        if start > first and start + size - first > PART_BYTES:
            yield blobs[first:start]
            release(blobs)
            first = start


def malformed(where: str, reason: Any) -> MeshletError:
    """Return the error for a compressed primitive that breaks the specification."""
    if "version" in str(reason):  # not damaged, and the reason says what to do
        return MeshletError(f"{where}: {reason}")
    return MeshletError(f"{where}: {reason}", "the file is damaged; compress the original again")


@contextmanager
def malformed_from(where: str) -> Iterator[None]:
    """Raise `malformed` for a ValueError inside; a MeshletError stays."""
    try:
        yield
    except MeshletError:
        raise
    except ValueError as error:
        raise malformed(where, error) from None


def has_compressed(document: Document) -> bool:
    """Return whether any primitive has the extension."""
    return any(is_compressed(primitive) for _, _, primitive in all_primitives(document))


def compressed_primitives(document: Document) -> list[Compressed]:
    """Return every primitive with the extension, in order of (mesh, primitive).

    Checks objects and headers. Raises MeshletError.
    """
    return [
        read_compressed(document, m, p)
        for m, p, primitive in all_primitives(document)
        if is_compressed(primitive)
    ]


def require_compressed(document: Document) -> list[Compressed]:
    """Return the compressed primitives. Raises MeshletError when there is none."""
    compressed = compressed_primitives(document)
    if not compressed:
        raise MeshletError(
            f"has no primitive with {EXTENSION}",
            "compress it first: gltf-meshlet compress IN OUT.glb",
        )
    return compressed


def read_triangles(document: Document, mesh: int, index: int) -> tuple[Primitive, DropCounts]:
    """Any triangle primitive as arrays: decoded if it is compressed. Raises MeshletError."""
    if is_compressed(document.primitive(mesh, index)):
        return read_compressed(document, mesh, index).decode(), DropCounts()
    return read_primitive(document, mesh, index)


def source_of(document: Document, mesh: int, index: int) -> tuple[Source, DropCounts]:
    """Return the same as a source in memory. Raises MeshletError."""
    if is_compressed(document.primitive(mesh, index)):
        return Source.of(read_compressed(document, mesh, index).decode()), DropCounts()
    return read_source(document, mesh, index)


def read_compressed(document: Document, mesh: int, index: int) -> Compressed:
    """Return the compressed primitive at this place. Raises MeshletError.

    Checks every index, count and type of its JSON.
    """
    primitive = document.primitive(mesh, index)
    where = place(mesh, index)
    extension = gltf.extension(primitive, EXTENSION)
    formats = [
        {
            name: _format(document, accessor, f"{name} of {where}")
            for name, accessor in names.items()
        }
        for names in gltf.attribute_sets(primitive)
    ]
    with malformed_from(where):
        first_streams = _first_streams(extension, formats, primitive)
        require_plain(item(document.bufferViews, extension["bufferView"], "bufferView"))
        blob = document.bytes_of_view(extension["bufferView"])
        view = _codec.View(blob)
        attributes, *targets = (
            {name: (first, forms[name]) for name, first in streams.items()}
            for streams, forms in zip(first_streams, formats)
        )
        result = Compressed(
            mesh,
            index,
            document.meshes[mesh].get("name", ""),
            extension,
            extension["bufferView"],
            blob,
            view.streams,
            view.triangle_count,
            view.vertex_count,
            attributes,
            targets,
        )
        _check_streams(result)
        _check_counts(document, primitive, result)
        return result


def require_plain(view: gltf.BufferView) -> None:
    """Raise ValueError unless a buffer view can be used as it lies in its buffer."""
    if "byteStride" in view or "target" in view or gltf.byte_offset(view) % 4:
        raise ValueError(
            "its buffer view has a byteStride, a target or an offset that is not a multiple of 4"
        )


def require_unused_by_accessors(document: Document, views: list[int]) -> None:
    """Raise ValueError if an accessor refers to one of the buffer views."""
    used = set()
    for accessor in document.accessors:
        sparse = accessor.get("sparse", {})
        parts = (accessor, sparse.get("indices", {}), sparse.get("values", {}))
        used |= {part.get("bufferView") for part in parts}
    if used & set(views):
        raise ValueError("an accessor refers to a buffer view of compressed data")


def _format(document: Document, accessor: int, what: str) -> Format:
    return accessor_format(item(document.accessors, accessor, f"the accessor of {what},"), what)


def _is_index(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _first_streams(
    extension: Any, formats: list[dict[str, Format]], primitive: gltf.Primitive
) -> list[dict[str, int]]:
    """Return name -> first stream: of the attributes, then of each target.

    Raises ValueError unless the object names a view, and a stream for each attribute.
    """
    if gltf.mode(primitive) != gltf.TRIANGLES or "indices" not in primitive:
        raise ValueError("a compressed primitive must have mode 4 and indices")
    if not isinstance(extension, dict) or not _is_index(extension.get("bufferView")):
        raise ValueError("the extension object names no bufferView")
    targets = extension.get("targets", [])
    if not isinstance(targets, list) or len(targets) != len(formats) - 1:
        raise ValueError(f"the extension object does not have {len(formats) - 1} targets")
    result = [extension.get("attributes"), *targets]
    for streams, names in zip(result, formats):
        if (
            not isinstance(streams, dict)
            or streams.keys() != names.keys()
            or not all(map(_is_index, streams.values()))
        ):
            raise ValueError(
                "the extension object does not give a stream for exactly each attribute"
            )
    if result[0].get("POSITION") != 0:
        raise ValueError("POSITION is not stream 0")
    if not _is_index(extension.get("sourceVertices", 0)):
        raise ValueError("sourceVertices is not a count")
    return result


def _check_streams(compressed: Compressed) -> None:
    """Check the streams' kinds and users.

    Raises ValueError unless positions are on a grid, each stream has one attribute, and unit
    vectors and signs have float accessors.
    """
    if (compressed.streams[0].kind, compressed.streams[0].elements) != (GRID, 3):
        raise ValueError("the first stream is not a grid of 3 elements")
    used = sorted(s for _, streams, _ in compressed.named_streams for s in streams)
    if used != list(range(len(compressed.streams))):
        raise ValueError("the streams are not each used by one attribute")
    for name, streams, (dtype, _) in compressed.named_streams:
        if dtype.kind != "f" and any(compressed.streams[s].kind in (OCT, SIGN) for s in streams):
            raise ValueError(f"{name} has integers, but a stream of unit vectors or signs")


def _check_counts(document: Document, primitive: gltf.Primitive, compressed: Compressed) -> None:
    """Raise ValueError unless the accessors have the counts of the decoded data."""
    indices = item(document.accessors, primitive["indices"], "the accessor of indices")
    dtype, components = accessor_format(indices, "indices")
    count = indices.get("count")
    if count != 3 * compressed.triangle_count or components != 1:
        raise ValueError(
            f"its indices accessor has {count} elements instead of {3 * compressed.triangle_count}"
        )
    if dtype.kind != "u" or compressed.vertex_count - 1 > np.iinfo(dtype).max:
        raise ValueError("its indices accessor's component type cannot hold its indices")
    for attributes in gltf.attribute_sets(primitive):
        for name, accessor in attributes.items():
            count = document.accessors[accessor].get("count")
            if count != compressed.vertex_count:
                raise ValueError(
                    f"its {name} accessor has {count} elements instead of {compressed.vertex_count}"
                )

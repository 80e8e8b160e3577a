"""Drops unused accessors and buffer views, renumbers the rest, and lays out the buffers."""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Callable
from typing import Any

from gltf_ext.document import gltf
from gltf_ext.document.accessors import accessor_format, drop_infinite_bounds
from gltf_ext.document.document import Document, NewBytes, item
from gltf_ext.document.references import Renumber, map_accessors, map_views, pinned_numbers
from gltf_ext.errors import MeshletError

BLOB_ALIGNMENT = 4
METADATA_ALIGNMENT = 8
WITH_METADATA = ("EXT_structural_metadata", "EXT_feature_metadata", "EXT_mesh_features")
# What stands for an unused accessor or buffer view, where the numbers of later ones must stay.
NO_ACCESSOR: gltf.Accessor = {"componentType": gltf.FLOAT, "count": 1, "type": "SCALAR"}
NO_BYTES = bytes(4)

Pieces = list[bytes | memoryview]


def pack(document: Document, most: int, split_bytes: int) -> tuple[list[Pieces], Pieces]:
    """Drop unused data and lays out the buffers: (pieces of each, of the fallback's).

    Views added with `fallback` go to the last buffer, all others to buffer 0 if they take at most
    `most` bytes. Else each buffer has at most `split_bytes`, or one larger view.
    """
    _drop_unused(document)
    for accessor in document.accessors:
        drop_infinite_bounds(accessor)  # JSON cannot hold them
    return _lay_out(document, most, split_bytes)


# --- dropping ---


Mapper = Callable[[Document, Renumber], None]


def _used(
    document: Document, mapper: Mapper, items: list[Any], kind: str, pinned: set[int]
) -> tuple[list[int], set[int]]:
    """Return (the items that stay, in their order; of these, those in use).

    Renumbers every reference to them. Up to the last pinned item, all stay: its number may stand
    in an unknown extension.
    """
    used = {index for index in pinned if index < len(items)}
    last = max(used, default=-1)

    def note(index: int) -> int:
        item(items, index, kind)
        used.add(index)
        return index

    mapper(document, note)
    indices = sorted(used | set(range(last + 1)))
    new_index = {old: new for new, old in enumerate(indices)}
    mapper(document, new_index.__getitem__)
    return indices, used


def _drop_unused(document: Document) -> None:
    accessors, pinned = list(document.accessors), pinned_numbers(document, "accessor")
    indices, used = _used(document, map_accessors, accessors, "accessor", pinned)
    document.accessors[:] = [accessors[i] if i in used else {**NO_ACCESSOR} for i in indices]
    if len(used) < len(accessors):
        _trim_views(document)
    pinned = pinned_numbers(document, "bufferview")
    indices, used = _used(document, map_views, document.bufferViews, "bufferView", pinned)
    for index in set(indices) - used:
        document.bufferViews[index] = {"buffer": 0, "byteLength": len(NO_BYTES)}
        document.new_bytes[index] = NewBytes(memoryview(NO_BYTES), False)
    document.arrange_views(indices)


def _trim_views(document: Document) -> None:
    """Cut old buffer views down to the bytes that the remaining accessors need."""
    readers: dict[int, list[gltf.Accessor]] = defaultdict(list)
    for accessor in document.accessors:
        if "bufferView" in accessor:
            view = accessor["bufferView"]
            item(document.bufferViews, view, "bufferView")
            if view not in document.new_bytes:
                readers[view].append(accessor)
    others = _views_of_others(document, readers)
    for index, accessors in readers.items():
        if index not in others:
            _split_view(document, index, accessors)


def _views_of_others(document: Document, readers: dict[int, list[gltf.Accessor]]) -> set[int]:
    """Buffer views with references other than these accessors' own: images, sparse parts, ..."""
    references: dict[int, int] = defaultdict(int)

    def count(index: int) -> int:
        references[index] += 1
        return index

    map_views(document, count)
    return {index for index, n in references.items() if n > len(readers.get(index, ()))}


@dataclasses.dataclass
class _Run:
    """Bytes start..end of a buffer view, and the accessors that read them."""

    start: int
    end: int
    accessors: list[gltf.Accessor]


def _split_view(document: Document, index: int, accessors: list[gltf.Accessor]) -> None:
    """Replace a buffer view by one view per run of used bytes, if that drops any byte."""
    view, data = document.bufferViews[index], document.bytes_of_view(index)
    spans = sorted(
        ((*_span(accessor, view, len(data)), accessor) for accessor in accessors),
        key=lambda span: span[:2],
    )
    runs: list[_Run] = []
    for start, end, accessor in spans:
        start -= start % BLOB_ALIGNMENT
        if runs and start < runs[-1].end:
            runs[-1].end = max(runs[-1].end, end)
            runs[-1].accessors.append(accessor)
        else:
            runs.append(_Run(start, end, [accessor]))
    if sum(run.end - run.start for run in runs) == len(data):
        return
    same: Any = {name: v for name, v in view.items() if name in ("byteStride", "target", "name")}
    for run in runs:
        new = document.add_view(data[run.start : run.end], properties=same)
        for accessor in run.accessors:
            accessor["bufferView"] = new
            if "byteOffset" in accessor:
                accessor["byteOffset"] -= run.start


def _span(accessor: gltf.Accessor, view: gltf.BufferView, available: int) -> tuple[int, int]:
    """Return (first byte, end) of an accessor in its view; the whole view if it is not valid."""
    try:
        dtype, components = accessor_format(accessor, "an accessor")
    except MeshletError:
        return 0, available
    size, start = dtype.itemsize * components, gltf.byte_offset(accessor)
    end = start + gltf.stride(view, size) * (max(accessor.get("count", 0), 1) - 1) + size
    return (start, end) if 0 <= start < end <= available else (0, available)


# --- layout ---


@dataclasses.dataclass(eq=False)
class _Buffer:
    pieces: Pieces = dataclasses.field(default_factory=list)
    length: int = 0

    def add(self, content: bytes | memoryview, alignment: int) -> int:
        """Return the offset of the content."""
        padding = -self.length % alignment
        self.pieces += [bytes(padding), content]
        self.length += padding + len(content)
        return self.length - len(content)


def _lay_out(document: Document, most: int, split_bytes: int) -> tuple[list[Pieces], Pieces]:
    """Place the views one after the other in their buffers and replaces the list of buffers."""
    alignment = BLOB_ALIGNMENT
    if any(name in document.extensionsUsed for name in WITH_METADATA):
        alignment = METADATA_ALIGNMENT
    contents = [_content(document, i) for i in range(len(document.bufferViews))]
    size = sum(alignment + len(content) for content, is_fallback in contents if not is_fallback)
    buffers, fallback, owners = [_Buffer()], _Buffer(), []
    for index, (content, is_fallback) in enumerate(contents):
        view, last = document.bufferViews[index], buffers[-1]
        if size > most and last.length and last.length + alignment + len(content) > split_bytes:
            buffers += [] if is_fallback else [_Buffer()]
        owners.append(fallback if is_fallback else buffers[-1])
        is_stated = "byteOffset" in view and index not in document.new_bytes
        view["byteOffset"] = owners[-1].add(content, alignment)
        if not view["byteOffset"] and not is_stated:
            del view["byteOffset"]  # the default, where the file does not state it
    first: gltf.Buffer = document.buffers[0] if document.buffers else {}
    first.pop("uri", None)
    filled = [buffer for buffer in (*buffers, fallback) if buffer.length]
    others: list[gltf.Buffer] = [{} for _ in filled[1:]]
    document.buffers[:] = [first, *others][: len(filled)]
    for holder, buffer in zip(document.buffers, filled):
        holder["byteLength"] = buffer.length
    for view, owner in zip(document.bufferViews, owners):
        view["buffer"] = filled.index(owner) if owner.length else 0
    return [buffer.pieces for buffer in buffers], fallback.pieces


def _content(document: Document, view: int) -> tuple[bytes | memoryview, bool]:
    """Return the bytes to write for a view, and whether they are the fallback's."""
    content, new = document.bytes_of_view(view), document.new_bytes.get(view)
    if new is None:
        return content, False
    return (content if new.packed is None else new.packed), new.fallback

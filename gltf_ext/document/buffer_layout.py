"""Drops unused accessors and buffer views, renumbers the rest, and lays out the buffers."""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Callable, Iterator
from typing import Any

from gltf_ext.document import gltf
from gltf_ext.document.accessors import accessor_format, drop_infinite_bounds
from gltf_ext.document.document import Document, item
from gltf_ext.errors import MeshletError

Renumber = Callable[[int], int]
# Extensions whose accessor and buffer view indices are all found by map_accessors and map_views.
SAFE_PREFIXES = (
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_mesh_quantization",
    "KHR_draco_mesh_compression",
    "KHR_animation_pointer",
    "KHR_xmp",
    "KHR_node_",
    "EXT_texture_",
    "EXT_lights_",
    "EXT_mesh_features",
    "EXT_mesh_gpu_instancing",
    "EXT_structural_metadata",
    "EXT_meshlet_edgebreaker",
    "EXT_meshlet_lod",
    "EXT_meshlet_transport",
    "MSFT_lod",
    "MSFT_texture_dds",
    "FB_ngon_encoding",
    "VRM",
)
# EXT_structural_metadata: the buffer views of a property table's property.
METADATA_VIEW_KEYS = ("values", "arrayOffsets", "stringOffsets")
BLOB_ALIGNMENT = 4
METADATA_ALIGNMENT = 8

Pieces = list[bytes | memoryview]


def pack(document: Document, most: int, split_bytes: int) -> tuple[list[Pieces], Pieces]:
    """Drop unused data and lays out the buffers: (pieces of each, of the fallback's).

    Views added with `fallback` go to the last buffer, all others to buffer 0 if they take at most
    `most` bytes. Else each buffer has at most `split_bytes`, or one larger view. If an extension
    unknown to this package holds integers, nothing old is dropped or renumbered.
    """
    if not unknown_index_holders(document):
        _drop_unused(document)
    for accessor in document.accessors:
        drop_infinite_bounds(accessor)  # JSON cannot hold them
    return _lay_out(document, most, split_bytes)


def unknown_index_holders(document: Document) -> list[str]:
    """Name of unknown extensions in use that hold integers, which may be indices."""
    return sorted(
        {
            name
            for name, value in _extensions(document.json)
            if not name.startswith(SAFE_PREFIXES) and _holds_integer(value)
        }
    )


def _holds_integer(value: Any) -> bool:
    if isinstance(value, dict):
        return any(_holds_integer(v) for v in value.values())
    if isinstance(value, list):
        return any(_holds_integer(v) for v in value)
    return isinstance(value, int) and not isinstance(value, bool)


# --- references ---


def _extensions(value: Any) -> Iterator[tuple[str, Any]]:
    """Return (name, object) of every extension in JSON, nested ones included."""
    if isinstance(value, list):
        children = value
    elif isinstance(value, dict):
        inner = value.get("extensions")
        if isinstance(inner, dict):
            yield from inner.items()
        children = [child for key, child in value.items() if key != "extras"]
    else:
        return
    for child in children:
        if child and not isinstance(child, (int, float, str)):
            yield from _extensions(child)


def map_accessors(document: Document, renumber: Renumber) -> None:
    """Replace every accessor index by renumber(index)."""
    for mesh in document.meshes:
        for primitive in mesh["primitives"]:
            for attributes in gltf.attribute_sets(primitive):
                _map_values(attributes, renumber)
            _map_field(primitive, "indices", renumber)
    for animation in document.animations:
        for sampler in animation["samplers"]:
            _map_field(sampler, "input", renumber)
            _map_field(sampler, "output", renumber)
    for skin in document.skins:
        _map_field(skin, "inverseBindMatrices", renumber)
    for name, value in _extensions(document.json):
        if (
            name == "EXT_mesh_gpu_instancing"
            and isinstance(value, dict)
            and isinstance(value.get("attributes"), dict)
        ):
            _map_values(value["attributes"], renumber)


def map_views(document: Document, renumber: Renumber) -> None:
    """Replace every buffer view index by renumber(index)."""
    for accessor in document.accessors:
        _map_field(accessor, "bufferView", renumber)
        sparse = accessor.get("sparse", {})
        _map_field(sparse.get("indices", {}), "bufferView", renumber)
        _map_field(sparse.get("values", {}), "bufferView", renumber)
    for image in document.images:
        _map_field(image, "bufferView", renumber)
    for name, value in list(_extensions(document.json)):
        keys: tuple[str, ...] = ("bufferView",)
        if name == "EXT_structural_metadata":
            keys += METADATA_VIEW_KEYS
        _map_keys(value, keys, renumber)


def _map_field(owner: Any, field: str, renumber: Renumber) -> None:
    if field in owner:
        owner[field] = renumber(owner[field])


def _map_values(attributes: dict[str, Any], renumber: Renumber) -> None:
    for name, index in attributes.items():
        attributes[name] = renumber(index)


def _map_keys(value: Any, keys: tuple[str, ...], renumber: Renumber) -> None:
    """Renumbers integers under these keys. Skips nested extensions: `_extensions` lists them."""
    if isinstance(value, list):
        for v in value:
            _map_keys(v, keys, renumber)
    elif isinstance(value, dict):
        for key, v in value.items():
            if key in keys and isinstance(v, int) and not isinstance(v, bool):
                value[key] = renumber(v)
            elif key not in ("extensions", "extras"):
                _map_keys(v, keys, renumber)


# --- dropping ---


Mapper = Callable[[Document, Renumber], None]


def _used(document: Document, mapper: Mapper, items: list[Any], kind: str) -> list[int]:
    """Return the items in use, in their order. Renumbers every reference to them."""
    used: set[int] = set()

    def note(index: int) -> int:
        item(items, index, kind)
        used.add(index)
        return index

    mapper(document, note)
    indices = sorted(used)
    new_index = {old: new for new, old in enumerate(indices)}
    mapper(document, new_index.__getitem__)
    return indices


def _drop_unused(document: Document) -> None:
    accessors = list(document.accessors)
    used = _used(document, map_accessors, accessors, "accessor")
    document.accessors[:] = [accessors[old] for old in used]
    if len(used) < len(accessors):
        _trim_views(document)
    document.arrange_views(_used(document, map_views, document.bufferViews, "bufferView"))


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
    if "EXT_structural_metadata" in document.extensionsUsed:
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

"""Dropping what nothing refers to any more, renumbering the rest, and laying out the buffers."""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Callable, Iterator
from typing import Any

import pygltflib

from gltf_ext.errors import MeshletError
from gltf_ext.gltf.accessors import accessor_format
from gltf_ext.gltf.document import Document, item

Renumber = Callable[[int], int]
# Extensions known to hold no accessor or buffer view indices other than under "bufferView" and the keys below.
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
    "MSFT_lod",
    "MSFT_texture_dds",
    "FB_ngon_encoding",
    "VRM",
)
# EXT_structural_metadata: the buffer views of a property table's property.
METADATA_VIEW_KEYS = ("values", "arrayOffsets", "stringOffsets")
BLOB_ALIGNMENT = 4
METADATA_ALIGNMENT = 8


def pack(document: Document) -> tuple[list, list]:
    """Renumber accessors and buffer views and lay them out; returns (binary chunk, fallback buffer) as lists of pieces.

    Buffer views whose `fallback` attribute is set go to buffer 1, everything else to buffer 0, the binary chunk.
    When an extension that this package does not know holds integers, nothing old is dropped or renumbered.
    """
    if not unknown_index_holders(document):
        _drop_unused(document)
    return _lay_out(document)


def unknown_index_holders(document: Document) -> list[str]:
    """Names of extensions in use that may hold accessor or buffer view indices in places unknown here."""
    return sorted(
        {
            name
            for name, value in _extensions(document)
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
    """(name, object) of every extension anywhere in the document, extensions inside extensions included."""
    if isinstance(value, list):
        for v in value:
            if not isinstance(v, (int, float, str)):
                yield from _extensions(v)
    elif isinstance(value, dict):
        inner = value.get("extensions")
        if isinstance(inner, dict):
            yield from inner.items()
        for key, v in value.items():
            if key != "extras":
                yield from _extensions(v)
    elif dataclasses.is_dataclass(value):
        yield from (value.extensions or {}).items()
        for key, v in vars(value).items():
            if (
                v
                and key not in ("extras", "source_properties")
                and not isinstance(v, (int, float, str))
            ):
                yield from _extensions(v)


def map_accessors(document: Document, renumber: Renumber) -> None:
    """Replace every accessor index by renumber(index)."""
    for mesh in document.meshes:
        for primitive in mesh.primitives:
            for attributes in [primitive.attributes, *primitive.targets]:
                _map_values(vars(attributes), renumber)
            _map_field(primitive, "indices", renumber)
    for animation in document.animations:
        for sampler in animation.samplers:
            _map_field(sampler, "input", renumber)
            _map_field(sampler, "output", renumber)
    for skin in document.skins:
        _map_field(skin, "inverseBindMatrices", renumber)
    for name, value in _extensions(document):
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
        if accessor.sparse is not None:
            for part in (accessor.sparse.indices, accessor.sparse.values):
                if part is not None:
                    _map_field(part, "bufferView", renumber)
    for image in document.images:
        _map_field(image, "bufferView", renumber)
    for name, value in list(_extensions(document)):
        keys = ("bufferView",) + METADATA_VIEW_KEYS * (name == "EXT_structural_metadata")
        _map_keys(value, keys, renumber)


def _map_field(owner: Any, field: str, renumber: Renumber) -> None:
    value = getattr(owner, field)
    if value is not None:
        setattr(owner, field, renumber(value))


def _map_values(attributes: dict, renumber: Renumber) -> None:
    for name, index in attributes.items():
        if index is not None:
            attributes[name] = renumber(index)


def _map_keys(value: Any, keys: tuple[str, ...], renumber: Renumber) -> None:
    """Integers under these keys, not descending into extensions, which `_extensions` visits by themselves."""
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


def _collect(
    document: Document, mapper: Callable[[Document, Renumber], None], items: list, kind: str
) -> set[int]:
    used: set[int] = set()

    def note(index: int) -> int:
        item(items, index, kind)
        used.add(index)
        return index

    mapper(document, note)
    return used


def _keep(
    document: Document, mapper: Callable[[Document, Renumber], None], items: list, kind: str
) -> list:
    """The items in use, in their order, with every reference renumbered."""
    used = sorted(_collect(document, mapper, items, kind))
    new_index = {old: new for new, old in enumerate(used)}
    mapper(document, new_index.__getitem__)
    return [items[old] for old in used]


def _drop_unused(document: Document) -> None:
    accessors_before = len(document.accessors)
    document.accessors = _keep(document, map_accessors, document.accessors, "accessor")
    if len(document.accessors) < accessors_before:
        _trim_views(document)
    document.bufferViews = _keep(document, map_views, document.bufferViews, "bufferView")


def _trim_views(document: Document) -> None:
    """Give accessors that are left in old buffer views only the bytes they still need."""
    readers = defaultdict(list)
    for accessor in document.accessors:
        if (
            accessor.bufferView is not None
            and getattr(item(document.bufferViews, accessor.bufferView, "bufferView"), "data", None)
            is None
        ):
            readers[accessor.bufferView].append(accessor)
    kept = set(map(id, (a for group in readers.values() for a in group)))
    others = _views_of_others(document, kept)
    for index, accessors in readers.items():
        if index not in others:
            _split_view(document, index, accessors)


def _views_of_others(document: Document, kept: set[int]) -> set[int]:
    """Buffer views that something else than these accessors' main data refers to."""
    counted: dict[int, int] = defaultdict(int)

    def count(index: int) -> int:
        counted[index] += 1
        return index

    map_views(document, count)
    for accessor in document.accessors:
        if id(accessor) in kept:
            counted[accessor.bufferView] -= 1
    return {index for index, references in counted.items() if references > 0}


def _split_view(document: Document, index: int, accessors: list[pygltflib.Accessor]) -> None:
    """Replace a buffer view by one view per run of bytes that its accessors cover, when that is shorter."""
    view, data = document.bufferViews[index], document.bytes_of_view(index)
    spans = sorted(
        (_span(a, view, len(data)) + (i,) for i, a in enumerate(accessors)), key=lambda s: s[:2]
    )
    runs: list[list] = []
    for start, end, i in spans:
        start -= start % BLOB_ALIGNMENT
        if runs and start < runs[-1][1]:
            runs[-1][1] = max(runs[-1][1], end)
            runs[-1][2].append(i)
        else:
            runs.append([start, end, [i]])
    if sum(end - start for start, end, _ in runs) == len(data):
        return
    for start, end, members in runs:
        new = document.add_view(
            data[start:end], byteStride=view.byteStride, target=view.target, name=view.name
        )
        for i in members:
            accessors[i].bufferView, accessors[i].byteOffset = (
                new,
                (accessors[i].byteOffset or 0) - start,
            )


def _span(
    accessor: pygltflib.Accessor, view: pygltflib.BufferView, available: int
) -> tuple[int, int]:
    """First and one past the last byte of an accessor in its view; the whole view when it is not valid."""
    try:
        dtype, components = accessor_format(accessor, "an accessor")
    except MeshletError:
        return 0, available
    size, start = dtype.itemsize * components, accessor.byteOffset or 0
    end = start + (view.byteStride or size) * (max(accessor.count or 0, 1) - 1) + size
    return (start, end) if 0 <= start < end <= available else (0, available)


# --- layout ---


def _lay_out(document: Document) -> tuple[list, list]:
    alignment = (
        METADATA_ALIGNMENT
        if "EXT_structural_metadata" in document.extensionsUsed
        else BLOB_ALIGNMENT
    )
    pieces: list[list] = [[], []]
    lengths = [0, 0]
    data = [document.bytes_of_view(i) for i in range(len(document.bufferViews))]
    for view, content in zip(document.bufferViews, data):
        target = int(getattr(view, "fallback", False))
        padding = -lengths[target] % alignment
        pieces[target] += [bytes(padding), content]
        view.buffer, view.byteOffset = target, lengths[target] + padding
        lengths[target] += padding + len(content)
    first = document.buffers[0] if document.buffers else pygltflib.Buffer()
    first.uri = None
    document.buffers = []
    for buffer, length in zip((first, pygltflib.Buffer()), lengths):
        if length:
            buffer.byteLength = length
            document.buffers.append(buffer)
    return pieces[0], pieces[1]

"""Feature ids that follow from the order of vertices, which changes: they become attributes.

EXT_mesh_features, its draft with offset and repeat, and EXT_feature_metadata.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext._codec import BLOB_MAX_STREAMS
from gltf_ext.document import gltf
from gltf_ext.document.accessors import Format, add_accessor
from gltf_ext.document.document import Document
from gltf_ext.document.json_values import member
from gltf_ext.document.references import extensions_of
from gltf_ext.sources.primitives import is_compressed, place, triangle_primitives
from gltf_ext.sources.source import Source, read_source

FEATURES, METADATA = "EXT_mesh_features", "EXT_feature_metadata"
ATTRIBUTE = "_FEATURE_ID_"
EXPLICIT = ("attribute", "texture", "index")  # an entry with one of them says where its ids are
MOST_IDS = 1 << 24  # a float tells that many integers apart
LOST = "feature ids follow from the order of vertices, which changes; dropped"


@dataclass(frozen=True)
class FeatureIds:
    """The ids offset + vertex // repeat of `count` vertices, as rows of a source."""

    count: int
    offset: int = 0
    repeat: int = 1

    @property
    def most(self) -> int:
        """The largest id."""
        return self.offset + max(self.count - 1, 0) // self.repeat

    @property
    def format(self) -> Format:
        """Vertex attributes of glTF have no integers of 32 bits."""
        return np.dtype("<u2" if self.most < 1 << 16 else "<f4"), 1

    def rows(self, first: int, last: int) -> np.ndarray:
        """[last - first, 1] ids."""
        ids = self.offset + np.arange(first, last) // self.repeat
        result: np.ndarray = ids.astype(self.format[0]).reshape(-1, 1)
        return result


def number_features(document: Document, large: Mapping[tuple[int, int], Source]) -> list[str]:
    """Give implicit feature ids of triangle primitives an attribute; return warnings.

    large: sources that stay in their files, which get it too.
    """
    accessors: dict[tuple[FeatureIds, bool], int] = {}
    warnings = []
    for mesh, index, primitive in triangle_primitives(document):
        source, names = large.get((mesh, index)), _Names(primitive)
        for name, entry, ids in _take_implicit_ids(document, mesh, index, source, names.room):
            if ids is None:
                warnings.append(f"{name} of {place(mesh, index)}: {LOST}")
                continue
            attribute = names.next()
            if source:
                _add_to(source, attribute, ids)
            key = ids, source is None
            if key not in accessors:  # of a large source, it only says what the type is
                rows = ids.rows(0, 1 if source else ids.count)
                accessors[key] = add_accessor(document, rows)
            primitive["attributes"][attribute] = accessors[key]
            _refer(name, entry, attribute)
    return list(dict.fromkeys(warnings))


class _Names:
    """Free names of attributes for feature ids.

    Attributes:
        room: the number of attributes that may be added: each takes a stream.
    """

    def __init__(self, primitive: gltf.Primitive) -> None:
        self._attributes, self._number = primitive["attributes"], 0
        self.room = BLOB_MAX_STREAMS - sum(map(len, gltf.attribute_sets(primitive)))

    def next(self) -> str:
        while f"{ATTRIBUTE}{self._number}" in self._attributes:
            self._number += 1
        return f"{ATTRIBUTE}{self._number}"


def _take_implicit_ids(
    document: Document, mesh: int, index: int, source: Source | None, room: int
) -> list[tuple[str, dict[str, Any], FeatureIds | None]]:
    """List (extension, entry, its ids) of each list of feature ids that follow from an order.

    Takes those away that are lost, whose ids are None: all but the first `room`, too.
    """
    primitive, result, count = document.primitive(mesh, index), [], -1
    for name, key in ((FEATURES, "featureIds"), (METADATA, "featureIdAttributes")):
        extension = gltf.extension(primitive, name)
        entries: Any = extension.get(key) if isinstance(extension, dict) else None
        if not isinstance(entries, list):
            continue
        excess: set[int] = set()
        for position, entry in enumerate(entries):
            rule = _rule(name, entry)
            if rule is None:
                continue
            if count < 0:
                count = _vertex_count(document, mesh, index, source)
            offset, repeat = rule
            ids = FeatureIds(count, offset, min(repeat, max(count, 1)))
            is_lost = is_compressed(primitive) or ids.most > MOST_IDS or room <= 0
            if is_lost:
                excess.add(position)
            room -= not is_lost
            result.append((name, entry, None if is_lost else ids))
        entries[:] = [entry for i, entry in enumerate(entries) if i not in excess]
        if excess and not entries:
            _drop(document, primitive, name, key)
    return result


def _vertex_count(document: Document, mesh: int, index: int, source: Source | None) -> int:
    """Return the number of vertices, for which there are bytes. Raises MeshletError."""
    if is_compressed(document.primitive(mesh, index)):
        return 0
    return (source or read_source(document, mesh, index)[0]).vertex_count


def _drop(document: Document, primitive: gltf.Primitive, name: str, key: str) -> None:
    """Drop an empty list of feature ids; with it the extension, if nothing else is in it."""
    extension = gltf.extension(primitive, name)
    del extension[key]
    if extension and name != FEATURES:
        return
    gltf.pop_extension(primitive, name)
    if all(name != other for other, _ in extensions_of(document.json)):
        document.forget_extension(name)


def _rule(name: str, entry: Any) -> tuple[int, int] | None:
    """Return (offset, repeat) of ids that follow from the order of vertices; None for others."""
    offset_key, repeat_key = "offset", "repeat"
    if name == METADATA:
        entry = member(entry, "featureIds")
        offset_key, repeat_key = "constant", "divisor"
    if not isinstance(entry, dict) or any(key in entry for key in EXPLICIT):
        return None
    is_draft = name == METADATA or offset_key in entry or repeat_key in entry
    offset, repeat = entry.get(offset_key, 0), entry.get(repeat_key, 0 if is_draft else 1)
    if type(offset) is not int or type(repeat) is not int or offset < 0 or repeat <= 0:
        return None  # without a repeat, all vertices have the same id
    return offset, repeat


def _refer(name: str, entry: dict[str, Any], attribute: str) -> None:
    """Let an entry name the attribute that has its ids."""
    if name == METADATA:
        entry["featureIds"] = {"attribute": attribute}
        return
    entry.pop("offset", None)
    entry.pop("repeat", None)
    entry["attribute"] = int(attribute.removeprefix(ATTRIBUTE))


def _add_to(source: Source, attribute: str, ids: FeatureIds) -> None:
    ((names, numbers),) = source.numberings
    source.attributes[attribute] = ids
    source.numberings = [((*names, attribute), numbers)]
    if source.bounds:  # it has triangles that are not degenerate
        ends = [ids.rows(0, 1), ids.rows(ids.count - 1, ids.count)]
        source.bounds[attribute] = np.concatenate(ends)

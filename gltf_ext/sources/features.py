"""Feature ids that follow from the order of vertices, which changes: they become attributes.

EXT_mesh_features, its draft with offset and repeat, and EXT_feature_metadata.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.accessors import Format, add_accessor
from gltf_ext.document.document import Document, item
from gltf_ext.document.json_values import member
from gltf_ext.sources.primitives import is_compressed, place, triangle_primitives
from gltf_ext.sources.source import Source

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
        for name, entries, entry, ids in list(_implicit_ids(document, primitive)):
            if is_compressed(primitive) or ids.most > MOST_IDS:
                entries.remove(entry)
                warnings.append(f"{name} of {place(mesh, index)}: {LOST}")
                continue
            attribute = _free_name(primitive)
            source = large.get((mesh, index))
            if source:
                _add_to(source, attribute, ids)
            key = ids, source is None
            if key not in accessors:  # of a large source, it only says what the type is
                rows = ids.rows(0, 1 if source else ids.count)
                accessors[key] = add_accessor(document, rows)
            primitive["attributes"][attribute] = accessors[key]
            _refer(name, entry, attribute)
    return warnings


def _implicit_ids(
    document: Document, primitive: gltf.Primitive
) -> Iterator[tuple[str, list[Any], dict[str, Any], FeatureIds]]:
    """Yield (extension, its list of feature ids, an entry that has none, these ids)."""
    accessor = item(document.accessors, primitive["attributes"]["POSITION"], "accessor")
    for name, key in ((FEATURES, "featureIds"), (METADATA, "featureIdAttributes")):
        extension = gltf.extension(primitive, name)
        entries: Any = extension.get(key) if isinstance(extension, dict) else None
        for entry in entries if isinstance(entries, list) else ():
            rule = _rule(name, entry)
            if rule and accessor.get("count", 0) > 0:
                yield name, entries, entry, FeatureIds(accessor["count"], *rule)


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


def _free_name(primitive: gltf.Primitive) -> str:
    number = 0
    while f"{ATTRIBUTE}{number}" in primitive["attributes"]:
        number += 1
    return f"{ATTRIBUTE}{number}"


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
    ends = [ids.rows(0, 1), ids.rows(ids.count - 1, ids.count)]
    source.bounds[attribute] = np.concatenate(ends)

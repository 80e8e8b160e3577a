"""Extensions that number vertices, corners or triangles, whose order `compress` changes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from gltf_ext.document import gltf
from gltf_ext.document.document import Document
from gltf_ext.document.references import (
    extensions_of,
    integers_of,
    is_known,
    named_accessors,
)
from gltf_ext.sources.primitives import all_primitives

# Extension of a primitive or a mesh -> what it numbers. Feature ids are rewritten (features.py).
NUMBERED = {
    "BENTLEY_primitive_restart": "vertices",
    "CESIUM_primitive_outline": "vertices",
    "EXT_mesh_manifold": "vertices",
    "EXT_mesh_polygon": "triangles",
    "EXT_mesh_primitive_edge_visibility": "corners of triangles",
    "EXT_mesh_primitive_restart": "vertices",
    "FB_ngon_encoding": "triangles",
    "MPEG_mesh_linking": "vertices",
    "NV_attribute_micromap": "triangles",
    "NV_displacement_micromap": "triangles",
    "NV_micromap_tooling": "triangles",
    "NV_opacity_micromap": "triangles",
}

Counts = set[int]  # of a primitive's vertices, triangles and corners


def drop_numbered(document: Document, compressed: dict[int, Counts]) -> list[str]:
    """Drop the extensions of compressed primitives and their meshes that number what moves.

    compressed: id of a primitive's object -> its counts in the source. Returns warnings: also for
    each unknown extension that may be one.
    """
    meanings: dict[str, str] = {}
    doubtful: set[str] = set()
    for holder, counts in _holders(document, compressed):
        for name, value in list(holder.get("extensions", {}).items()):
            what = _numbered(document, name, value, counts)
            if what:
                gltf.pop_extension(holder, name)
                meanings[name] = what
            elif not is_known(name) and next(integers_of(value), None) is not None:
                doubtful.add(name)
    remaining = {name for name, _ in extensions_of(document.json)}
    for name in set(NUMBERED).union(meanings) - remaining:  # primitives that are kept have theirs
        document.forget_extension(name)
    return [
        *(f"{name} numbers {meanings[name]}, whose order changes; dropped" for name in meanings),
        *(
            f"{name} is kept, but wrong if it numbers vertices or triangles, whose order changes"
            for name in sorted(doubtful)
        ),
    ]


def _holders(
    document: Document, compressed: dict[int, Counts]
) -> Iterable[tuple[gltf.Property, Counts]]:
    """Return (object, counts) of each compressed primitive, and of each mesh that has some."""
    of_meshes: dict[int, Counts] = {}
    for mesh, _, primitive in all_primitives(document):
        counts = compressed.get(id(primitive))
        if counts is not None:
            yield primitive, counts
            of_meshes.setdefault(mesh, set()).update(counts)
    for mesh, counts in of_meshes.items():
        yield document.meshes[mesh], counts


def _numbered(document: Document, name: str, value: Any, counts: Counts) -> str:
    """Return what an extension numbers; empty for those that do not, as far as can be seen."""
    if name in NUMBERED or is_known(name):
        return NUMBERED.get(name, "")
    accessors = named_accessors(name, value, len(document.accessors))
    if any(document.accessors[index].get("count") in counts for index in accessors):
        return "vertices or triangles"
    return ""

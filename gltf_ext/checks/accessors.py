"""Compares accessors and nodes with those of the original: types, boxes, places."""

from __future__ import annotations

import numpy as np

from gltf_ext.attributes.extension import Compressed
from gltf_ext.attributes.streams import dequantise, to_accessor
from gltf_ext.document import gltf
from gltf_ext.document.accessors import stated_bounds
from gltf_ext.document.document import Document
from gltf_ext.document.nodes import placed_nodes
from gltf_ext.errors import MeshletError
from gltf_ext.sources.attribute_names import pair_names


def accessor_problems(
    original: Document, document: Document, compressed: Compressed, box: np.ndarray | None
) -> list[str]:
    """Return a line for each accessor with another type, and for a wrong box of positions.

    box: uint32[2, 3]: smallest and largest integers of the positions; None without vertices.
    """
    mesh, index = compressed.mesh, compressed.primitive
    before, after = (
        dict(pair_names(gltf.attribute_sets(d.primitive(mesh, index))))
        for d in (original, document)
    )
    problems = []
    for name in before.keys() & after.keys():
        types = [
            (a.get("componentType"), a.get("type"), bool(a.get("normalized")))
            for a in (original.accessors[before[name]], document.accessors[after[name]])
        ]
        if types[0] != types[1]:
            texts = [f"{t[1]} of {t[0]}{', normalized' if t[2] else ''}" for t in types]
            problems.append(f"{compressed.where}: {name} is {texts[1]}, it was {texts[0]}")
    if box is not None:
        dtype = compressed.attributes["POSITION"][1][0]
        decoded = to_accessor([dequantise(box, compressed.streams[0])], dtype)
        bounds = stated_bounds(document.accessors[after["POSITION"]])
        for label, bound, value in zip(("min", "max"), bounds, decoded):
            if bound is None or not np.array_equal(bound, value.astype(np.float64)):
                problems.append(
                    f"{compressed.where}: {label} of POSITION is not that of its vertices; "
                    "compress it again"
                )
    return sorted(problems)


def _shown_meshes(document: Document) -> list[tuple[int, np.ndarray]]:
    return [(node["mesh"], matrix) for node, matrix in placed_nodes(document) if "mesh" in node]


def moved_nodes(original: Document, document: Document) -> list[str]:
    """Return a line if nodes show meshes at other places than in the original."""
    try:
        before = _shown_meshes(original)
    except MeshletError:  # nodes that are not valid show nothing
        return []
    try:
        after = _shown_meshes(document)
    except MeshletError as error:
        return [f"nodes are not valid, those of the original are: {error}"]
    if [mesh for mesh, _ in before] != [mesh for mesh, _ in after]:
        return ["nodes show other meshes than in the original; compress it again"]
    for (mesh, matrix), (_, other) in zip(before, after):
        if not np.array_equal(matrix, other):
            distance = float(np.linalg.norm(matrix[:3, 3] - other[:3, 3]))
            return [f"a node shows mesh {mesh} elsewhere, by {distance:.3g}; compress it again"]
    return []

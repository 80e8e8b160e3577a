"""validate: checks the container and this extension of a file."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pygltflib

from gltf_ext import _codec
from gltf_ext.compression.extension import (
    EXTENSION,
    compressed_primitives,
    has_compressed,
    is_compressed,
    read_compressed,
)
from gltf_ext.compression.primitives import Primitive, all_primitives
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.accessors import bounds, read_accessor
from gltf_ext.gltf.buffer_layout import Renumber, map_accessors, map_views
from gltf_ext.gltf.document import Document, item
from gltf_ext.gltf.importers import open_model
from gltf_ext.lod.validation import lod_problems


def validate(path: str | os.PathLike[str]) -> list[str]:
    """Problems of a .glb or .gltf file, one line each; an empty list when there are none.

    Checks the container, the types of all JSON properties, every reference to accessors and buffer
    views, and every extension object with its accessors. Decodes every blob and compares bounds
    and fallback with the result. Checks the tables of levels of detail, every page, and that every
    cut covers the surface once. Raises OSError when the file cannot be read.
    """
    try:
        document = open_model(path)
    except MeshletError as error:
        return [error.message]
    lost = _lost_fallback(document)
    if lost:
        return lost
    broken = _broken_references(document)
    if broken:
        return list(dict.fromkeys(broken))  # many views may read one damaged buffer
    problems = _extension_lists(document)
    for m, p, primitive in all_primitives(document):
        if is_compressed(primitive):
            problems += _blob_problems(document, m, p)
    problems += lod_problems(document)
    if not has_compressed(document) and not problems:
        problems.append(
            f"has no primitive with {EXTENSION}; "
            "compress it first: gltf-meshlet compress IN OUT.glb"
        )
    return problems


def _lost_fallback(document: Document) -> list[str]:
    """Problems of buffers that cannot be read although all compressed data can be."""
    try:
        users = compressed_primitives(document)
        for compressed in users:
            _codec.validate(compressed.blob)
    except ValueError:
        return []
    used = {document.bufferViews[compressed.view].buffer for compressed in users}
    lost = []
    for index in set(range(len(document.buffers))) - used if used else ():
        try:
            document.bytes_of_buffer(index)
        except MeshletError as error:
            lost.append(f"{error.message}; the compressed data is intact")
    return lost


def _broken_references(document: Document) -> list[str]:
    problems: list[str] = []

    def checker(items: list[Any], kind: str) -> Renumber:
        def check(index: int) -> int:
            try:
                item(items, index, kind)
            except MeshletError as error:
                problems.append(error.message)
            return index

        return check

    map_accessors(document, checker(document.accessors, "accessor"))
    map_views(document, checker(document.bufferViews, "bufferView"))
    for index in range(len(document.bufferViews)):
        try:
            document.bytes_of_view(index)
        except MeshletError as error:
            problems.append(error.message)
    return problems


def _extension_lists(document: Document) -> list[str]:
    """Problems of extensionsUsed and extensionsRequired."""
    users = [primitive for _, _, primitive in all_primitives(document) if is_compressed(primitive)]
    problems = []
    if users and EXTENSION not in document.extensionsUsed:
        problems.append(f"extensionsUsed lacks {EXTENSION}")
    bare = {i for i, accessor in enumerate(document.accessors) if accessor.bufferView is None}
    if any(p.indices in bare for p in users) and EXTENSION not in document.extensionsRequired:
        problems.append(f"extensionsRequired lacks {EXTENSION}, but there is no fallback")
    return problems


def _blob_problems(document: Document, mesh: int, index: int) -> list[str]:
    """Problems of one compressed primitive."""
    try:
        compressed = read_compressed(document, mesh, index)
        _codec.validate(compressed.blob)
        primitive = document.meshes[mesh].primitives[index]
        problems = _accessor_problems(document, primitive, compressed.decode())
        return [f"{compressed.where}: {problem}" for problem in problems]
    except MeshletError as error:
        return [error.message]
    except ValueError as error:
        return [f"{compressed.where}: {error}"]


def _accessor_problems(
    document: Document, primitive: pygltflib.Primitive, decoded: Primitive
) -> list[str]:
    """Compares the bounds of POSITION and the values of the fallback with the decoded data."""
    problems = []
    position = document.accessors[primitive.attributes["POSITION"]]
    for name, expected in zip(("min", "max"), bounds(decoded.attributes["POSITION"])):
        if getattr(position, name) != expected.tolist():
            problems.append(f"{name} of its POSITION accessor is not that of the decoded data")
    groups = [
        ({"indices": primitive.indices}, {"indices": decoded.indices.reshape(-1, 1)}),
        (primitive.attributes, decoded.attributes),
        *zip(primitive.targets, decoded.targets),
    ]
    for accessors, arrays in groups:
        for name, accessor in accessors.items():
            if document.accessors[accessor].bufferView is None:
                continue
            stored = read_accessor(document, accessor, name)
            if not np.array_equal(stored, arrays[name], equal_nan=True):
                problems.append(f"the fallback of {name} is not the decoded data")
    return problems

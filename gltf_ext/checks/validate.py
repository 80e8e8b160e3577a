"""validate: checks the container and this extension of a file."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.extension import (
    EQUAL_VERTICES,
    Compressed,
    compressed_primitives,
    has_compressed,
    read_compressed,
    require_unused_by_accessors,
)
from gltf_ext.attributes.join import decode
from gltf_ext.checks.levels import lod_problems
from gltf_ext.document import gltf, json_values
from gltf_ext.document.accessors import accessor_format, bounds, read_accessor, stated_bounds
from gltf_ext.document.document import Document, item
from gltf_ext.document.gltf2 import Model, name_of
from gltf_ext.document.references import Renumber, extensions_of, map_accessors, map_views
from gltf_ext.errors import MeshletError
from gltf_ext.lod.tables import EXTENSION as LOD
from gltf_ext.progress import Advance, progress_bar, shared_progress
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import EXTENSION, all_primitives, is_compressed

BLOBS_SHARE = 0.3  # of the progress; the rest is for levels of detail


def validate(path: Model, *, progress: bool = False) -> list[str]:
    """Return problems of a .glb or .gltf file, or of a pygltflib.GLTF2, one line each; [] for none.

    Checks the container, the types of all JSON properties, every reference to accessors and buffer
    views, and every extension object with its accessors. Decodes every blob and compares bounds
    and fallback with the result. Checks the tables of levels of detail, every page, and that every
    cut covers the surface once. Raises OSError when the file cannot be read.

    progress: draw a progress bar on a terminal.
    """
    try:
        document = open_model(path)
    except MeshletError as error:
        return [error.message]
    lost_fallback = _lost_fallback(document)
    if lost_fallback:
        return lost_fallback
    broken = _broken_references(document)
    if broken:
        return list(dict.fromkeys(broken))  # many views may read one damaged buffer
    problems = [*document.packing_faults, *_users_of_packed_views(document)]
    problems += _extension_lists(document)
    with progress_bar(Path(name_of(path)).name, progress) as advance:
        for_blobs, for_levels = shared_progress(advance, [BLOBS_SHARE, 1 - BLOBS_SHARE])
        numbers = [(m, p) for m, p, user in all_primitives(document) if is_compressed(user)]
        moves = shared_progress(for_blobs, [1 / len(numbers)] * len(numbers) if numbers else [])
        for (m, p), move in zip(numbers, moves):
            problems += _blob_problems(document, m, p, move)
        problems += lod_problems(document, for_levels)
    if not has_compressed(document) and not problems:
        problems.append(
            f"has no primitive with {EXTENSION}; "
            "compress it first: gltf-meshlet compress IN OUT.glb"
        )
    return list(dict.fromkeys(problems))  # levels repeat the problems of their level 0


def _lost_fallback(document: Document) -> list[str]:
    """Return problems of buffers that cannot be read although all compressed data can be."""
    try:
        users = compressed_primitives(document)
        for compressed in users:
            _codec.validate(compressed.blob)
    except ValueError:
        return []
    used = {document.bufferViews[compressed.view].get("buffer") for compressed in users}
    problems = []
    for index in set(range(len(document.buffers))) - used if used else ():
        try:
            document.bytes_of_buffer(index)
        except MeshletError as error:
            problems.append(f"{error.message}; the compressed data is intact")
    return problems


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


def _users_of_packed_views(document: Document) -> list[str]:
    """Return problems of packed views that something else refers to than blobs' extensions."""
    if not document.packed_views:
        return []
    references: Counter[int] = Counter()
    allowed: Counter[int] = Counter()

    def count(index: int) -> int:
        references[index] += 1
        return index

    map_views(document, count)
    for name, value in extensions_of(document.json):
        holder = json_values.member(value, "pages") if name == LOD else value
        view = holder.get("bufferView") if isinstance(holder, dict) else None
        if name in (EXTENSION, LOD) and isinstance(view, int):
            allowed[view] += 1
    problems = []
    for index in sorted(document.packed_views):
        if not allowed[index]:
            problems.append(f"bufferView {index} is packed, but no {EXTENSION} or {LOD} uses it")
        elif references[index] > allowed[index]:
            problems.append(f"bufferView {index} is packed, but something else refers to it")
    return problems


def _extension_lists(document: Document) -> list[str]:
    """Return problems of extensionsUsed, extensionsRequired and shared accessors."""
    users = [primitive for _, _, primitive in all_primitives(document) if is_compressed(primitive)]
    problems = []
    if users and EXTENSION not in document.extensionsUsed:
        problems.append(f"extensionsUsed lacks {EXTENSION}")
    bare = {i for i, accessor in enumerate(document.accessors) if "bufferView" not in accessor}
    if (
        any(p.get("indices") in bare for p in users)
        and EXTENSION not in document.extensionsRequired
    ):
        problems.append(f"extensionsRequired lacks {EXTENSION}, but there is no fallback")
    view_of: dict[int, Any] = {}  # accessor -> the view of the primitives that use it
    for user in users:
        view = json_values.member(user.get("extensions"), EXTENSION).get("bufferView")
        accessors = [index for names in _accessors_of(user) for index in names.values()]
        if any(view_of.setdefault(index, view) != view for index in accessors):
            problems.append("primitives with different buffer views share an accessor")
    return problems


def _blob_problems(document: Document, mesh: int, index: int, advance: Advance | None) -> list[str]:
    """Return problems of one compressed primitive."""
    try:
        compressed = read_compressed(document, mesh, index)
        _codec.validate(compressed.blob)
        primitive = document.primitive(mesh, index)
        require_unused_by_accessors(document, _views_of(compressed))
        if compressed.equal_vertices is not None:
            decode(compressed)
        problems = [
            *_accessor_problems(document, primitive, compressed),
            *_decoded_problems(document, primitive, compressed, advance),
        ]
        return [f"{compressed.where}: {problem}" for problem in problems]
    except MeshletError as error:
        return [error.message]
    except ValueError as error:
        return [f"{compressed.where}: {error}"]


def _views_of(compressed: Compressed) -> list[int]:
    holder = compressed.object.get(EQUAL_VERTICES)
    return [compressed.view, *([holder["bufferView"]] if holder else [])]


def _value_problems(compressed: Compressed, values: list[np.ndarray]) -> list[str]:
    """Attributes of integers whose streams have values that their component types cannot hold."""
    problems = []
    for name, streams, (dtype, _) in compressed.named_streams:
        if dtype.kind != "f":
            limits = np.iinfo(dtype)
            rounded = [np.rint(values[s]) for s in streams]
            if any(v.min() < limits.min or v.max() > limits.max for v in rounded):
                problems.append(f"{name} has values that its component type cannot hold")
    return problems


def _accessor_problems(
    document: Document, primitive: gltf.Primitive, compressed: Compressed
) -> list[str]:
    """Return problems of a primitive's accessors that readers may overlook."""
    problems = []
    if gltf.has_extension(primitive, "KHR_draco_mesh_compression"):
        problems.append("it is compressed with KHR_draco_mesh_compression, too")
    index_type, _ = accessor_format(document.accessors[primitive["indices"]], "indices")
    if compressed.vertex_count > np.iinfo(index_type).max:
        problems.append("an index is the largest value of its component type, which is reserved")
    for names in _accessors_of(primitive):
        for name, index in names.items():
            accessor = document.accessors[index]
            if "bufferView" not in accessor and "sparse" in accessor:
                problems.append(f"its {name} accessor is sparse, but has no fallback")
    return problems


def _accessors_of(primitive: gltf.Primitive) -> list[dict[str, int]]:
    """Return the accessors of indices, attributes and each target, by name."""
    indices = {"indices": primitive["indices"]} if "indices" in primitive else {}
    return [indices, *gltf.attribute_sets(primitive)]


def _decoded_problems(
    document: Document,
    primitive: gltf.Primitive,
    compressed: Compressed,
    advance: Advance | None,
) -> list[str]:
    """Return problems of the decoded values, and differences to the bounds and to the fallback."""
    fallback = {
        index: read_accessor(document, index, name)
        for names in _accessors_of(primitive)
        for name, index in names.items()
        if "bufferView" in document.accessors[index]
    }
    compared_rows = dict.fromkeys(fallback, 0)
    problems: list[str] = []
    extremes: list[np.ndarray] = []
    triangle_count = 0
    for triangles, values in compressed.parts():
        triangle_count += len(triangles)
        if advance:
            advance(triangle_count / compressed.triangle_count)
        problems += _value_problems(compressed, values)
        part = compressed.as_primitive(triangles, values)
        extremes = list(bounds(np.stack([*extremes, *bounds(part.attributes["POSITION"])])))
        of_groups = [{"indices": triangles.reshape(-1, 1)}, *part.sets]
        for names, arrays in zip(_accessors_of(primitive), of_groups):
            for name in (name for name, index in names.items() if index in fallback):
                index, values_of = names[name], arrays[name]
                first, compared_rows[index] = (
                    compared_rows[index],
                    compared_rows[index] + len(values_of),
                )
                if not np.array_equal(
                    fallback[index][first : compared_rows[index]], values_of, True
                ):
                    problems.append(f"the fallback of {name} is not the decoded data")
    position = document.accessors[primitive["attributes"]["POSITION"]]
    for name, bound, expected in zip(("min", "max"), stated_bounds(position), extremes):
        if bound is None or not np.array_equal(bound, expected):
            problems.append(f"{name} of its POSITION accessor is not that of the decoded data")
    return problems

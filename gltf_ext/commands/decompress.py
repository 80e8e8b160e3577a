"""decompress: EXT_meshlet_edgebreaker -> a plain .glb that any reader understands."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from gltf_ext.attributes.extension import Compressed, require_compressed
from gltf_ext.attributes.join import Parts
from gltf_ext.commands.result import Result, output_path
from gltf_ext.document import gltf
from gltf_ext.document.accessors import store_rows, stored_rows, widen_bounds
from gltf_ext.document.document import Document
from gltf_ext.document.gltf2 import File, Model, name_of
from gltf_ext.document.images import embed_images
from gltf_ext.errors import blaming
from gltf_ext.lod.detail import Detail, missing_levels
from gltf_ext.lod.document import forget_levels
from gltf_ext.progress import Advance, progress_bar, shared_progress
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import EXTENSION, describe, describe_indices
from gltf_ext.work_files import Spool


def decompress(
    input: Model,
    output: File | None = None,
    *,
    level: int | None = None,
    error: float | str | None = None,
    progress: bool = False,
) -> dict[str, Any]:
    """Write a compressed .glb or .gltf as a plain .glb without the extension.

    Args:
        input: path of the compressed file, or a pygltflib.GLTF2, which stays as it is.
        output: path of the .glb, or a .gltf, to write; without it, the report has a new GLTF2.
        level: of detail, 0 for all triangles; a primitive with fewer levels takes its coarsest one.
        error: the coarsest mesh with at most this error, in units of the scene (POSITION, scaled
            by nodes), or "0.1%" of the longest side of the primitive's bounding box. Not together
            with level. Primitives without levels of detail keep all their triangles.
        progress: draw a progress bar on a terminal.

    Returns:
        input, output, input_bytes, output_bytes, triangles and warnings; without an output path
        also gltf: the new GLTF2.

    Raises:
        MeshletError: the input is malformed or not compressed.
        OSError: a file cannot be read or written.
    """
    detail = Detail.of(level, error)
    path = output_path(output, input)
    folder = str(path.parent) if path else tempfile.gettempdir()
    with blaming(name_of(input)):
        document = open_model(input)
        detail = detail.in_scene(document)
        input_files = document.files()
        compressed = require_compressed(document)
        warnings = missing_levels(document) if level or error is not None else []
        with progress_bar(Path(name_of(input)).name, progress) as advance:
            triangles = _expand_all(document, compressed, detail, folder, advance)
        document.forget_extension(EXTENSION)
        forget_levels(document)
        warnings += embed_images(document)
        result = Result.of(document, path)
    return {**result.write(input, input_files), "triangles": triangles, "warnings": warnings}


def _expand_all(
    document: Document,
    compressed: list[Compressed],
    detail: Detail,
    folder: str,
    advance: Advance | None,
) -> int:
    """Decode every primitive; those that share a blob and accessors once, and still share.

    folder: for work files. Returns the number of triangles of all primitives.
    """
    expanded: dict[tuple[Any, ...], gltf.Primitive] = {}
    triangles = 0
    counts = [primitive.triangle_count for primitive in compressed]
    moves = shared_progress(advance, [count / max(sum(counts), 1) for count in counts])
    for primitive, move in zip(compressed, moves):
        user = document.primitive(primitive.mesh, primitive.primitive)
        key = (
            primitive.view,
            user["indices"],
            *(tuple(g.items()) for g in gltf.attribute_sets(user)),
        )
        if key in expanded:
            first = expanded[key]
            user["indices"] = first["indices"]
            gltf.set_attribute_sets(user, gltf.attribute_sets(first))
        else:
            _expand(document, primitive, detail, folder, move)
            expanded[key] = user
        triangles += document.accessors[user["indices"]]["count"] // 3
        gltf.pop_extension(user, EXTENSION)
        if move:
            move(1.0)
    return triangles


def _expand(
    document: Document,
    compressed: Compressed,
    detail: Detail,
    folder: str,
    advance: Advance | None,
) -> None:
    """Store one primitive in new accessors: the old ones may have other users."""
    primitive = document.primitive(compressed.mesh, compressed.primitive)
    whole = detail.cut(document, compressed) or Parts(compressed, folder)
    indices = describe_indices(document, whole.triangle_count, whole.vertex_count)
    sets = [
        describe(document, names, whole.vertex_count, None)
        for names in gltf.attribute_sets(primitive)
    ]
    primitive["indices"] = indices
    gltf.set_attribute_sets(primitive, sets)
    accessors = document.accessors
    targets = {indices: gltf.ELEMENT_ARRAY_BUFFER}
    for names in sets:
        targets.update(dict.fromkeys(names.values(), gltf.ARRAY_BUFFER))
    spools = {index: Spool(folder) for index in targets}

    def add(index: int, values: np.ndarray) -> None:
        spools[index].append(stored_rows(accessors[index], values, targets[index]))

    decoded_triangles = 0
    for part in whole if isinstance(whole, Parts) else [whole]:
        decoded_triangles += part.triangle_count
        if advance:
            advance(decoded_triangles / whole.triangle_count)
        add(indices, part.indices.reshape(-1, 1))
        for names, arrays in zip(sets, part.sets):
            for name, index in names.items():
                add(index, arrays[name])
                if name == "POSITION":
                    widen_bounds(accessors[index], arrays[name])
    for index, spool in spools.items():
        store_rows(document, accessors[index], spool.contents(), targets[index])

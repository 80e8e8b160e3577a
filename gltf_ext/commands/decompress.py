"""decompress: EXT_meshlet_edgebreaker -> a plain .glb that any reader understands."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pygltflib

from gltf_ext.compression.extension import EXTENSION, Compressed, require_compressed
from gltf_ext.compression.primitives import (
    Primitive,
    describe,
    describe_indices,
    store_primitive,
)
from gltf_ext.errors import blaming
from gltf_ext.files import check_output, refuse_overwriting, write_files
from gltf_ext.gltf.accessors import bounds
from gltf_ext.gltf.buffer_layout import pack
from gltf_ext.gltf.container import glb_parts
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.images import embed_images
from gltf_ext.gltf.importers import open_model
from gltf_ext.lod.detail import Detail, missing_levels
from gltf_ext.lod.document import forget_levels
from gltf_ext.progress import Advance, progress_bar


def decompress(
    input: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    level: int | None = None,
    error: float | str | None = None,
    progress: bool = False,
) -> dict[str, Any]:
    """Write a compressed .glb or .gltf as a plain .glb without the extension.

    level: of detail, 0 for all triangles; a primitive with fewer levels takes its coarsest one.
    error: the coarsest mesh with at most this error, in units of POSITION, or "0.1%" of the longest
        side of the primitive's bounding box. Not together with level. Primitives without levels of
        detail keep all their triangles.
    progress: draw a progress bar on a terminal.

    Returns input, output, input_bytes, output_bytes, triangles and warnings. Raises MeshletError
    when the input is malformed or not compressed, OSError when a file cannot be read or written.
    """
    detail = Detail.of(level, error)
    output = Path(output)
    check_output(output, input)
    with blaming(input):
        document = open_model(input)
        refuse_overwriting(document.files(), [output])
        compressed = require_compressed(document)
        warnings = missing_levels(document) if level or error is not None else []
        with progress_bar(Path(input).name, progress) as advance:
            triangles = _expand_all(document, compressed, detail, advance)
        document.forget_extension(EXTENSION)
        forget_levels(document)
        warnings += embed_images(document)
        parts = glb_parts(document, pack(document)[0])
    input_bytes = os.path.getsize(input)
    write_files({output: parts})
    return {
        "input": str(input),
        "output": str(output),
        "input_bytes": input_bytes,
        "output_bytes": sum(map(len, parts)),
        "triangles": triangles,
        "warnings": warnings,
    }


def _expand_all(
    document: Document, compressed: list[Compressed], detail: Detail, advance: Advance | None
) -> int:
    """Decodes every primitive; those that share a blob and accessors once, and still share.

    Returns the number of triangles of all primitives.
    """
    expanded: dict[tuple[Any, ...], pygltflib.Primitive] = {}
    triangles = 0
    for number, primitive in enumerate(compressed):
        user = document.meshes[primitive.mesh].primitives[primitive.primitive]
        key = (
            primitive.view,
            user.indices,
            *(tuple(g.items()) for g in [user.attributes, *user.targets]),
        )
        if key in expanded:
            first = expanded[key]
            user.indices, user.attributes = first.indices, dict(first.attributes)
            user.targets = list(map(dict, first.targets))
        else:
            _expand(document, detail.mesh(document, primitive))
            expanded[key] = user
        triangles += document.accessors[user.indices].count // 3
        del user.extensions[EXTENSION]
        if advance:
            advance((number + 1) / len(compressed))
    return triangles


def _expand(document: Document, decoded: Primitive) -> None:
    """Stores one primitive in new accessors: the old ones may have other users."""
    primitive = document.meshes[decoded.mesh].primitives[decoded.primitive]
    count = decoded.vertex_count
    primitive.indices = describe_indices(document, len(decoded.indices), count)
    primitive.attributes, *primitive.targets = (
        describe(document, names, count, bounds(a["POSITION"]) if "POSITION" in a else None)
        for names, a in zip([primitive.attributes, *primitive.targets], decoded.sets)
    )
    store_primitive(document, primitive, decoded, fallback=False)

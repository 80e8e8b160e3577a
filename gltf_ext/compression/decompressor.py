"""decompress: EXT_meshlet_edgebreaker -> a plain .glb that any reader understands."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pygltflib

from gltf_ext.compression.extension import EXTENSION, Compressed, require_compressed
from gltf_ext.compression.primitives import store_primitive
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.accessors import bounds, described_by, index_accessor, set_bounds
from gltf_ext.gltf.buffer_layout import pack
from gltf_ext.gltf.document import (
    Document,
    check_output,
    copied,
    glb_parts,
    named_indices,
    refuse_overwriting,
    write_files,
)
from gltf_ext.gltf.images import embed_images
from gltf_ext.gltf.importers import open_model
from gltf_ext.progress import progress_bar


def decompress(
    input: str | os.PathLike, output: str | os.PathLike, *, progress: bool = False
) -> dict[str, Any]:
    """Write a compressed .glb or .gltf as a plain .glb without the extension.

    Returns input, output, input_bytes, output_bytes, triangles and warnings. Raises MeshletError when the input
    is malformed or not compressed, OSError when a file cannot be read or written.
    """
    output = Path(output)
    check_output(output, input)
    try:
        document = open_model(input)
        refuse_overwriting(document.files(), [output])
        compressed = require_compressed(document)
        with progress_bar(Path(input).name, progress) as advance:
            _expand_all(document, compressed, advance)
        document.forget_extension(EXTENSION)
        warnings = embed_images(document)
        parts = glb_parts(document, pack(document)[0])
    except MeshletError as error:
        error.path = error.path or str(input)
        raise
    input_bytes = os.path.getsize(input)
    write_files({output: parts})
    return {
        "input": str(input),
        "output": str(output),
        "input_bytes": input_bytes,
        "output_bytes": sum(map(len, parts)),
        "triangles": sum(c.triangle_count for c in compressed),
        "warnings": warnings,
    }


def _expand_all(document: Document, compressed: list[Compressed], advance) -> None:
    """Primitives that share a blob and accessors are decoded once and go on sharing."""
    expanded: dict[tuple, pygltflib.Primitive] = {}
    for number, primitive in enumerate(compressed):
        user = document.meshes[primitive.mesh].primitives[primitive.primitive]
        key = (
            primitive.view,
            user.indices,
            *(tuple(named_indices(g).items()) for g in [user.attributes, *user.targets]),
        )
        if key in expanded:
            first = expanded[key]
            user.indices, user.attributes, user.targets = (
                first.indices,
                copied(first.attributes),
                list(map(copied, first.targets)),
            )
        else:
            _expand(document, primitive)
            expanded[key] = user
        del user.extensions[EXTENSION]
        if advance:
            advance((number + 1) / len(compressed))


def _expand(document: Document, compressed: Compressed) -> None:
    """Fresh accessors for one primitive, so that nothing else that may share the old ones changes."""
    primitive = document.meshes[compressed.mesh].primitives[compressed.primitive]
    decoded = compressed.decode()
    document.accessors.append(index_accessor(decoded.indices.size, decoded.vertex_count))
    primitive.indices = len(document.accessors) - 1
    for attributes, arrays in zip(
        [primitive.attributes, *primitive.targets], [decoded.attributes, *decoded.targets]
    ):
        for name, old in named_indices(attributes).items():
            accessor = described_by(document.accessors[old], decoded.vertex_count)
            if name == "POSITION":
                set_bounds(accessor, *bounds(arrays[name]))
            document.accessors.append(accessor)
            setattr(attributes, name, len(document.accessors) - 1)
    store_primitive(document, primitive, decoded, fallback=False)

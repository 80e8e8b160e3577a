"""transcode: packs a compressed file for download (EXT_meshlet_transport), or unpacks it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from gltf_ext.attributes.extension import malformed_from, require_compressed
from gltf_ext.document import gltf
from gltf_ext.document.container import model_files
from gltf_ext.document.document import Document, item
from gltf_ext.document.transport import pack_views
from gltf_ext.errors import blaming
from gltf_ext.files import check_output, write_model
from gltf_ext.lod.tables import EXTENSION as LOD
from gltf_ext.options import Options
from gltf_ext.sources.importers import open_model


def transcode(
    input: str | os.PathLike[str], output: str | os.PathLike[str], *, threads: int = 0
) -> dict[str, Any]:
    """Write a compressed .glb or .gltf packed for download, or a packed one as it was before.

    Args:
        input: path of the compressed file.
        output: path of the .glb or .gltf to write.
        threads: number of threads, 0 for one per processor.

    Returns:
        input, output, input_bytes, output_bytes, and packed: whether the output is.

    Raises:
        MeshletError: the input is malformed or not compressed.
        OSError: a file cannot be read or written.
    """
    output = Path(output)
    Options.of({"threads": threads})
    check_output(output, input)
    with blaming(input):
        document = open_model(input)
        read = document.files()
        require_compressed(document)
        if not document.was_packed:
            pack_compressed(document, threads)
        files = model_files(document, output)
    return {**write_model(input, read, files), "packed": not document.was_packed}


def pack_compressed(document: Document, threads: int) -> None:
    """Pack the views of all compressed primitives and their levels of detail."""
    views = set()
    for compressed in require_compressed(document):
        views.add(compressed.view)
        primitive = document.primitive(compressed.mesh, compressed.primitive)
        levels = gltf.extension(primitive, LOD)
        if isinstance(levels, dict) and isinstance(levels.get("pages"), dict):
            view = levels["pages"].get("bufferView")
            item(document.bufferViews, view, "bufferView")  # readers of level 0 have not checked it
            views.add(view)
    with malformed_from("its compressed data"):
        pack_views(document, views, threads)

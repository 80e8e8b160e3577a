"""transcode: packs a compressed file for download (EXT_meshlet_transport), or unpacks it."""

from __future__ import annotations

from typing import Any

from gltf_ext.attributes.extension import malformed_from, require_compressed
from gltf_ext.commands.result import Result, output_path
from gltf_ext.document import gltf
from gltf_ext.document.document import Document, NewBytes, item
from gltf_ext.document.gltf2 import File, Model, name_of
from gltf_ext.document.transport import pack_views
from gltf_ext.errors import blaming
from gltf_ext.lod.tables import EXTENSION as LOD
from gltf_ext.options import Options
from gltf_ext.sources.importers import open_model


def transcode(input: Model, output: File | None = None, *, threads: int = 0) -> dict[str, Any]:
    """Write a compressed .glb or .gltf packed for download, or a packed one as it was before.

    Args:
        input: path of the compressed file, or a pygltflib.GLTF2, which stays as it is.
        output: path of the .glb or .gltf to write; without it, the report has a new GLTF2.
        threads: number of threads, 0 for one per processor.

    Returns:
        input, output, input_bytes, output_bytes, and packed: whether the output is; without an
        output path also gltf: the new GLTF2.

    Raises:
        MeshletError: the input is malformed or not compressed.
        OSError: a file cannot be read or written.
    """
    Options.of({"threads": threads})
    path = output_path(output, input)
    with blaming(name_of(input)):
        document = open_model(input)
        read = document.files()
        require_compressed(document)
        _keep_fallback(document)
        if not document.was_packed:
            pack_compressed(document, threads)
        result = Result.of(document, path)
    return {**result.write(input, read), "packed": not document.was_packed}


def _keep_fallback(document: Document) -> None:
    """Let the plain data of compressed primitives stay in a file of their own."""
    accessors = {
        index
        for compressed in require_compressed(document)
        for primitive in [document.primitive(compressed.mesh, compressed.primitive)]
        for names in ({"indices": primitive["indices"]}, *gltf.attribute_sets(primitive))
        for index in names.values()
    }
    holders = [document.accessors[index] for index in accessors]
    plain = {holder["bufferView"] for holder in holders if "bufferView" in holder}
    others = set(range(len(document.bufferViews))) - plain
    mixed = {document.bufferViews[index].get("buffer") for index in others}
    for index in sorted(plain):
        view = item(document.bufferViews, index, "bufferView")
        if view.get("buffer") not in mixed and index not in document.new_bytes:
            document.new_bytes[index] = NewBytes(document.bytes_of_view(index), fallback=True)


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

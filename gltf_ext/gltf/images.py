"""Moves images into the binary chunk."""

from __future__ import annotations

import pygltflib

from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import Document

SIGNATURES = (
    (b"\x89PNG", "image/png"),
    (b"\xff\xd8\xff", "image/jpeg"),
    (b"RIFF", "image/webp"),
    (b"\xabKTX 20", "image/ktx2"),
    (b"DDS ", "image/vnd-ms.dds"),
)


def embed_images(document: Document) -> list[str]:
    """Moves images behind data: uris and relative paths into buffer views.

    Returns a warning for each image that stays where it is.
    """
    warnings = []
    for image in document.images:
        if image.uri is not None:
            warnings += _embed(document, image)
    return warnings


def _embed(document: Document, image: pygltflib.Image) -> list[str]:
    try:
        data = document.read_uri(image.uri)
    except MeshletError as error:
        return [f"an image is left where it is: {error}"]
    mime = image.mimeType or next(
        (m for signature, m in SIGNATURES if data.startswith(signature)), None
    )
    if mime is None or not data:
        return [f"an image is left where it is: {image.uri[:80]} has an unknown format"]
    image.bufferView, image.mimeType, image.uri = document.add_view(data), mime, None
    return []

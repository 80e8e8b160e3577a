""".glb and .gltf files <-> documents."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import DAMAGED, Document

GLB_HEADER = struct.Struct("<4sII")  # magic, version, length of the file
CHUNK_HEADER = struct.Struct("<I4s")  # length, type
JSON_CHUNK, BIN_CHUNK = b"JSON", b"BIN\0"
MAX_GLB_BYTES = 2**32 - 1
MAX_JSON_DEPTH = 200
CUT_OFF = "the file is cut off; get it again"
EMPTY, EXPORT_AGAIN = "is empty", "export it again"


# --- reading ---


def read_document(path: str | os.PathLike[str]) -> Document:
    """Reads a .glb or .gltf file. Raises MeshletError, OSError."""
    path = Path(path)
    data = path.read_bytes()
    if not data:
        raise MeshletError(EMPTY, EXPORT_AGAIN)
    if data[:4] == b"glTF":
        return parse_glb(data, path.parent)
    return _parse_json(data, None, path.parent)


def parse_glb(data: bytes, base: Path = Path()) -> Document:
    """A document from the bytes of a .glb file. Raises MeshletError."""
    chunks = _chunks(memoryview(data))
    if not chunks or chunks[0][0] != JSON_CHUNK:
        raise MeshletError(
            "its first chunk is not JSON", "the file is not a valid .glb; export it again"
        )
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == BIN_CHUNK else None
    return _parse_json(bytes(chunks[0][1]), binary, base)


def _chunks(data: memoryview) -> list[tuple[bytes, memoryview]]:
    """(type, bytes) of each chunk of a .glb."""
    if len(data) < GLB_HEADER.size:
        raise MeshletError("is shorter than a .glb header", CUT_OFF)
    _, version, length = GLB_HEADER.unpack_from(data)
    if version != 2:
        raise MeshletError(
            f"is .glb version {version}, only version 2 can be read", "convert it to glTF 2.0 first"
        )
    if not GLB_HEADER.size <= length <= len(data):
        raise MeshletError(f"has {len(data)} bytes, its header says {length}", CUT_OFF)
    chunks: list[tuple[bytes, memoryview]] = []
    position = GLB_HEADER.size
    while position + CHUNK_HEADER.size <= length:
        size, kind = CHUNK_HEADER.unpack_from(data, position)
        position += CHUNK_HEADER.size
        if position + size > length:
            raise MeshletError(f"chunk {len(chunks)} reaches beyond the end of the file", DAMAGED)
        chunks.append((kind, data[position : position + size]))
        position += size
    return chunks


def _parse_json(text: bytes, binary: memoryview | None, base: Path) -> Document:
    try:
        properties = json.loads(text.decode("utf-8-sig"))
    except (ValueError, RecursionError):
        raise MeshletError(
            "is not a .glb, and its JSON cannot be read",
            "the file is damaged or not glTF; export it again",
        ) from None
    if _depth(properties) > MAX_JSON_DEPTH:
        raise MeshletError(
            f"its JSON is nested deeper than {MAX_JSON_DEPTH}",
            "the file is damaged; export it again",
        )
    return Document(properties, binary, base)


def _depth(value: Any) -> int:
    """Nesting depth of parsed JSON, level by level. Stops counting just beyond the limit."""
    depth, level = 0, [value]
    while level and depth <= MAX_JSON_DEPTH:
        level = [child for parent in level for child in _children(parent)]
        depth += 1
    return depth


def _children(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []


# --- writing ---


def glb_parts(document: Document, binary: Sequence[bytes | memoryview]) -> list[bytes | memoryview]:
    """The pieces of a .glb file, in order. Raises MeshletError.

    binary: the pieces of the binary chunk.
    """
    try:
        text = document.to_json()
    except ValueError:
        raise MeshletError(
            "its JSON holds NaN or infinity, which glTF cannot", "export it again"
        ) from None
    text += b" " * (-len(text) % 4)
    binary_length = sum(map(len, binary))
    padding = -binary_length % 4
    length = GLB_HEADER.size + CHUNK_HEADER.size + len(text)
    if binary_length:
        length += CHUNK_HEADER.size + binary_length + padding
    if length > MAX_GLB_BYTES:
        raise MeshletError("the result does not fit a .glb file (4 GiB)", "split the model")
    header = GLB_HEADER.pack(b"glTF", 2, length)
    parts = [header, CHUNK_HEADER.pack(len(text), JSON_CHUNK), text]
    if binary_length:
        chunk_header = CHUNK_HEADER.pack(binary_length + padding, BIN_CHUNK)
        return [*parts, chunk_header, *binary, bytes(padding)]
    return list(parts)

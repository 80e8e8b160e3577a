""".glb and .gltf files <-> documents."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from gltf_ext.document.buffer_layout import Pieces, pack
from gltf_ext.document.document import CONVERT, DAMAGED, Document, files_of, read_file
from gltf_ext.document.lfs import refuse_pointer
from gltf_ext.document.meshopt import unpack_meshopt
from gltf_ext.document.references import note_orphans
from gltf_ext.document.transport import unpack_views
from gltf_ext.errors import EXPORT_AGAIN, MeshletError

GLB_HEADER = struct.Struct("<4sII")  # magic, version, length of the file
CHUNK_HEADER = struct.Struct("<I4s")  # length, type
JSON_CHUNK, BIN_CHUNK = b"JSON", b"BIN\0"
MAX_GLB_BYTES = 2**32 - 1
MAX_BINARY_BYTES = 15 << 28  # of a .glb's binary chunk; the rest is for the JSON
# Of a .bin file. One with a single larger view has more; browsers load buffers of at most 2 GiB.
BIN_BYTES = 1 << 30
MAX_JSON_DEPTH = 200
CUT_OFF = "the file is cut off; get it again"
EMPTY = "is empty"


# --- reading ---


def read_document(path: str | os.PathLike[str]) -> Document:
    """Read a .glb or .gltf file. Raises MeshletError, OSError."""
    path = Path(path)
    return parse_json(*_text_and_binary(path), path.parent)


def referenced_files(path: Path) -> list[Path]:
    """List the files that buffers and images of a .glb or .gltf name, whether they exist or not.

    Of what is no valid glTF, which `read_document` refuses, as far as it can be told. Raises
    MeshletError, OSError.
    """
    properties = _parsed(_text_and_binary(path)[0])
    if not isinstance(properties, dict):
        return []
    lists = [properties.get(name) for name in ("buffers", "images")]
    holders = [holder for items in lists if isinstance(items, list) for holder in items]
    return files_of([h for h in holders if isinstance(h, dict)], path.parent)


def _text_and_binary(path: Path) -> tuple[bytes, memoryview | None]:
    """Return (JSON, binary chunk) of a file. Raises MeshletError, OSError."""
    data = read_file(path)
    if not data:
        raise MeshletError(EMPTY, EXPORT_AGAIN)
    refuse_pointer(data)
    return _main_chunks(data) if data[:4] == b"glTF" else (bytes(data), None)


def parse_glb(data: bytes | memoryview, base: Path = Path()) -> Document:
    """Return a document from the bytes of a .glb file. Raises MeshletError."""
    return parse_json(*_main_chunks(data), base)


def _main_chunks(data: bytes | memoryview) -> tuple[bytes, memoryview | None]:
    """Return (JSON, binary chunk) of a .glb. Raises MeshletError."""
    chunks = _chunks(memoryview(data))
    if not chunks or chunks[0][0] != JSON_CHUNK:
        raise MeshletError(
            "its first chunk is not JSON", "the file is not a valid .glb; export it again"
        )
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == BIN_CHUNK else None
    return bytes(chunks[0][1]), binary


def _chunks(data: memoryview) -> list[tuple[bytes, memoryview]]:
    """Return (type, bytes) of each chunk of a .glb."""
    if len(data) < GLB_HEADER.size:
        raise MeshletError("is shorter than a .glb header", CUT_OFF)
    _, version, length = GLB_HEADER.unpack_from(data)
    if version != 2:
        raise MeshletError(f"is .glb version {version}, not glTF 2.0", CONVERT)
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


def parse_json(text: bytes, binary: memoryview | None, base: Path) -> Document:
    """Return a document from JSON and the bytes of the binary chunk. Raises MeshletError."""
    document = Document(_parsed(text), binary, base)
    unpack_meshopt(document)
    document.was_packed = unpack_views(document)
    note_orphans(document)
    return document


def _parsed(text: bytes) -> Any:
    """Parse JSON that is not nested too deeply. Raises MeshletError."""
    try:
        # Some exporters pad the chunk with NUL instead of spaces.
        properties = json.loads(text.rstrip(b"\0").decode("utf-8-sig"))
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
    return properties


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


def model_files(document: Document, output: Path) -> dict[Path, Pieces]:
    """Path -> pieces of the files that a document becomes, the model last. Raises MeshletError.

    A .glb; if `output` is a .gltf, or the data do not fit a .glb, a .gltf with .bin files of at
    most BIN_BYTES or one larger view. A fallback has its own .bin. Drops unused data.
    """
    most = MAX_BINARY_BYTES if output.suffix.lower() == ".glb" else 0
    binaries, fallback = pack(document, most, BIN_BYTES)
    fallback_path = fallback_of(output)
    files: dict[Path, Pieces] = {fallback_path: fallback} if fallback else {}
    if fallback:
        document.buffers[-1]["uri"] = _uri(fallback_path)
    if len(binaries) == 1 and sum(map(len, binaries[0])) <= most:
        return {**files, output: _glb_parts(document, binaries[0])}
    for number, pieces in enumerate(binaries):
        name = f"{output.stem}.{number}.bin" if len(binaries) > 1 else f"{output.stem}.bin"
        files[output.with_name(name)] = pieces
        document.buffers[number]["uri"] = _uri(Path(name))
    return {**files, output.with_suffix(".gltf"): [json_of(document)]}


def fallback_of(output: Path) -> Path:
    """Return the file of a model's fallback."""
    return output.with_name(f"{output.stem}.fallback.bin")


def _uri(path: Path) -> str:
    return quote(os.fsencode(path.name))


def json_of(document: Document) -> bytes:
    """Return the JSON as it is written. Raises MeshletError for NaN and infinity."""
    try:
        return document.to_json()
    except ValueError:
        raise MeshletError(
            "its JSON holds NaN or infinity, which glTF cannot", EXPORT_AGAIN
        ) from None


def _glb_parts(document: Document, binary: Sequence[bytes | memoryview]) -> Pieces:
    """Return the pieces of a .glb file, in order. Raises MeshletError.

    binary: the pieces of the binary chunk.
    """
    text = json_of(document)
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

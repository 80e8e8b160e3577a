"""Reading and writing .glb and .gltf files as pygltflib objects, without losing or inventing anything.

pygltflib fills absent properties with defaults, drops what it does not know, drops empty objects inside extras, and
crashes on unexpected types; `Document` checks types against pygltflib's own annotations while reading and writes
only what was there or has been set.
"""

from __future__ import annotations

import base64
import binascii
import dataclasses
import json
import os
import struct
import typing
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import pygltflib

from gltf_ext.errors import MeshletError

GLB_HEADER = struct.Struct("<4sII")
CHUNK_HEADER = struct.Struct("<I4s")
JSON_CHUNK, BIN_CHUNK = b"JSON", b"BIN\0"
MAX_GLB_BYTES = 2**32 - 1
MAX_JSON_DEPTH = 200
# What to do.
DAMAGED = "the file is damaged; get it again"
CUT_OFF = "the file is cut off; get it again"
EMPTY, EXPORT_AGAIN = "is empty", "export it again"
NOT_VALID = "the file is not valid glTF; export it again"


class Document(pygltflib.GLTF2):
    """A glTF document with its buffers.

    base: folder that relative uris refer to; binary: the .glb's binary chunk. bytes_of_buffer(i) and
    bytes_of_view(i) give checked memoryviews; new buffer views carry their bytes (`add_view`).
    """

    base: Path = Path()
    binary: memoryview | None = None
    import_warnings: tuple[str, ...] = ()

    @classmethod
    def from_json_object(cls, properties: Any) -> Document:
        document = _decode(cls, properties, "the document")
        if not document.asset or not str(document.asset.version).startswith("2."):
            raise MeshletError("is not glTF 2.0", "convert it to glTF 2.0 first")
        document._buffers_read = {}
        return document

    def to_json(self) -> str:
        """Minified JSON; ValueError when it holds NaN or infinity."""
        return minified(_encode(self)).decode()

    def bytes_of_buffer(self, index: int) -> memoryview:
        buffer = item(self.buffers, index, "buffer")
        if index not in self._buffers_read:
            data = self.binary if buffer.uri is None else memoryview(self.read_uri(buffer.uri))
            if data is None:
                raise MeshletError(f"buffer {index} has neither a uri nor a binary chunk", DAMAGED)
            if buffer.byteLength is None or not 0 <= buffer.byteLength <= len(data):
                raise MeshletError(
                    f"buffer {index} has {len(data)} bytes instead of {buffer.byteLength}",
                    "the file is damaged or cut off; get it again",
                )
            self._buffers_read[index] = data[: buffer.byteLength]
        return self._buffers_read[index]

    def bytes_of_view(self, index: int) -> memoryview:
        view = item(self.bufferViews, index, "bufferView")
        data = getattr(view, "data", None)
        if data is not None:
            return data
        if any(name.endswith("meshopt_compression") for name in view.extensions or ()):
            raise MeshletError(
                "is compressed with meshopt",
                "decompress it first: gltfpack -noq -i IN.glb -o OUT.glb",
            )
        if view.buffer is None:
            raise MeshletError(f"bufferView {index} names no buffer", DAMAGED)
        buffer = self.bytes_of_buffer(view.buffer)
        start, length = view.byteOffset or 0, view.byteLength
        if length is None or start < 0 or length < 0 or start + length > len(buffer):
            raise MeshletError(f"bufferView {index} reaches beyond buffer {view.buffer}", DAMAGED)
        return buffer[start : start + length]

    def read_uri(self, uri: str) -> bytes:
        """The bytes behind a data: uri or a path relative to the document."""
        if uri.startswith("data:"):
            return _data_uri_bytes(uri)
        if "://" in uri or unquote(uri).startswith("/"):
            raise MeshletError(
                f"refers to {uri}, which is not a relative path", "put the file beside the .gltf"
            )
        try:
            return self.path_of(uri).read_bytes()
        except (OSError, ValueError):
            raise MeshletError(
                f"refers to {uri}, which cannot be read", "put the file beside it"
            ) from None

    def path_of(self, uri: str) -> Path:
        """The file behind a relative uri; ValueError when there can be none."""
        return self.base / os.fsdecode(unquote_to_bytes(uri))

    def files(self) -> list[Path]:
        """The files that buffers and images refer to."""
        uris = [holder.uri for holder in (*self.buffers, *self.images)]
        return [
            self.path_of(uri)
            for uri in uris
            if uri and not uri.startswith("data:") and uri.isprintable()
        ]

    def add_view(self, data, **properties) -> int:
        """Append a buffer view that owns its bytes; returns its index."""
        view = pygltflib.BufferView(byteLength=len(data), **properties)
        view.data = memoryview(data)
        self.bufferViews.append(view)
        return len(self.bufferViews) - 1

    def use_extension(self, name: str, required: bool) -> None:
        for names in [self.extensionsUsed] + [self.extensionsRequired] * required:
            if name not in names:
                names.append(name)

    def forget_extension(self, name: str) -> None:
        for names in (self.extensionsUsed, self.extensionsRequired):
            if name in names:
                names.remove(name)


def item(items: list, index: Any, kind: str):
    """items[index], or an error that names the kind."""
    if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(items):
        raise MeshletError(f"{kind} {index} does not exist", DAMAGED)
    return items[index]


def named_indices(attributes: pygltflib.Attributes | None) -> dict[str, int]:
    """Attribute name -> accessor index."""
    return (
        {name: index for name, index in vars(attributes).items() if index is not None}
        if attributes
        else {}
    )


def copied(attributes: pygltflib.Attributes) -> pygltflib.Attributes:
    """Renumbering changes attributes in place, so no two primitives may share one object."""
    return pygltflib.Attributes(**named_indices(attributes))


# --- reading ---


def read_document(path: str | os.PathLike) -> Document:
    """Read a .glb or .gltf file."""
    path = Path(path)
    data = path.read_bytes()
    if not data:
        raise MeshletError(EMPTY, EXPORT_AGAIN)
    return (
        parse_glb(data, path.parent)
        if data[:4] == b"glTF"
        else _parse_json(data, None, path.parent)
    )


def parse_glb(data: bytes, base: Path = Path()) -> Document:
    """A document from the bytes of a .glb file."""
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
    document = Document.from_json_object(properties)
    document.base, document.binary = base, binary
    return document


def _depth(value: Any) -> int:
    """Nesting depth of parsed JSON, without recursion; counts no further than just beyond the limit."""
    depth, level = 0, [value]
    while level and depth <= MAX_JSON_DEPTH:
        level = [
            child
            for v in level
            if isinstance(v, (dict, list))
            for child in (v.values() if isinstance(v, dict) else v)
        ]
        depth += 1
    return depth


def _data_uri_bytes(uri: str) -> bytes:
    header, comma, payload = uri.partition(",")
    try:
        if not comma:
            raise ValueError
        return (
            base64.b64decode(unquote(payload), validate=False)
            if header.endswith(";base64")
            else unquote_to_bytes(payload)
        )
    except (ValueError, binascii.Error):
        raise MeshletError(
            "a data: uri cannot be decoded", "the file is damaged; export it again"
        ) from None


@cache
def _field_decoders(cls: type) -> dict[str, Callable[[Any, str], Any]]:
    hints = typing.get_type_hints(cls)
    return {f.name: _decoder(hints[f.name]) for f in dataclasses.fields(cls)}


def _decoder(hint: Any) -> Callable[[Any, str], Any]:
    """A function (value, where) -> checked value for a type annotation of pygltflib."""
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) is typing.Union:
        return _decoder(arguments[0])
    if typing.get_origin(hint) is list:
        decode_item = _decoder(arguments[0])
        return lambda value, where: [
            decode_item(v, f"{where}[{i}]") for i, v in enumerate(_check(value, list, where))
        ]
    if hint is pygltflib.Attributes:
        return _decode_attributes
    if dataclasses.is_dataclass(hint):
        return lambda value, where: _decode(hint, value, where)
    return {
        int: _integer,
        float: _number,
        str: lambda v, w: _check(v, str, w),
        bool: lambda v, w: _check(v, bool, w),
    }.get(hint, lambda v, w: v)


def _check(value: Any, kind: type, where: str):
    if not isinstance(value, kind):
        names = {list: "an array", dict: "an object", str: "a string", bool: "a boolean"}
        raise MeshletError(f"{where} is not {names[kind]}", NOT_VALID)
    return value


def _integer(value: Any, where: str) -> int:
    if (
        isinstance(value, bool)
        or not isinstance(value, (int, float))
        or value != value
        or value in (float("inf"), float("-inf"))
        or value != int(value)
    ):
        raise MeshletError(f"{where} is not an integer", NOT_VALID)
    return int(value)


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise MeshletError(f"{where} is not a number", NOT_VALID)
    return value


def _decode(cls: type, properties: Any, where: str):
    """A pygltflib object from parsed JSON; remembers the JSON for `_encode`."""
    _check(properties, dict, where)
    decoders = _field_decoders(cls)
    given = {}
    for name, value in properties.items():
        if name == "extensions":
            _check(value, dict, f"{where}.extensions")
        if name in decoders and value is not None:
            given[name] = decoders[name](value, f"{where}.{name}")
    result = cls(**given)
    result.source_properties = properties
    return result


def _decode_attributes(properties: Any, where: str) -> pygltflib.Attributes:
    _check(properties, dict, where)
    return pygltflib.Attributes(
        **{name: _integer(index, f"{where}.{name}") for name, index in properties.items()}
    )


# --- writing ---


def _encode(value: Any) -> Any:
    if isinstance(value, pygltflib.Attributes):
        return named_indices(value)
    if isinstance(value, list):
        return [_encode(v) for v in value]
    if not dataclasses.is_dataclass(value):
        return value
    source = getattr(value, "source_properties", {})
    defaults = _defaults(type(value))
    result = {name: v for name, v in source.items() if name not in defaults}
    for name, default in defaults.items():
        current = getattr(value, name)
        if (
            current is None
            or current in ([], {})
            or (current == default and name not in source and name not in REQUIRED)
        ):
            continue
        result[name] = _encode(current)
    return result


# Written even when they equal pygltflib's default.
REQUIRED = {"asset", "version"}


@cache
def _defaults(cls: type) -> dict[str, Any]:
    return {
        f.name: f.default_factory() if f.default_factory is not dataclasses.MISSING else f.default
        for f in dataclasses.fields(cls)
    }


def glb_parts(document: Document, binary: list) -> list:
    """The pieces of a .glb file, to be written one after the other. binary: pieces of the binary chunk."""
    try:
        text = document.to_json().encode()
    except ValueError:
        raise MeshletError(
            "its JSON holds NaN or infinity, which glTF cannot", "export it again"
        ) from None
    text += b" " * (-len(text) % 4)
    binary_length = sum(len(part) for part in binary)
    padding = -binary_length % 4
    length = (
        GLB_HEADER.size
        + CHUNK_HEADER.size
        + len(text)
        + (CHUNK_HEADER.size + binary_length + padding if binary_length else 0)
    )
    if length > MAX_GLB_BYTES:
        raise MeshletError("the result does not fit a .glb file (4 GiB)", "split the model")
    parts = [GLB_HEADER.pack(b"glTF", 2, length), CHUNK_HEADER.pack(len(text), JSON_CHUNK), text]
    if binary_length:
        parts += [CHUNK_HEADER.pack(binary_length + padding, BIN_CHUNK), *binary, bytes(padding)]
    return parts


def check_output(path: Path, input: str | os.PathLike) -> None:
    """Refuse, before any work, an output that is not a .glb in a folder that exists, or that is the input."""
    if path.suffix.lower() != ".glb":
        raise MeshletError("the output is not a .glb", "name it something.glb", str(path))
    if not path.parent.is_dir():
        raise MeshletError("its folder does not exist", "create it first", str(path))
    if path.is_dir():
        raise MeshletError("is a folder", "name a file", str(path))
    refuse_overwriting([Path(input)], [path])


def refuse_overwriting(inputs: list[Path], outputs: list[Path]) -> None:
    """Refuse outputs that are inputs, also through links."""
    for output in outputs:
        if any(path.exists() and output.exists() and path.samefile(output) for path in inputs):
            raise MeshletError("is the input too", "name another output", str(output))


def write_files(contents: dict[Path, list]) -> None:
    """Write each path's pieces beside it, and rename all of them when everything has been written.

    An OSError names the path, not the file beside it.
    """
    partials = {path.with_name(f".{path.name}.{os.getpid()}.part"): path for path in contents}
    try:
        for partial, path in partials.items():
            _naming(path, _write, partial, contents[path])
        for partial, path in partials.items():
            _naming(path, os.replace, partial, path)
    finally:
        for partial in partials:
            partial.unlink(missing_ok=True)


def _write(path: Path, pieces: list) -> None:
    with open(path, "wb") as file:
        file.writelines(pieces)


def _naming(path: Path, run: Callable, *arguments: Any) -> None:
    """Run, and let an OSError name the path."""
    try:
        run(*arguments)
    except OSError as error:
        error.filename = str(path)
        raise


def minified(value: Any) -> bytes:
    """JSON as it is written into files; ValueError for NaN and infinity."""
    try:
        return json.dumps(
            value, separators=(",", ":"), ensure_ascii=False, allow_nan=False
        ).encode()
    except UnicodeEncodeError:  # lone surrogates, which only an escape can hold
        return json.dumps(value, separators=(",", ":"), allow_nan=False).encode()

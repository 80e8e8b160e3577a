"""A glTF file in memory: its objects, and the bytes of its buffers."""

from __future__ import annotations

import base64
import binascii
import mmap
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import pygltflib

from gltf_ext.document.json_objects import from_json, minified, to_json
from gltf_ext.errors import MeshletError
from gltf_ext.portable import file_name, is_relative, path_beside

DAMAGED = "the file is damaged; get it again"
TRIANGLE_MODES = (pygltflib.TRIANGLES, pygltflib.TRIANGLE_STRIP, pygltflib.TRIANGLE_FAN)
MOST_READ = 1 << 24  # bytes of a file; larger ones are mapped
MESHOPT_REMEDY = "decompress it first: gltfpack -noq -i IN.glb -o OUT.glb"


@dataclass(frozen=True)
class NewBytes:
    """Bytes of a buffer view that is not in a buffer yet.

    fallback: they go to the fallback's buffer, not to the binary chunk.
    packed: what is written instead of them, see transport.py.
    """

    data: memoryview
    fallback: bool
    packed: bytes | None = None


class Document:
    """A glTF document with its buffers.

    The objects are pygltflib's. Its functions that read and write files are not used, since they
    lose properties: see json_objects.py.

    Attributes:
        root: the pygltflib object of the whole file; its attributes (accessors, ...) are also the
            document's.
        base: the folder that relative uris refer to.
        import_warnings: one line for each thing lost when another format was read.
        import_files: the other files that were read then, such as materials and textures.
        was_packed: the file had packed views (transport.py).
    """

    def __init__(
        self, properties: Any, binary: memoryview | None = None, base: Path = Path()
    ) -> None:
        """properties: the parsed JSON; binary: the binary chunk. Raises MeshletError."""
        self.root: pygltflib.GLTF2 = from_json(pygltflib.GLTF2, properties, "")
        if not self.asset or not str(self.asset.version).startswith("2."):
            raise MeshletError("is not glTF 2.0", "convert it to glTF 2.0 first")
        self.base = base
        self.import_warnings: tuple[str, ...] = ()
        self.import_files: tuple[Path, ...] = ()
        self.was_packed = False
        self._binary = binary
        self._buffers_read: dict[int, memoryview] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self.__dict__["root"], name)

    def to_json(self) -> bytes:
        """Minified JSON. Raises ValueError when it holds NaN or infinity."""
        return minified(to_json(self.root))

    # --- bytes ---

    def bytes_of_buffer(self, index: int) -> memoryview:
        """The bytes of a buffer, read once. Raises MeshletError."""
        buffer = item(self.buffers, index, "buffer")
        if index not in self._buffers_read:
            data = self._binary if buffer.uri is None else memoryview(self._buffer_of(buffer.uri))
            if data is None:
                raise MeshletError(f"buffer {index} has neither a uri nor a binary chunk", DAMAGED)
            if buffer.byteLength is None or not 0 <= buffer.byteLength <= len(data):
                raise MeshletError(
                    f"buffer {index} has {len(data)} bytes instead of {buffer.byteLength}",
                    "the file is damaged or cut off; get it again",
                )
            self._buffers_read[index] = data[: buffer.byteLength]
        return self._buffers_read[index]

    def bytes_of_view(self, index: Any) -> memoryview:
        """The bytes of a buffer view. Raises MeshletError."""
        view = item(self.bufferViews, index, "bufferView")
        new = new_bytes(view)
        if new is not None:
            return new.data
        if any(name.endswith("meshopt_compression") for name in view.extensions or ()):
            raise MeshletError("is compressed with meshopt", MESHOPT_REMEDY)
        if view.buffer is None:
            raise MeshletError(f"bufferView {index} names no buffer", DAMAGED)
        buffer = self.bytes_of_buffer(view.buffer)
        start, length = view.byteOffset or 0, view.byteLength
        if length is None or start < 0 or length < 0 or start + length > len(buffer):
            raise MeshletError(f"bufferView {index} reaches beyond buffer {view.buffer}", DAMAGED)
        return buffer[start : start + length]

    def add_view(
        self,
        data: bytes | memoryview,
        *,
        fallback: bool = False,
        byteStride: int | None = None,
        target: int | None = None,
        name: str | None = None,
    ) -> int:
        """Appends a buffer view with bytes of its own; returns its index."""
        view = pygltflib.BufferView(
            byteLength=len(data), byteStride=byteStride, target=target, name=name
        )
        view.new_bytes = NewBytes(memoryview(data), fallback)
        self.bufferViews.append(view)
        return len(self.bufferViews) - 1

    # --- files ---

    def read_uri(self, uri: str) -> bytes:
        """The bytes behind a data: uri or a path relative to the document. Raises MeshletError."""
        return bytes(self._buffer_of(uri))

    def _buffer_of(self, uri: str) -> bytes | memoryview:
        if uri.startswith("data:"):
            return _data_uri_bytes(uri)
        if "://" in uri or not is_relative(unquote(uri)):
            raise MeshletError(
                f"refers to {uri}, which is not a relative path", "put the file beside the .gltf"
            )
        try:
            path = self.path_of(uri)
            if not path.is_file():  # a device or a pipe may never end
                raise ValueError
            return read_file(path)
        except (OSError, ValueError):
            raise MeshletError(
                f"refers to {uri}, which cannot be read", "put the file beside it"
            ) from None

    def path_of(self, uri: str) -> Path:
        """The file behind a relative uri. Raises ValueError when there can be none."""
        path = path_beside(self.base, file_name(unquote_to_bytes(uri)))
        if path is None:
            raise ValueError
        return path

    def files(self) -> list[Path]:
        """The files that buffers and images refer to, and those that an import has read."""
        found = list(self.import_files)
        for holder in (*self.buffers, *self.images):
            if holder.uri and not holder.uri.startswith("data:"):
                with suppress(ValueError):  # no path at all, so nothing reads it
                    found.append(self.path_of(holder.uri))
        return found

    # --- extensions ---

    def use_extension(self, name: str, required: bool) -> None:
        """Adds the name to extensionsUsed and, if required, to extensionsRequired."""
        for names in [self.extensionsUsed] + [self.extensionsRequired] * required:
            if name not in names:
                names.append(name)

    def forget_extension(self, name: str) -> None:
        """Removes the name from extensionsUsed and extensionsRequired."""
        for names in (self.extensionsUsed, self.extensionsRequired):
            if name in names:
                names.remove(name)


def read_file(path: Path) -> bytes | memoryview:
    """The bytes of a file; a large one is mapped into memory. Raises OSError."""
    with open(path, "rb") as file:
        if os.fstat(file.fileno()).st_size <= MOST_READ:
            return file.read()
        return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))


def new_bytes(view: pygltflib.BufferView) -> NewBytes | None:
    """The bytes given to add_view; None for a view of the file that was read."""
    return getattr(view, "new_bytes", None)


def item(items: list[Any], index: Any, kind: str) -> Any:
    """items[index]. Raises MeshletError, naming the kind, for an index that does not exist."""
    if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(items):
        raise MeshletError(f"{kind} {index} does not exist", DAMAGED)
    return items[index]


def _data_uri_bytes(uri: str) -> bytes:
    header, comma, payload = uri.partition(",")
    try:
        if not comma:
            raise ValueError
        if header.endswith(";base64"):
            return base64.b64decode(unquote(payload), validate=False)
        return unquote_to_bytes(payload)
    except (ValueError, binascii.Error):
        raise MeshletError(
            "a data: uri cannot be decoded", "the file is damaged; export it again"
        ) from None

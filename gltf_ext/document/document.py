"""A glTF file in memory: its objects, and the bytes of its buffers."""

from __future__ import annotations

import base64
import binascii
import mmap
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, TypeVar
from urllib.parse import unquote, unquote_to_bytes

from gltf_ext.document import gltf
from gltf_ext.document.json_types import checked
from gltf_ext.document.json_values import member, minified
from gltf_ext.document.lfs import PROBLEM, REMEDY, is_pointer
from gltf_ext.errors import MeshletError
from gltf_ext.portable import file_name, is_relative, path_beside

DAMAGED = "the file is damaged; get it again"
T = TypeVar("T")
MOST_READ = 1 << 24  # bytes of a file; larger ones are mapped
CONVERT = "convert it first: npx gltf-pipeline -i IN -o OUT.glb"
MESHOPT_REMEDY = "install a decoder: pip install gltf-meshlet[meshopt]"


@dataclass(frozen=True)
class NewBytes:
    """Bytes of a buffer view that is not in a buffer yet.

    source: these, or what returns them when they are read for the first time.
    fallback: they go to the fallback's buffer, not to the binary chunk.
    packed: what is written instead of them, see transport.py.
    """

    source: memoryview | Callable[[], memoryview]
    fallback: bool
    packed: bytes | None = None

    @cached_property
    def data(self) -> memoryview:
        """The bytes. Raises MeshletError."""
        return self.source if isinstance(self.source, memoryview) else self.source()


class Document:
    """A glTF document with its buffers.

    Attributes:
        json: the whole file as its JSON has it, checked; what is written is this.
        accessors, ...: its lists. They are always there, and never replaced: set their items.
        new_bytes: buffer view -> its bytes, if they are not in a buffer yet.
        base: the folder that relative uris refer to.
        import_warnings: one line for each thing lost when another format was read.
        import_rounding: the largest difference of a coordinate to that in the file, a double.
        import_files: the other files that were read then, such as materials and textures.
        was_packed: the file had packed views (transport.py).
        packed_views: their numbers in the file.
        packing_faults: rules of packing that the file breaks although they could be read.
        orphans: numbers of accessors ("accessor") and buffer views ("bufferview") that nothing in
            the file refers to, as far as is known, if it has an unknown extension (references.py).
        unread_bytes: what all views take that are decoded when they are read (meshopt.py).
    """

    def __init__(
        self, properties: Any, binary: memoryview | None = None, base: Path = Path()
    ) -> None:
        """properties: the parsed JSON; binary: the binary chunk. Raises MeshletError."""
        _require_version_2(properties)
        self.json = checked(properties)
        self.json.setdefault("asset", {}).setdefault("version", gltf.VERSION)
        self.accessors: Final = self.json["accessors"]
        self.animations: Final = self.json["animations"]
        self.bufferViews: Final = self.json["bufferViews"]
        self.buffers: Final = self.json["buffers"]
        self.cameras: Final = self.json["cameras"]
        self.extensionsRequired: Final = self.json["extensionsRequired"]
        self.extensionsUsed: Final = self.json["extensionsUsed"]
        self.images: Final = self.json["images"]
        self.materials: Final = self.json["materials"]
        self.meshes: Final = self.json["meshes"]
        self.nodes: Final = self.json["nodes"]
        self.samplers: Final = self.json["samplers"]
        self.scenes: Final = self.json["scenes"]
        self.skins: Final = self.json["skins"]
        self.textures: Final = self.json["textures"]
        self.new_bytes: dict[int, NewBytes] = {}
        self.base = base
        self.import_warnings: tuple[str, ...] = ()
        self.import_rounding = 0.0
        self.import_files: tuple[Path, ...] = ()
        self.was_packed = False
        self.packed_views: frozenset[int] = frozenset()
        self.packing_faults: list[str] = []
        self.orphans: dict[str, set[int]] = {"accessor": set(), "bufferview": set()}
        self.unread_bytes = 0
        self._binary = binary
        self._buffers_read: dict[int, memoryview] = {}

    def to_json(self) -> bytes:
        """Minified JSON, without empty lists, which glTF does not allow.

        Raises ValueError when it holds NaN or infinity.
        """
        return minified({name: value for name, value in self.json.items() if value != []})

    def primitive(self, mesh: int, index: int) -> gltf.Primitive:
        """Return a primitive by the indices of its mesh and in that."""
        return self.meshes[mesh]["primitives"][index]

    # --- bytes ---

    def bytes_of_buffer(self, index: int) -> memoryview:
        """Return the bytes of a buffer, read once. Raises MeshletError."""
        buffer = item(self.buffers, index, "buffer")
        if index not in self._buffers_read:
            uri, length = buffer.get("uri"), buffer.get("byteLength")
            binary = self._binary if index == 0 else None
            data = binary if uri is None else memoryview(self._buffer_of(uri))
            if data is None:
                raise MeshletError(f"buffer {index} has neither a uri nor a binary chunk", DAMAGED)
            if length is None or not 0 <= length <= len(data):
                raise MeshletError(
                    f"buffer {index} has {len(data)} bytes instead of {length}",
                    "the file is damaged or cut off; get it again",
                )
            self._buffers_read[index] = data[:length]
        return self._buffers_read[index]

    def bytes_of_view(self, index: Any) -> memoryview:
        """Return the bytes of a buffer view. Raises MeshletError."""
        view = item(self.bufferViews, index, "bufferView")
        if index in self.new_bytes:
            return self.new_bytes[index].data
        if any(name.endswith("meshopt_compression") for name in view.get("extensions", ())):
            raise MeshletError("is compressed with meshopt", MESHOPT_REMEDY)
        return self.bytes_at(view, f"bufferView {index}")

    def bytes_at(self, view: gltf.BufferView, where: str) -> memoryview:
        """Return the bytes of a buffer that `view` says. Raises MeshletError with `where`."""
        if "buffer" not in view:
            raise MeshletError(f"{where} names no buffer", DAMAGED)
        buffer = self.bytes_of_buffer(view["buffer"])
        start, length = gltf.byte_offset(view), view.get("byteLength")
        if length is None or start < 0 or length < 0 or start + length > len(buffer):
            raise MeshletError(f"{where} reaches beyond buffer {view['buffer']}", DAMAGED)
        return buffer[start : start + length]

    def add_view(
        self,
        data: bytes | memoryview,
        *,
        fallback: bool = False,
        properties: gltf.BufferView | None = None,
    ) -> int:
        """Append a buffer view with bytes of its own; returns its index."""
        index = len(self.bufferViews)
        view: gltf.BufferView = {"buffer": 0, "byteOffset": 0, "byteLength": len(data)}
        self.bufferViews.append({**view, **(properties or {})})
        self.new_bytes[index] = NewBytes(memoryview(data), fallback)
        return index

    def arrange_views(self, order: Sequence[int]) -> None:
        """Keep these buffer views, in this order. Call `map_views` for the references."""
        self.bufferViews[:] = [self.bufferViews[old] for old in order]
        self.new_bytes = {
            new: self.new_bytes[old] for new, old in enumerate(order) if old in self.new_bytes
        }

    # --- files ---

    def read_uri(self, uri: str) -> bytes:
        """Return the bytes of a data: uri or of a relative path. Raises MeshletError."""
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
            data = read_file(path)
        except (OSError, ValueError):
            raise MeshletError(
                f"refers to {uri}, which cannot be read", "put the file beside it"
            ) from None
        if is_pointer(data):
            raise MeshletError(f"refers to {uri}, which is {PROBLEM}", REMEDY)
        return data

    def path_of(self, uri: str) -> Path:
        """Return the file behind a relative uri. Raises ValueError when there can be none."""
        return _path_of(uri, self.base)

    def files(self) -> list[Path]:
        """Return the files that buffers and images refer to, and those that an import has read."""
        return [*self.import_files, *files_of([*self.buffers, *self.images], self.base)]

    # --- extensions ---

    def use_extension(self, name: str, required: bool) -> None:
        """Add the name to extensionsUsed and, if required, to extensionsRequired."""
        for names in [self.extensionsUsed] + [self.extensionsRequired] * required:
            if name not in names:
                names.append(name)

    def forget_extension(self, name: str) -> None:
        """Remove the name from extensionsUsed and extensionsRequired."""
        for names in (self.extensionsUsed, self.extensionsRequired):
            if name in names:
                names.remove(name)


def files_of(holders: Iterable[Mapping[str, Any]], base: Path) -> list[Path]:
    """Return the files that buffers or images refer to; base: the folder of relative uris."""
    files = []
    for holder in holders:
        uri = holder.get("uri")
        if isinstance(uri, str) and uri and not uri.startswith("data:"):
            with suppress(ValueError):  # no path at all, so nothing reads it
                files.append(_path_of(uri, base))
    return files


def _path_of(uri: str, base: Path) -> Path:
    path = path_beside(base, file_name(unquote_to_bytes(uri)))
    if path is None:
        raise ValueError
    return path


def _require_version_2(properties: Any) -> None:
    """Raise MeshletError for another version of glTF. Lists of glTF 1.0 are objects by name."""
    is_first = any(member(properties, name) for name in ("accessors", "bufferViews", "meshes"))
    default = "1.0" if is_first else gltf.VERSION
    version = member(properties, "asset").get("version")
    version = default if version is None else str(version)
    if version.split(".")[0] != "2":
        raise MeshletError(f"is glTF {version or 'of no version'}, not glTF 2.0", CONVERT)


def read_file(path: Path) -> bytes | memoryview:
    """Return the bytes of a file; a large one is mapped into memory. Raises OSError."""
    with open(path, "rb") as file:
        if os.fstat(file.fileno()).st_size <= MOST_READ:
            return file.read()
        return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))


def item(items: Sequence[T], index: Any, kind: str) -> T:
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

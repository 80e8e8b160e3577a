"""EXT_meshlet_transport: buffer views that are packed for download."""

from __future__ import annotations

import dataclasses

import numpy as np

from gltf_ext import _codec
from gltf_ext.document import gltf
from gltf_ext.document.document import DAMAGED, Document, NewBytes, item
from gltf_ext.errors import MeshletError

TRANSPORT = "EXT_meshlet_transport"
VERSION = 1  # the first byte of a packed view; that of a blob is the letter E


def is_packed(view: bytes) -> bool:
    """Return whether a view is packed, for readers that do not see the view's extensions."""
    return view[:1] == bytes([VERSION])


def unpack(view: bytes) -> bytes:
    """Return the unpacked bytes of a view, not validated yet. Raises ValueError."""
    resident = _codec.unpack(view)
    if [length for _, length in _codec.split(resident)] != _page_lengths(view):
        raise ValueError("the pages of the packed view are not its blobs")
    return resident


def unpack_views(document: Document) -> bool:
    """Replace packed views of a file by their unpacked bytes, and remove the extension.

    Returns whether there were any. Raises MeshletError.
    """
    packed = [
        i for i, view in enumerate(document.bufferViews) if gltf.has_extension(view, TRANSPORT)
    ]
    document.packed_views = frozenset(packed)
    for field in ("extensionsUsed", "extensionsRequired"):
        if packed and TRANSPORT not in getattr(document, field):
            document.packing_faults.append(f"{field} lacks {TRANSPORT}")
    for index in packed:
        view = document.bufferViews[index]
        extension = gltf.pop_extension(view, TRANSPORT)
        data = bytes(document.bytes_of_view(index))
        try:
            size = _codec.unpacked_bytes(data)
            if not isinstance(extension, dict) or extension.get("byteLength") != size:
                raise ValueError(f"its {TRANSPORT} object does not say that it has {size} bytes")
            resident = unpack(data)
        except ValueError as error:
            raise MeshletError(f"bufferView {index}: {error}", DAMAGED) from None
        document.new_bytes[index] = NewBytes(memoryview(resident), False)
        view["byteLength"] = size
    document.forget_extension(TRANSPORT)
    return bool(packed)


def _page_lengths(packed: bytes) -> list[int]:
    """Return the resident bytes of each page of a packed view that has been unpacked."""
    count = int.from_bytes(packed[:4], "little") >> 8
    lengths: list[int] = np.frombuffer(packed, "<u4", 2 * count, 4)[::2].tolist()
    return lengths


def pack_views(document: Document, views: set[int], threads: int = 0) -> None:
    """Let views of blobs be written packed where that is shorter.

    Raises MeshletError, ValueError for malformed blobs.
    """
    for index in sorted(views):
        resident = document.bytes_of_view(index)
        packed = _codec.pack(bytes(resident), threads)
        if len(packed) >= len(resident):
            continue
        view = item(document.bufferViews, index, "bufferView")
        new = document.new_bytes.get(index, NewBytes(resident, False))
        document.new_bytes[index] = dataclasses.replace(new, packed=packed)
        view["byteLength"] = len(packed)
        gltf.set_extension(view, TRANSPORT, {"byteLength": len(resident)})
        document.use_extension(TRANSPORT, required=True)

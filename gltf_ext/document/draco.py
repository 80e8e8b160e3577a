"""Reads primitives compressed with KHR_draco_mesh_compression, with the optional DracoPy."""

from __future__ import annotations

import io
import struct
from typing import Any

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.accessors import accessor_format
from gltf_ext.document.document import Document, item
from gltf_ext.errors import EXPORT_AGAIN, MeshletError

DRACO = "KHR_draco_mesh_compression"
VERSION = (2, 2)  # of the bitstream, the only one in glTF
EDGEBREAKER = 1
HAS_METADATA = 0x8000
# DracoPy allocates memory for all triangles that the header claims. More than LEAST_FACES and
# FACES_PER_BYTE for each byte are refused. Real meshes take about one byte for a triangle.
LEAST_FACES, FACES_PER_BYTE = 2**20, 4


def decode_draco(
    document: Document, primitive: gltf.Primitive, where: str
) -> dict[str, np.ndarray]:
    """Attribute name -> [V, components] in the accessor's type, and "indices" -> uint32[3 T].

    where: the primitive's place, for errors. Raises MeshletError.
    """
    extension = primitive["extensions"][DRACO]
    arrays, faces = _decode(document, extension, where)
    ids = extension["attributes"]
    result: dict[str, np.ndarray] = {}
    for name, accessor in primitive["attributes"].items():
        if name not in ids:
            continue
        accessor_name = f"the accessor of {name} of {where},"
        format_ = accessor_format(item(document.accessors, accessor, accessor_name), name)
        dtype, components = format_
        values = next((array for unique_id, array in arrays if unique_id == ids[name]), None)
        if values is None or values.ndim != 2 or values.shape[1] != components:
            raise MeshletError(
                f"Draco data of {where} has no {name} of {components} components", EXPORT_AGAIN
            )
        result[name] = np.ascontiguousarray(values, dtype)
    vertex_counts = {len(values) for values in result.values()}
    if (
        len(vertex_counts) != 1
        or faces.ndim != 2
        or faces.shape[1] != 3
        or (faces.size and not 0 <= faces.min() <= faces.max() < min(vertex_counts))
    ):
        raise MeshletError(f"Draco data of {where} is inconsistent", EXPORT_AGAIN)
    result["indices"] = faces.astype(np.uint32).ravel()
    return result


def _decode(
    document: Document, extension: Any, where: str
) -> tuple[list[tuple[int, np.ndarray]], np.ndarray]:
    """Return ([(unique id, values) of each attribute], faces) as DracoPy gives them."""
    try:
        import DracoPy
    except ImportError:
        raise MeshletError(
            f"{where} is compressed with Draco", "install DracoPy to read it: pip install DracoPy"
        ) from None
    if not isinstance(extension, dict) or not isinstance(extension.get("attributes"), dict):
        raise MeshletError(f"{where} has a malformed {DRACO} object", EXPORT_AGAIN)
    data = bytes(document.bytes_of_view(extension.get("bufferView")))
    try:
        if _claimed_faces(data) > LEAST_FACES + FACES_PER_BYTE * len(data):
            raise MeshletError(
                f"Draco data of {where} claims more triangles than it holds", EXPORT_AGAIN
            )
        mesh = DracoPy.decode(data)
        arrays = [(a["unique_id"], np.asarray(a["data"])) for a in mesh.attributes]
        return arrays, np.asarray(mesh.faces)
    except MeshletError:
        raise
    except Exception:  # DracoPy raises any exception of its C++ library
        raise MeshletError(f"Draco data of {where} cannot be decoded", EXPORT_AGAIN) from None


def _claimed_faces(data: bytes) -> int:
    """Return the number of triangles in the header. Raises an exception if the data ends before it.

    Bitstream 2.2: https://google.github.io/draco/spec/, sections 4 (metadata), 5.
    """
    stream = io.BytesIO(data)
    magic, *version, _, method, flags = struct.unpack("<5sBBBBH", stream.read(11))
    if magic != b"DRACO" or tuple(version) != VERSION:
        raise ValueError
    if flags & HAS_METADATA:
        for _ in range(_varint(stream)):  # of attributes, each with its id
            _varint(stream)
            _skip_metadata(stream)
        _skip_metadata(stream)
    if method == EDGEBREAKER:
        stream.read(1)  # kind of traversal
        _varint(stream)  # vertices
    return _varint(stream)


def _skip_metadata(stream: io.BytesIO) -> None:
    for _ in range(_varint(stream)):
        stream.read(stream.read(1)[0])  # name
        stream.read(_varint(stream))  # value
    for _ in range(_varint(stream)):
        stream.read(stream.read(1)[0])
        _skip_metadata(stream)


def _varint(stream: io.BytesIO) -> int:
    """Seven bits for a byte, the lowest first."""
    value = shift = 0
    while True:
        byte = stream.read(1)[0]
        value, shift = value | (byte & 127) << shift, shift + 7
        if byte < 128:
            return value

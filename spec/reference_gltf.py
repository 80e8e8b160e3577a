"""Reference validator of the extension object of EXT_meshlet_edgebreaker, in plain Python.

Written from the sections "Exclusions" and "glTF Schema Updates" of spec/EXT_meshlet_edgebreaker.md
alone; read it beside that text. It checks `gltf_ext.validate` and shares no code with it.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from spec import reference_decoder
from spec.reference_decoder import GRID, Blob

EXTENSION = "EXT_meshlet_edgebreaker"
DRACO = "KHR_draco_mesh_compression"
TRIANGLES = 4
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
TYPES = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
FLOAT = 5126
NO_PLACE = "The table of equal vertices names a place that is not there."

Json = dict[str, Any]


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


def read_document(data: bytes) -> tuple[Json, bytes]:
    """(the JSON document, the binary chunk) of a .glb."""
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def check_file(data: bytes) -> None:
    """Raises ValueError with one sentence if a .glb is malformed."""
    document, buffer = read_document(data)
    users = [
        primitive
        for mesh in document["meshes"]
        for primitive in mesh["primitives"]
        if EXTENSION in primitive.get("extensions", {})
    ]
    _require(EXTENSION in document["extensionsUsed"], "extensionsUsed lacks the extension.")
    views: dict[int, int] = {}  # accessor -> view of the primitive that uses it
    for primitive in users:
        check_primitive(document, buffer, primitive)
        view = primitive["extensions"][EXTENSION]["bufferView"]
        for accessor in _accessors(primitive):
            same = views.setdefault(accessor, view) == view
            _require(same, "Primitives with different views share an accessor.")


def _accessors(primitive: Json) -> list[int]:
    groups = [primitive["attributes"], *primitive.get("targets", [])]
    return [primitive["indices"], *(number for group in groups for number in group.values())]


def check_primitive(document: Json, buffer: bytes, primitive: Json) -> None:
    extension = primitive["extensions"][EXTENSION]
    _require(DRACO not in primitive["extensions"], "The primitive is compressed with Draco, too.")
    _require(primitive.get("mode", TRIANGLES) == TRIANGLES, "The primitive's mode is not 4.")
    _require("indices" in primitive, "The primitive has no indices.")
    decoded = reference_decoder.decode_view(_bytes_of_view(document, buffer, extension))
    groups = [(primitive["attributes"], extension["attributes"])]
    targets = primitive.get("targets", []), extension.get("targets", [])
    _require(len(targets[0]) == len(targets[1]), "The numbers of targets differ.")
    groups += zip(*targets)
    for accessors, streams in groups:
        _require(accessors.keys() == streams.keys(), "The names of attributes differ.")
    _require(extension["attributes"].get("POSITION") == 0, "POSITION is not stream 0.")
    _check_streams(document, decoded, groups)
    _check_accessors(document, buffer, primitive, decoded, groups)
    if "equalVertices" in extension:
        table = _bytes_of_view(document, buffer, extension["equalVertices"])
        read_equal_vertices(table, decoded)


def read_equal_vertices(table: bytes, decoded: Blob) -> list[tuple[int, int]]:
    """For each corner of the decoded triangles its place, and its vertex there.

    Raises ValueError if the table is malformed.
    """
    places = places_of(decoded)
    corners: dict[int, list[int]] = {}
    for corner, at in enumerate(places):
        corners.setdefault(at, []).append(corner)
    vertices = [0] * len(places)
    bits = _Bits(table)
    count, parameter = bits.take(32), bits.take(8)
    _require(parameter <= 31, "The parameter of the table of equal vertices is above 31.")
    _require(count <= len(corners), NO_PLACE)
    quotients = [bits.zeros() for _ in range(count)]
    gaps = [(quotient << parameter) + bits.take(parameter) for quotient in quotients]
    copies = [2 + bits.zeros() for _ in range(count)]
    place = -1
    for gap, vertex_count in zip(gaps, copies):
        place += 1 + gap
        _require(place in corners, NO_PLACE)
        _require(vertex_count <= len(corners[place]), "A place has more vertices than corners.")
        for corner in corners[place][1:]:
            vertices[corner] = bits.take((vertex_count - 1).bit_length())
            _require(vertices[corner] < vertex_count, "A corner has a vertex that is not there.")
    return list(zip(places, vertices))


def places_of(decoded: Blob) -> list[int]:
    """The place of each corner of the decoded triangles."""
    numbers: dict[tuple[Any, ...], int] = {}
    of_vertices = [
        numbers.setdefault(tuple(map(tuple, row)), len(numbers)) for row in zip(*decoded.values)
    ]
    return [of_vertices[vertex] for vertex in decoded.triangles.reshape(-1).tolist()]


class _Bits:
    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    def take(self, count: int) -> int:
        end = self._at + count
        _require(end <= 8 * len(self._data), "A field reaches beyond the table of equal vertices.")
        first = self._at >> 3
        word = int.from_bytes(self._data[first : -(-end // 8)], "little")
        value = word >> (self._at & 7) & ((1 << count) - 1)
        self._at = end
        return value

    def zeros(self) -> int:
        count = 0
        while self.take(1) == 0:
            count += 1
        return count


def _bytes_of_view(document: Json, buffer: bytes, extension: Json) -> bytes:
    number = extension["bufferView"]
    _require(number < len(document["bufferViews"]), "The buffer view does not exist.")
    view = document["bufferViews"][number]
    extensions = view.get("extensions", {})
    _require(
        not any(name.endswith("_meshopt_compression") for name in extensions),
        "The buffer view is compressed with meshopt.",
    )
    offset = view.get("byteOffset", 0)
    _require(offset % 4 == 0, "The buffer view does not start at a multiple of 4.")
    _require("byteStride" not in view, "The buffer view has a byteStride.")
    _require("target" not in view, "The buffer view has a target.")
    used = [accessor.get("bufferView") for accessor in document["accessors"]]
    _require(number not in used, "An accessor refers to the buffer view.")
    return buffer[offset : offset + view["byteLength"]]


def _check_streams(document: Json, decoded: Blob, groups: list[tuple[Json, Json]]) -> None:
    """Each stream belongs to one attribute, and fits it."""
    first = decoded.streams[0]
    _require((first.kind, first.elements) == (GRID, 3), "Stream 0 is not GRID with 3 elements.")
    used: list[int] = []
    for accessors, streams in groups:
        for name, stream in streams.items():
            accessor = document["accessors"][accessors[name]]
            values = reference_decoder.accessor_components(
                decoded, stream, accessor["componentType"], WIDTHS[accessor["type"]]
            )
            if accessor["componentType"] != FLOAT:
                limits = np.iinfo(TYPES[accessor["componentType"]])
                in_range = limits.min <= values.min() and values.max() <= limits.max
                _require(bool(in_range), "A value is outside of the range of its component type.")
            filled = 0
            while filled < WIDTHS[accessor["type"]]:
                filled += reference_decoder.width_of(decoded.streams[stream])
                used.append(stream)
                stream += 1
    everything = list(range(len(decoded.streams)))
    _require(sorted(used) == everything, "A stream does not belong to exactly one attribute.")


def _check_accessors(
    document: Json,
    buffer: bytes,
    primitive: Json,
    decoded: Blob,
    groups: list[tuple[Json, Json]],
) -> None:
    vertices = len(decoded.values[0])
    indices = document["accessors"][primitive["indices"]]
    _require(
        indices["count"] == decoded.triangles.size, "The accessor of indices has another count."
    )
    largest = int(np.iinfo(TYPES[indices["componentType"]]).max)
    _require(vertices - 1 < largest, "The component type of indices cannot hold every index.")
    bare = False
    for accessors, streams in groups:
        for name, number in accessors.items():
            accessor = document["accessors"][number]
            _require(
                accessor["count"] == vertices, "An accessor of an attribute has another count."
            )
            bare |= "bufferView" not in accessor
            if "bufferView" not in accessor:
                _require("sparse" not in accessor, "An accessor without a fallback is sparse.")
                continue
            components = reference_decoder.accessor_components(
                decoded, streams[name], accessor["componentType"], WIDTHS[accessor["type"]]
            )
            stored = _read_accessor(document, buffer, accessor)
            _require(np.array_equal(stored, components), "The fallback is not the decoded data.")
    required = EXTENSION in document.get("extensionsRequired", [])
    _require(required or not bare, "extensionsRequired lacks the extension.")
    accessor = document["accessors"][primitive["attributes"]["POSITION"]]
    positions = reference_decoder.accessor_components(decoded, 0, accessor["componentType"], 3)
    # As the component type: JSON may have the shortest text that gives the same float.
    rounded = np.float32 if accessor["componentType"] == FLOAT else np.float64
    stated = np.array([accessor["min"], accessor["max"]], rounded)
    bounds = positions.min(axis=0), positions.max(axis=0)
    _require(np.array_equal(stated, bounds), "min and max are not those of the positions.")


def _read_accessor(document: Json, buffer: bytes, accessor: Json) -> np.ndarray:
    """The components of a tightly packed accessor."""
    view = document["bufferViews"][accessor["bufferView"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    width = WIDTHS[accessor["type"]]
    dtype = TYPES[accessor["componentType"]]
    values = np.frombuffer(buffer, dtype, accessor["count"] * width, start)
    return values.reshape(-1, width)

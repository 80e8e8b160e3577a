"""Reads .ply files, binary and text, in blocks."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, Literal, NamedTuple

import numpy as np

from gltf_ext import _codec
from gltf_ext.document.container import EXPORT_AGAIN
from gltf_ext.errors import MeshletError
from gltf_ext.ranges import numbers_of
from gltf_ext.sources.mesh_files import (
    CUT_OFF,
    CornerNumbers,
    Group,
    Material,
    Mesh,
    MeshFile,
    at_corners,
    block_bytes,
    color_bytes,
    fans,
    read_rows,
    read_texture,
    text_blocks,
    to_floats,
    to_texcoords,
)
from gltf_ext.sources.row_arrays import NewRows, RowArray, add_all

MAX_HEADER_LINES = 10_000
MAX_LINE = 10_000  # bytes
TYPES = {
    **{name: f"i{size}" for name, size in (("char", 1), ("short", 2), ("int", 4))},
    **{name: f"u{size}" for name, size in (("uchar", 1), ("ushort", 2), ("uint", 4))},
    **{f"int{8 * size}": f"i{size}" for size in (1, 2, 4, 8)},
    **{f"uint{8 * size}": f"u{size}" for size in (1, 2, 4, 8)},
    **{f"float{8 * size}": f"f{size}" for size in (2, 4, 8)},
    "float": "f4",
    "double": "f8",
}
ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
INDICES = ("vertex_indices", "vertex_index")
POSITION, NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")
COLOR = ("red", "green", "blue", "alpha")
TEXCOORDS = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))
CORNER_TEXCOORDS = "texcoord"


class Property(NamedTuple):
    """A value of each row, or a list of them.

    Attributes:
        length: the type of a list's length; None for a single value.
    """

    name: str
    dtype: np.dtype
    length: np.dtype | None


class Element(NamedTuple):
    """Rows with the same properties."""

    name: str
    rows: int
    properties: list[Property]

    def type_of(self, name: str) -> np.dtype:
        """Return the type of the property with this name, which is there."""
        return next(p.dtype for p in self.properties if p.name == name)


class Header(NamedTuple):
    """What a file says of its rows.

    Attributes:
        order: of bytes, as numpy has it; "=" for text.
        texture: the name of a texture file, if a comment gives one.
    """

    order: str
    elements: list[Element]
    texture: str


class Lists(NamedTuple):
    """A property's lists, one after the other: lengths int64[n], and all their values."""

    lengths: np.ndarray
    values: np.ndarray


Columns = dict[str, "np.ndarray | Lists"]


def read_header(file: BinaryIO) -> Header:
    """Read up to the first element. Raises MeshletError."""
    if file.readline(MAX_LINE).strip().lower() != b"ply":
        raise MeshletError("is not a .ply", EXPORT_AGAIN)
    order, texture = "", ""
    elements: list[Element] = []
    for _ in range(MAX_HEADER_LINES):
        line = file.readline(MAX_LINE).decode(errors="replace")
        match line.split():
            case [] if not line:
                break
            case ["end_header"] if order:
                return Header(order, elements, texture)
            case ["format", name, *_] if name in ORDERS:
                order = ORDERS[name]
            case ["element", name, count] if count.isdecimal():
                elements.append(Element(name, int(count), []))
            case ["property", type, name] if elements and type in TYPES:
                elements[-1].properties.append(Property(name, np.dtype(order + TYPES[type]), None))
            case ["property", "list", length, type, name] if (
                elements and type in TYPES and TYPES.get(length, "f")[0] != "f"
            ):
                types = np.dtype(order + TYPES[type]), np.dtype(order + TYPES[length])
                elements[-1].properties.append(Property(name, *types))
            case ["comment", word, *_] if word.lower() == "texturefile":
                texture = line.split(None, 2)[-1].strip()
            case ["comment" | "obj_info", *_]:
                pass
            case _:
                raise MeshletError(f"has a header line that is no .ply's ({line})", EXPORT_AGAIN)
    raise MeshletError("has a header that does not end", EXPORT_AGAIN)


def blocks(file: BinaryIO, header: Header) -> Iterator[tuple[Element, Columns]]:
    """Yield the elements' rows after the header, a block at a time, in the order of the file.

    Raises MeshletError, OSError.
    """
    elements = [e for e in header.elements if e.rows and e.properties]
    if header.order == "=":
        yield from _text(text_blocks(file), elements)
    else:
        for element in elements:
            for columns in _binary(file, element):
                yield element, columns


def read(path: Path, new_rows: NewRows) -> MeshFile:
    """Read the mesh, if it has triangles. Raises MeshletError, OSError.

    A vertex's own values go before those that faces have at their corners.
    """
    vertices: dict[str, RowArray] = defaultdict(new_rows)
    faces: dict[str, RowArray] = defaultdict(new_rows)
    triangles = CornerNumbers(new_rows())
    with open(path, "rb") as file:
        header = read_header(file)
        for element, columns in blocks(file, header):
            if element.name == "vertex":
                add_all(vertices, vertex_attributes(element, columns))
            elif element.name == "face":
                parts = face_corners(element, columns)
                if "triangles" in parts:
                    triangles.add(parts.pop("triangles"))
                add_all(faces, parts)
    if "POSITION" not in vertices:
        return MeshFile([])
    triangles.check(vertices["POSITION"].count, "vertex")
    if not triangles.rows.count:
        return MeshFile([])
    faces = {name: rows for name, rows in faces.items() if name not in vertices}
    _check_counts(vertices, vertices["POSITION"].count)
    _check_counts(faces, triangles.rows.count)
    groups: list[Group] = [(tuple(vertices), triangles.rows), *(((name,), None) for name in faces)]
    mesh = Mesh(path.name, {**vertices, **faces}, groups)
    contents = MeshFile([mesh])
    if header.texture:
        image = read_texture(path.parent, header.texture, contents)
        mesh.material = Material({}, image) if image else None
    return contents


def _check_counts(attributes: dict[str, RowArray], count: int) -> None:
    """Raise MeshletError for attributes that only some elements of the same name have."""
    for name, rows in attributes.items():
        if rows.count != count:
            raise MeshletError(
                f"has {rows.count} values of {name} instead of {count}", EXPORT_AGAIN
            )


def vertex_attributes(element: Element, columns: Columns) -> dict[str, np.ndarray]:
    """Return the attributes of a block of vertices, as in Mesh."""
    values = {name: c for name, c in columns.items() if not isinstance(c, Lists)}

    def stacked(names: Sequence[str]) -> np.ndarray:
        return np.stack([values[name] for name in names], axis=1)

    attributes = {
        kind: to_floats(stacked(names))
        for kind, names in (("POSITION", POSITION), ("NORMAL", NORMAL))
        if values.keys() >= set(names)
    }
    if values.keys() >= set(COLOR[:3]):
        colors = stacked([name for name in COLOR if name in values])
        attributes["COLOR_0"] = color_bytes(colors, element.type_of(COLOR[0]))
    texcoords = next((names for names in TEXCOORDS if values.keys() >= set(names)), None)
    if texcoords:
        attributes["TEXCOORD_0"] = to_texcoords(stacked(texcoords))
    return attributes


def face_corners(element: Element, columns: Columns) -> dict[str, np.ndarray]:
    """Return the triangles of a block of faces.

    "triangles": int32[T, 3]; if faces have them, "TEXCOORD_0": float32[3 T, 2] and "COLOR_0":
    uint8[3 T, 4], at corners.
    """
    name = next((name for name in INDICES if name in columns), None)
    polygons = columns[name] if name else None
    if not isinstance(polygons, Lists):
        return {}
    corners, counts = fans(polygons.lengths)
    numbers = polygons.values
    if not np.can_cast(numbers.dtype, np.int32):
        with np.errstate(invalid="ignore"):  # a text may say nan; no number beyond int32 is valid
            numbers = np.clip(numbers, -1, np.iinfo(np.int32).max)
    result = {"triangles": at_corners(numbers.astype(np.int32, copy=False), corners)}
    texcoords = columns.get(CORNER_TEXCOORDS)
    if isinstance(texcoords, Lists):
        if (texcoords.lengths != 2 * polygons.lengths).any():
            raise MeshletError("has faces with missing texture coordinates", EXPORT_AGAIN)
        uv = at_corners(texcoords.values.reshape(-1, 2), corners)
        result["TEXCOORD_0"] = to_texcoords(uv.reshape(-1, 2))
    colors = [columns[name] for name in COLOR if name in columns]
    if len(colors) >= 3 and not any(isinstance(c, Lists) for c in colors):
        of_faces = color_bytes(np.stack(colors, axis=1), element.type_of(COLOR[0]))
        result["COLOR_0"] = np.repeat(of_faces, 3 * counts, axis=0)
    return result


# --- text ---


def _text(texts: Iterator[bytes], elements: Sequence[Element]) -> Iterator[tuple[Element, Columns]]:
    queue = list(elements)
    left = queue[0].rows if queue else 0
    for text in texts:
        ((numbers, counts, _),) = _codec.scan_lines(text, {"": "numbers"})
        ends = np.cumsum(counts, dtype=np.int64)
        at = 0
        while queue and at < len(counts):
            rows = slice(at, at + min(left, len(counts) - at))
            starts = ends[rows] - counts[rows]
            yield queue[0], _columns_of_text(numbers, starts, ends[rows], queue[0])
            left -= len(starts)
            at = rows.stop
            if not left:
                del queue[0]
                left = queue[0].rows if queue else 0
    if queue:
        raise MeshletError(CUT_OFF, "get it again")


def _columns_of_text(
    numbers: np.ndarray, starts: np.ndarray, ends: np.ndarray, element: Element
) -> Columns:
    """Return the properties of rows: numbers[starts[i]:ends[i]] is row i."""
    columns: Columns = {}
    at = starts
    for name, _, length in element.properties:
        if (at >= ends).any():
            raise MeshletError(f"has a row of {element.name} that is too short", EXPORT_AGAIN)
        if length is None:
            columns[name] = numbers[at]
            at = at + 1
            continue
        lengths = numbers[at].astype(np.int64)
        if (lengths < 0).any() or (at + 1 + lengths > ends).any():
            raise MeshletError(f"has a row of {element.name} that is too short", EXPORT_AGAIN)
        columns[name] = Lists(lengths, numbers[numbers_of(at + 1, lengths)])
        at = at + 1 + lengths
    return columns


# --- binary ---


def _binary(file: BinaryIO, element: Element) -> Iterator[Columns]:
    """Read whole blocks while all lists are as long as those of the first row."""
    lengths = _lengths_of_row(file, element)
    fields: list[tuple[str, np.dtype, tuple[int, ...]]] = []
    for (name, dtype, length), count in zip(element.properties, lengths):
        if length is not None:
            fields.append((f"{name} length", length, ()))
        fields.append((name, dtype, (count,) if length is not None else ()))
    row = np.dtype(fields)
    left = element.rows
    while left:
        start = file.tell()
        rows = read_rows(file, row, left)
        same = np.ones(len(rows), bool)
        for (name, _, length), count in zip(element.properties, lengths):
            if length is not None:
                same &= rows[f"{name} length"] == count
        if not len(rows) or not same.all():
            file.seek(start)
            yield from _mixed(file, element, left)
            return
        left -= len(rows)
        yield {
            name: Lists(np.broadcast_to(np.int64(count), len(rows)), _values(rows, name))
            if length is not None
            else rows[name]
            for (name, _, length), count in zip(element.properties, lengths)
        }


def _values(rows: np.ndarray, name: str) -> np.ndarray:
    """Return the lists of a field, one after the other.

    Copies each as a whole: numpy takes 1.6 times as long for value by value.
    """
    lists = rows[name]
    size = lists.itemsize * lists.shape[1]
    if not size:
        return lists.reshape(-1)
    assert rows.dtype.fields
    whole: np.ndarray = rows.getfield(f"V{size}", rows.dtype.fields[name][1]).copy()
    return whole.view(lists.dtype)


def _lengths_of_row(file: BinaryIO, element: Element) -> list[int]:
    """Read the length of each list of the next row; 0 for a single value. Stays at the row."""
    start, lengths = file.tell(), []
    for _, dtype, length in element.properties:
        count = 0
        if length is not None:
            count = int.from_bytes(file.read(length.itemsize), _byte_order(length))
            if count * dtype.itemsize > os.fstat(file.fileno()).st_size:
                raise MeshletError(CUT_OFF, "get it again")
        lengths.append(count)
        file.seek(dtype.itemsize * (count if length is not None else 1), os.SEEK_CUR)
    file.seek(start)
    return lengths


def _mixed(file: BinaryIO, element: Element, left: int) -> Iterator[Columns]:
    """Walk row by row: 1 us each."""
    size = block_bytes(file)
    while left:
        start, data = file.tell(), file.read(size)
        places, end = _places(data, element, left)
        file.seek(start + end)
        if not len(places):
            if len(data) < size:
                raise MeshletError(CUT_OFF, "get it again")
            size *= 2  # for a row that is longer
            continue
        left -= len(places)
        array = np.frombuffer(data, np.uint8)
        columns: Columns = {}
        for (name, dtype, length), at, counts in zip(
            element.properties, *places.transpose(2, 1, 0)
        ):
            number = numbers_of(np.zeros_like(counts), counts)
            items = np.repeat(at, counts) + number * dtype.itemsize
            values = array[items[:, None] + np.arange(dtype.itemsize)].view(dtype)[:, 0]
            columns[name] = values if length is None else Lists(counts, values)
        yield columns


def _places(data: bytes, element: Element, limit: int) -> tuple[np.ndarray, int]:
    """Offset and number of values of each property of the whole rows in `data`, and their end.

    The first array is int64[rows, properties, 2].
    """
    layout = [
        (dtype.itemsize, length.itemsize if length else 0, _byte_order(length or dtype))
        for _, dtype, length in element.properties
    ]
    places: list[list[tuple[int, int]]] = []
    end = at = 0
    while len(places) < limit:
        row = []
        for size, length, order in layout:
            count = int.from_bytes(data[at : at + length], order) if length else 1
            at += length
            row.append((at, count))
            at += size * count
        if at > len(data):
            break
        places.append(row)
        end = at
    return np.array(places, np.int64).reshape(len(places), len(layout), 2), end


def _byte_order(dtype: np.dtype) -> Literal["little", "big"]:
    return "big" if dtype.str[0] == ">" else "little"

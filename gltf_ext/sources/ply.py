"""Reads .ply files, binary and text, in blocks."""

from __future__ import annotations

import os
import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, Literal, NamedTuple

import numpy as np

from gltf_ext import _codec
from gltf_ext.errors import EXPORT_AGAIN, MeshletError
from gltf_ext.progress import Advance
from gltf_ext.ranges import numbers_of
from gltf_ext.sources.colors import Colors
from gltf_ext.sources.limits import check_vertex_count
from gltf_ext.sources.mesh_files import (
    BASE_COLOR,
    Material,
    Mesh,
    MeshFile,
    MeshPrimitive,
    Texture,
    read_texture,
    to_floats,
    to_texcoords,
)
from gltf_ext.sources.offset import Offset, with_offset
from gltf_ext.sources.ply_header import (
    CORNER_TEXCOORDS,
    INDICES,
    STRIPS,
    Element,
    Header,
    read_header,
)
from gltf_ext.sources.ply_header import triangles_in_header as triangles_in_header
from gltf_ext.sources.polygons import CornerNumbers, Points, at_corners, triangles_of
from gltf_ext.sources.row_arrays import NewRows, Numbering, RowArray, Rows, add_all
from gltf_ext.sources.text import CUT_OFF, block_bytes, open_watched, read_rows, text_blocks

POSITION, NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")
COLORS = (
    ("red", "green", "blue", "alpha"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
    ("r", "g", "b", "a"),
    ("ambient_red", "ambient_green", "ambient_blue", "ambient_alpha"),
)
TEXCOORDS = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"), ("texture_s", "texture_t"))
# Attributes of the file's own: more would take most of the streams that a primitive may have.
MOST_SCALARS = 32
EXACT = 1 << 24  # float32 holds all integers up to this
TYPES_OF_SCALARS = ("i1", "u1", "i2", "u2")  # that glTF has, beside floats


class Lists(NamedTuple):
    """A property's lists, one after the other: lengths int64[n], and all their values."""

    lengths: np.ndarray
    values: np.ndarray


Columns = dict[str, "np.ndarray | Lists"]


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


def read(path: Path, new_rows: NewRows, advance: Advance | None = None) -> MeshFile:
    """Read the mesh, if it has triangles. Raises MeshletError, OSError.

    A vertex's own values go before those that faces have at their corners. advance: moves the
    progress bar.
    """

    def collect(offset: Offset) -> _Reader:
        with open_watched(path, advance) as file:
            header = read_header(file)
            check_vertex_count(header.rows_of("vertex"))
            reader = _Reader(header, new_rows, offset)
            for element, columns in blocks(file, header):
                reader.add(element, columns)
        return reader

    return with_offset(collect).result(path)


class _Reader:
    """Collects the rows of a file."""

    def __init__(self, header: Header, new_rows: NewRows, offset: Offset) -> None:
        """Start without rows. offset: of positions."""
        self.header = header
        self._vertices: dict[str, RowArray] = defaultdict(new_rows)
        self._faces: dict[str, RowArray] = defaultdict(new_rows)
        self._vertex_colors, self._face_colors = Colors(new_rows), Colors(new_rows)
        self._triangles = CornerNumbers(new_rows())
        self._points = Points(self._vertices["POSITION"])
        self._scalars = Scalars(header)
        self._offset = offset

    def add(self, element: Element, columns: Columns) -> None:
        """Add a block of rows. Raises MeshletError, OSError."""
        if element.name == "vertex":
            add_all(self._vertices, vertex_attributes(element, columns, self._offset))
            add_all(self._vertices, self._scalars.attributes(element, columns))
            colors = element.first_of(COLORS, 3)
            if colors:
                self._vertex_colors.add(_stacked(columns, colors), element.values[colors[0]])
        elif element.name == "face":
            self._add_faces(element, columns)
        elif element.name == STRIPS:
            lists = _lists_of(columns)
            if lists is not None:
                self._triangles.add(triangles_of_strips(lists))

    def _add_faces(self, element: Element, columns: Columns) -> None:
        polygons = _lists_of(columns)
        if polygons is None:
            return
        numbers = to_int32(polygons.values)
        corners, counts = triangles_of(polygons.lengths, lambda: self._points.at(numbers))
        self._triangles.add(at_corners(numbers, corners))
        texcoords = columns.get(CORNER_TEXCOORDS)
        if isinstance(texcoords, Lists):
            if (texcoords.lengths != 2 * polygons.lengths).any():
                raise MeshletError("has faces with missing texture coordinates", EXPORT_AGAIN)
            uv = at_corners(texcoords.values.reshape(-1, 2), corners)
            self._faces["TEXCOORD_0"].add(to_texcoords(uv.reshape(-1, 2)))
        colors = element.first_of(COLORS, 3)
        if colors:
            values = np.repeat(_stacked(columns, colors), 3 * counts, axis=0)
            self._face_colors.add(values, element.values[colors[0]])

    def result(self, path: Path) -> MeshFile:
        """Return the mesh, if there is one. Raises MeshletError, OSError."""
        vertices, faces, triangles = self._vertices, self._faces, self._triangles
        lines = [*self._points.warnings, *self._scalars.warnings()]
        contents = MeshFile([], lines, offset=self._offset.values, rounding=self._offset.rounding)
        count = vertices["POSITION"].count
        if not count:
            return contents
        triangles.check(count, "vertex", 0)
        if not triangles.rows.count:
            return contents
        for attributes, colors in ((vertices, self._vertex_colors), (faces, self._face_colors)):
            rows = colors.finish()
            if rows is not None:
                attributes["COLOR_0"] = rows
        faces = {name: rows for name, rows in faces.items() if name not in vertices}
        _check_counts(vertices, count)
        _check_counts(faces, triangles.rows.count)
        numberings: list[Numbering] = [(tuple(vertices), triangles.rows)]
        numberings += [((name,), None) for name in faces]
        all_rows: dict[str, Rows] = {**vertices, **faces}
        primitive = MeshPrimitive(all_rows, numberings)
        contents.meshes.append(Mesh(path.name, [primitive]))
        if self.header.texture:
            image = read_texture(path.parent, self.header.texture, contents)
            if image:
                primitive.material = Material({}, {BASE_COLOR: Texture(image)})
                if primitive.material.for_attributes(all_rows) is None:
                    contents.warnings.append(
                        "it has no texture coordinates, so its texture is left out"
                    )
        return contents


def _check_counts(attributes: dict[str, RowArray], count: int) -> None:
    """Raise MeshletError for attributes that only some elements of the same name have."""
    for name, rows in attributes.items():
        if rows.count != count:
            raise MeshletError(
                f"has {rows.count} values of {name} instead of {count}", EXPORT_AGAIN
            )


def _stacked(columns: Columns, names: Sequence[str]) -> np.ndarray:
    """[n, len(names)] of properties that are no lists."""
    return np.stack([columns[name] for name in names], axis=1)


def vertex_attributes(element: Element, columns: Columns, offset: Offset) -> dict[str, np.ndarray]:
    """Return positions, normals and texture coordinates of a block of vertices, as in glTF."""
    convert = {"POSITION": offset.to_local, "NORMAL": to_floats}
    attributes = {
        kind: convert[kind](_stacked(columns, names))
        for kind, names in (("POSITION", POSITION), ("NORMAL", NORMAL))
        if element.first_of([names], 3)
    }
    texcoords = element.first_of(TEXCOORDS, 2)
    if texcoords:
        attributes["TEXCOORD_0"] = to_texcoords(_stacked(columns, texcoords))
    return attributes


def _lists_of(columns: Columns) -> Lists | None:
    """Return the vertices of faces or strips, if the columns have them."""
    lists = next((columns[name] for name in INDICES if name in columns), None)
    return lists if isinstance(lists, Lists) else None


def to_int32(numbers: np.ndarray) -> np.ndarray:
    """Return int32: no number beyond it is one of a vertex (MAX_VERTICES); a text may say nan."""
    if not np.can_cast(numbers.dtype, np.int32):
        limits = np.iinfo(np.int32)
        least, most = numbers.min(initial=0), numbers.max(initial=0)
        if not (limits.min <= least and most <= limits.max):
            numbers = np.nan_to_num(numbers.astype(np.float64), nan=-1)
            numbers = np.clip(numbers, limits.min, limits.max)
    return numbers.astype(np.int32, copy=False)


def triangles_of_strips(lists: Lists) -> np.ndarray:
    """int32[T, 3]: the triangles of strips, which a list or a -1 ends, every other one turned.

    Those that only lead from one strip to another, with a vertex twice, are left out.
    """
    numbers = to_int32(lists.values)
    is_first = np.zeros(len(numbers) + 1, bool)
    is_first[np.cumsum(lists.lengths) - lists.lengths] = True
    is_first[1:] |= numbers < 0
    positions = np.arange(len(numbers))
    # A -1 stands by itself before the strip that it begins, so that no triangle spans it.
    begins = np.maximum.accumulate(np.where(is_first[:-1], positions, 0))
    third = np.flatnonzero((positions - begins >= 2) & (numbers >= 0))
    a, b, c = numbers[third - 2], numbers[third - 1], numbers[third]
    turned = (third - begins[third]) % 2 == 1
    triangles = np.stack([np.where(turned, b, a), np.where(turned, a, b), c], axis=1)
    different = (a != b) & (b != c) & (c != a)
    result: np.ndarray = triangles[different]
    return result


class Scalars:
    """Properties of vertices that glTF has no name for, as attributes: quality as _QUALITY."""

    def __init__(self, header: Header) -> None:
        """Choose names, and note what is left out."""
        self._names: dict[str, str] = {}  # of a property -> of the attribute
        self._left_out: list[str] = []
        self._rounded: set[str] = set()
        for element in header.elements:
            if element.name == "vertex":
                self._choose(element)
            elif element.rows:
                self._leave_out(element)

    def _choose(self, element: Element) -> None:
        read = {*POSITION, *element.first_of([NORMAL], 3)}
        read.update(element.first_of(COLORS, 3), element.first_of(TEXCOORDS, 2))
        for name, _, length in element.properties:
            attribute = "_" + re.sub(r"[^A-Z0-9_]", "_", name.upper())
            if name in read or name in self._names:
                continue
            is_free = attribute not in self._names.values()
            if length is None and is_free and len(self._names) < MOST_SCALARS:
                self._names[name] = attribute
            else:
                self._left_out.append(f"{name} of vertices")

    def _leave_out(self, element: Element) -> None:
        if element.name not in ("face", STRIPS):
            self._left_out.append(f"{element.rows} rows of {element.name}")
            return
        read = {*INDICES}
        if element.name == "face":
            read.update((CORNER_TEXCOORDS,), element.first_of(COLORS, 3))
        names = [p.name for p in element.properties if p.name not in read]
        self._left_out += [f"{name} of {element.name}" for name in names]

    def attributes(self, element: Element, columns: Columns) -> dict[str, np.ndarray]:
        """Return [n, 1] of each in a type that glTF has."""
        result = {}
        for name, dtype in element.values.items():
            if name not in self._names:
                continue
            values = columns[name]
            assert isinstance(values, np.ndarray)
            if dtype.str[1:] in TYPES_OF_SCALARS:
                values = values.astype(dtype.str[1:])
            else:
                if dtype.kind in "iu" and (np.abs(values.astype(np.float64)) > EXACT).any():
                    self._rounded.add(name)
                values = to_floats(values)
            result[self._names[name]] = values.reshape(-1, 1)
        return result

    def warnings(self) -> list[str]:
        """Return a line for what is left out, and for what is rounded."""
        lines = [f"left out: {', '.join(self._left_out)}"] if self._left_out else []
        rounded = ", ".join(sorted(self._rounded))
        return [*lines, f"rounded to floats: {rounded}"] if rounded else lines


# --- text ---


def _text(texts: Iterator[bytes], elements: Sequence[Element]) -> Iterator[tuple[Element, Columns]]:
    queue = list(elements)
    rows_left = queue[0].rows if queue else 0
    for text in texts:
        ((numbers, counts, _),) = _codec.scan_lines(text, {"": "numbers"})
        ends = np.cumsum(counts, dtype=np.int64)
        at = 0
        while queue and at < len(counts):
            rows = slice(at, at + min(rows_left, len(counts) - at))
            starts = ends[rows] - counts[rows]
            yield queue[0], _columns_of_text(numbers, starts, ends[rows], queue[0])
            rows_left -= len(starts)
            at = rows.stop
            if not rows_left:
                del queue[0]
                rows_left = queue[0].rows if queue else 0
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
        with np.errstate(invalid="ignore"):  # NaN and others become the smallest integer
            lengths = numbers[at].astype(np.int64)
        if (lengths < 0).any() or (lengths > ends - at - 1).any():
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
    rows_left = element.rows
    while rows_left:
        start = file.tell()
        rows = read_rows(file, row, rows_left)
        same = np.ones(len(rows), bool)
        for (name, _, length), count in zip(element.properties, lengths):
            if length is not None:
                same &= rows[f"{name} length"] == count
        if not len(rows) or not same.all():
            file.seek(start)
            yield from _mixed(file, element, rows_left)
            return
        rows_left -= len(rows)
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


def _mixed(file: BinaryIO, element: Element, rows_left: int) -> Iterator[Columns]:
    """Walk row by row: 1 us each."""
    size = block_bytes(file)
    while rows_left:
        start, data = file.tell(), file.read(size)
        offsets, end = _row_offsets(data, element, rows_left)
        file.seek(start + end)
        if not len(offsets):
            if len(data) < size:
                raise MeshletError(CUT_OFF, "get it again")
            size *= 2  # for a row that is longer
            continue
        rows_left -= len(offsets)
        array = np.frombuffer(data, np.uint8)
        columns: Columns = {}
        for (name, dtype, length), at, counts in zip(
            element.properties, *offsets.transpose(2, 1, 0)
        ):
            number = numbers_of(np.zeros_like(counts), counts)
            items = np.repeat(at, counts) + number * dtype.itemsize
            values = array[items[:, None] + np.arange(dtype.itemsize)].view(dtype)[:, 0]
            columns[name] = values if length is None else Lists(counts, values)
        yield columns


def _row_offsets(data: bytes, element: Element, limit: int) -> tuple[np.ndarray, int]:
    """Offset and number of values of each property of the whole rows in `data`, and their end.

    The first array is int64[rows, properties, 2].
    """
    layout = [
        (dtype.itemsize, length.itemsize if length else 0, _byte_order(length or dtype))
        for _, dtype, length in element.properties
    ]
    offsets: list[list[tuple[int, int]]] = []
    end = at = 0
    while len(offsets) < limit:
        row = []
        for size, length, order in layout:
            count = int.from_bytes(data[at : at + length], order) if length else 1
            at += length
            row.append((at, count))
            at += size * count
        if at > len(data):
            break
        offsets.append(row)
        end = at
    return np.array(offsets, np.int64).reshape(len(offsets), len(layout), 2), end


def _byte_order(dtype: np.dtype) -> Literal["little", "big"]:
    return "big" if dtype.str[0] == ">" else "little"

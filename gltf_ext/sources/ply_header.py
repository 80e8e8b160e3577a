"""The header of a .ply: its elements, and what their rows can be."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from gltf_ext.errors import EXPORT_AGAIN, MeshletError
from gltf_ext.sources.limits import check_triangle_count, check_vertex_count
from gltf_ext.sources.text import CUT_OFF

MAX_HEADER_LINES = 10_000
MAX_LINE = 10_000  # bytes
MAX_DIGITS = 18  # of a number of rows
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
STRIPS = "tristrips"  # an element; -1 ends a strip
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

    @property
    def values(self) -> dict[str, np.dtype]:
        """Name -> type of each property that is no list."""
        return {p.name: p.dtype for p in self.properties if p.length is None}

    @property
    def corner_bytes(self) -> int:
        """Bytes of each corner of its polygons in binary; 0 without them."""
        sizes = {p.name: p.dtype.itemsize for p in self.properties if p.length is not None}
        index = next((sizes[name] for name in INDICES if name in sizes), 0)
        return index and index + 2 * sizes.get(CORNER_TEXCOORDS, 0)

    def least_bytes(self, is_text: bool) -> int:
        """Return the fewest bytes that a row can have."""
        if is_text:  # a digit and a blank or the line's end
            return 2 * len(self.properties)
        return sum((p.length or p.dtype).itemsize for p in self.properties)

    def first_of(self, names: Sequence[Sequence[str]], count: int) -> tuple[str, ...]:
        """Return the first names of which the properties have at least the first `count`."""
        values = self.values
        for candidates in names:
            if all(name in values for name in candidates[:count]):
                return tuple(name for name in candidates if name in values)
        return ()


class Header(NamedTuple):
    """What a file says of its rows.

    Attributes:
        order: of bytes, as numpy has it; "=" for text.
        texture: the name of a texture file, if a comment gives one.
    """

    order: str
    elements: list[Element]
    texture: str

    def rows_of(self, name: str) -> int:
        """Return the number of rows of all elements of a name."""
        return sum(element.rows for element in self.elements if element.name == name)


def read_header(file: BinaryIO) -> Header:
    """Read up to the first element. Raises MeshletError."""
    if _first_line(file).strip().lower() != b"ply":
        raise MeshletError("is not a .ply", EXPORT_AGAIN)
    end = _line_end(file)
    order, texture = "", ""
    elements: list[Element] = []
    for _ in range(MAX_HEADER_LINES):
        line = _header_line(file, end).decode(errors="replace")
        match line.split():
            case [] if not line:
                break
            case ["end_header"] if order:
                return Header(order, elements, texture)
            case ["format", name, *_] if name in ORDERS:
                order = ORDERS[name]
            case ["element", name, count] if count.isdecimal() and len(count) <= MAX_DIGITS:
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


def _first_line(file: BinaryIO) -> bytes:
    """Read up to the end of the first line, which may be LF, CR LF or CR alone."""
    line = file.read(len(b"ply"))
    while (byte := file.read(1)) not in (b"", b"\n", b"\r") and len(line) < MAX_LINE:
        line += byte
    if byte:
        file.seek(-1, os.SEEK_CUR)
    return line


def _line_end(file: BinaryIO) -> bytes:
    """Read the end of a line, which is that of all lines of the header."""
    start = file.read(2)
    end = b"\r" if start[:1] == b"\r" and start != b"\r\n" else b"\n"
    if start not in (b"\r\n", b""):
        file.seek(1 - len(start), os.SEEK_CUR)
    return end


def _header_line(file: BinaryIO, end: bytes) -> bytes:
    """Read a line with its end, from where the data may begin with any byte."""
    line = file.readline(MAX_LINE)
    at = line.find(end) + 1
    if end == b"\r" and at:
        file.seek(at - len(line), os.SEEK_CUR)
        line = line[:at]
    return line


def triangles_in_header(path: Path) -> int:
    """Return the number of triangles, as far as the header tells: one for each face.

    Raises MeshletError, also for more rows than the file has bytes for, OSError.
    """
    with open(path, "rb") as file:
        header = read_header(file)
        check_vertex_count(header.rows_of("vertex"))
        count = header.rows_of("face")
        check_triangle_count(count)
        if _bytes_of_lists(file, header) < 0:
            raise MeshletError(CUT_OFF, "get it again")
        return count


def most_triangles(path: Path) -> int:
    """Return the most triangles that the polygons of a binary file can be; 0 for a text.

    Raises MeshletError, OSError.
    """
    with open(path, "rb") as file:
        header = read_header(file)
        if header.order == "=":
            return 0
        elements = [e for e in header.elements if e.name in ("face", STRIPS)]
        sizes = [element.corner_bytes for element in elements if element.corner_bytes]
        if not sizes:
            return 0
        rows = sum(element.rows for element in elements)
        return max(_bytes_of_lists(file, header) // min(sizes) - 2 * rows, 0)


def _bytes_of_lists(file: BinaryIO, header: Header) -> int:
    """Return the bytes after the header but those that all rows have; of a text, at most.

    Negative for a file that is cut off.
    """
    is_text = header.order == "="
    size = os.fstat(file.fileno()).st_size - file.tell()
    used = sum(element.rows * element.least_bytes(is_text) for element in header.elements)
    return size - used + is_text  # the last line may have no end

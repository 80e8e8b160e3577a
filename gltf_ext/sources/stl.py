"""Reads .stl files, binary and text, in blocks."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from gltf_ext import _codec
from gltf_ext.errors import EXPORT_AGAIN, MeshletError
from gltf_ext.progress import Advance
from gltf_ext.sources.colors import Colors
from gltf_ext.sources.mesh_files import Mesh, MeshFile, MeshPrimitive
from gltf_ext.sources.offset import Offset, with_offset
from gltf_ext.sources.row_arrays import NewRows, Rows
from gltf_ext.sources.text import (
    CUT_OFF,
    block_bytes,
    open_watched,
    read_rows,
    seek_after_mark,
    skip_mark,
    text_blocks,
    words_after,
)

HEADER = np.dtype([("text", "S80"), ("triangles", "<u4")])
KEYWORDS = {"vertex": "numbers", "solid": "any", "endsolid": "any"}
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
START_BYTES = 1 << 12  # that tell text from binary, and how its lines are broken
MOST_STATEMENT = 1 << 16  # bytes
# A statement that does not begin its line.
BROKEN = re.compile(rb"(?im)^[^\S\n]*(?:facet|outer|endloop|endfacet|vertex)\b[^\n]*\bvertex\b")
FREE_SOLID = re.compile(rb"(?im)^[^\S\n]*solid\b[^\n]*\bfacet[^\S\n]+normal\b")
UNFINISHED = re.compile(rb"(?im)^[^\S\n]*vertex(?:[^\S\n]+[^\s]+){0,2}[^\S\n]*\n")
STATEMENT = re.compile(
    rb"(?i)(?<![^ ])(?=(?:solid|facet|outer|vertex|endloop|endfacet|endsolid)(?: |$))"
)
# Colours of a facet have 5 bits each. VisCAM and SolidView: blue first, the last bit says that
# there is one. Magics: red first, the last bit says that it is the part's, which the header has.
LEVELS, HAS_COLOR = 31, 1 << 15
MAGICS = b"COLOR="
BYTES = np.dtype(np.uint8)


class Block(NamedTuple):
    """Facets in the order of the file.

    Attributes:
        number, name: of their solid.
        corners: [T, 3, 3], float32 or, of a text, float64; colors: uint8[T, 4], if any.
    """

    number: int
    name: str
    corners: np.ndarray
    colors: np.ndarray | None = None


def triangles_in_header(path: Path) -> int:
    """Return the number of triangles of a binary file; 0 for a text. Raises OSError."""
    with open(path, "rb") as file:
        start = file.read(START_BYTES)
    size = os.path.getsize(path)
    return max(size - HEADER.itemsize, 0) // TRIANGLE.itemsize if _is_binary(start, size) else 0


def read(path: Path, new_rows: NewRows, advance: Advance | None = None) -> MeshFile:
    """Read a mesh for each solid. Raises MeshletError, OSError. advance: moves the progress bar."""

    def collect(offset: Offset) -> MeshFile:
        contents = MeshFile([])
        meshes: dict[int, tuple[str, _Facets]] = {}
        for block in blocks(path, contents, advance):
            if block.number not in meshes:
                meshes[block.number] = block.name or path.name, _Facets(new_rows, offset)
            meshes[block.number][1].add(block)
        contents.meshes = [Mesh(name, [facets.primitive()]) for name, facets in meshes.values()]
        contents.offset, contents.rounding = offset.values, offset.rounding
        return contents

    return with_offset(collect)


class _Facets:
    """The facets of a solid."""

    def __init__(self, new_rows: NewRows, offset: Offset) -> None:
        self._positions, self._colors = new_rows(), Colors(new_rows)
        self._offset = offset

    def add(self, block: Block) -> None:
        self._positions.add(self._offset.to_local(block.corners.reshape(-1, 3)))
        if block.colors is None:
            self._colors.skip(3 * len(block.corners))
        else:
            self._colors.add(np.repeat(block.colors, 3, axis=0), BYTES)

    def primitive(self) -> MeshPrimitive:
        positions, colors = self._positions, self._colors.finish()
        if colors is None:
            return MeshPrimitive({"POSITION": positions}, [(("POSITION",), None)])
        attributes: dict[str, Rows] = {"POSITION": positions, "COLOR_0": colors}
        return MeshPrimitive(attributes, [((name,), None) for name in attributes])


def blocks(path: Path, contents: MeshFile, advance: Advance | None = None) -> Iterator[Block]:
    """Yield the facets, and note warnings. Raises MeshletError, OSError."""
    with open_watched(path, advance) as file:
        start = file.read(START_BYTES)
        file.seek(0)
        if _is_binary(start, os.path.getsize(path)):
            count = _checked(_count_in_header(start), path, contents)
            file.seek(HEADER.itemsize)
            yield from _binary(file, count, start[: HEADER.itemsize])
        elif any(form.search(skip_mark(start)) for form in (BROKEN, FREE_SOLID, UNFINISHED)):
            yield from _text(_statements(file))
        else:
            yield from _text(text_blocks(file))


# --- binary ---


def _is_binary(start: bytes, size: int) -> bool:
    """Return whether a file is binary. start: its first START_BYTES; size: of all of it."""
    return b"\0" in start or _bytes_of(_count_in_header(start)) == size


def _count_in_header(start: bytes) -> int:
    header = np.frombuffer(start[: HEADER.itemsize].ljust(HEADER.itemsize, b"\0"), HEADER)[0]
    return int(header["triangles"])


def _bytes_of(count: int) -> int:
    """Return the size of a file with so many triangles."""
    return HEADER.itemsize + count * TRIANGLE.itemsize


def _checked(count: int, path: Path, contents: MeshFile) -> int:
    """Return how many triangles there are, which the file's size tells if its header is wrong."""
    size = os.path.getsize(path)
    if size < HEADER.itemsize:
        raise MeshletError(CUT_OFF, "get it again")
    actual, rest = divmod(size - HEADER.itemsize, TRIANGLE.itemsize)
    if actual == count:
        return count
    if rest and count > actual:
        raise MeshletError(CUT_OFF, "get it again")
    if rest and count:
        contents.warnings.append(f"{size - _bytes_of(count)} bytes after the triangles are ignored")
        return count
    contents.warnings.append(f"its header counts {count} triangles, but it has {actual}")
    return actual


def _binary(file: BinaryIO, count: int, header: bytes) -> Iterator[Block]:
    """Yield facets of a file that is read up to the first."""
    at = header.find(MAGICS) + len(MAGICS)
    part = header[at : at + 4] if at >= len(MAGICS) and at + 4 <= len(header) else None
    remaining = count
    while remaining:
        triangles = read_rows(file, TRIANGLE, remaining)
        if not len(triangles):
            raise MeshletError("became shorter while it was read", "try again")
        yield Block(0, "", triangles["corners"], _colors(triangles["attribute"], part))
        remaining -= len(triangles)


def _colors(attributes: np.ndarray, part: bytes | None) -> np.ndarray | None:
    """uint8[T, 4], None if no facet has one. attributes: uint16[T]; part: colour in the header."""
    if part is None and not (attributes & HAS_COLOR).any():
        return None
    levels = np.stack([attributes >> shift & LEVELS for shift in (0, 5, 10)], axis=1)
    colors = np.full((len(attributes), 4), 255, np.uint8)
    has_color = attributes & HAS_COLOR != 0
    colors[:, :3] = (levels if part else levels[:, ::-1]) * (255 / LEVELS) + 0.5
    if part is None:
        colors[~has_color] = 255
    else:
        colors[has_color] = np.frombuffer(part, np.uint8)
    return colors


# --- text ---


def _statements(file: BinaryIO) -> Iterator[bytes]:
    """Yield blocks of a text in which any white space may stand, with each statement on a line."""
    size, rest = block_bytes(file), b""
    seek_after_mark(file)
    while data := file.read(size):
        if b"\0" in data:
            raise MeshletError("is not text", EXPORT_AGAIN)
        # A blank at the end may be within a name, but not within a word.
        words = b" ".join((rest + data).split()) + b" " * data[-1:].isspace()
        lines = STATEMENT.sub(b"\n", words)
        end = lines.rfind(b"\n")
        rest = lines[end + 1 :]
        if len(rest) > MOST_STATEMENT:
            raise MeshletError("has a statement that does not end", EXPORT_AGAIN)
        if end > 0:
            yield lines[:end]
    yield rest


def _text(texts: Iterator[bytes]) -> Iterator[Block]:
    number, name, inside = -1, "", False
    rest = np.empty((0, 3))  # vertices of a facet that goes on in the next block
    for text in texts:
        (numbers, counts, at), (_, _, begins), (_, _, ends) = _codec.scan_lines(text, KEYWORDS)
        if (counts != 3).any():
            raise MeshletError("has a vertex that is not 3 numbers", EXPORT_AGAIN)
        vertices, first = numbers.reshape(-1, 3), 0
        names = dict(zip(begins.tolist(), words_after(text, begins)))
        for offset in [*sorted([*names, *ends.tolist()]), len(text)]:
            last = int(np.searchsorted(at, offset))
            if inside and offset not in names:
                corners = np.concatenate([rest, vertices[first:last]])
                whole = len(corners) // 3 * 3
                yield Block(number, name, corners[:whole].reshape(-1, 3, 3))
                rest = corners[whole:]
                if offset < len(text):
                    inside = False
                    if len(rest):
                        raise MeshletError("has a facet that is no triangle", EXPORT_AGAIN)
            elif not inside and offset in names:
                inside, number, first = True, number + 1, last
                name = names[offset].decode(errors="replace")
    if inside or number < 0:
        raise MeshletError(CUT_OFF, "get it again")

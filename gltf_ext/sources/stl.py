"""Reads .stl files, binary and text, in blocks."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gltf_ext import _codec
from gltf_ext.document.container import EXPORT_AGAIN
from gltf_ext.errors import MeshletError
from gltf_ext.sources.mesh_files import (
    CUT_OFF,
    Mesh,
    MeshFile,
    read_rows,
    text_blocks,
    to_floats,
    words_after,
)
from gltf_ext.sources.row_arrays import NewRows

HEADER = np.dtype([("text", "S80"), ("triangles", "<u4")])
KEYWORDS = {"vertex": "numbers", "solid": "any", "endsolid": "any"}
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

Block = tuple[int, str, np.ndarray]


def blocks(path: Path) -> Iterator[Block]:
    """Yield (number of a solid, its name, corners: float32[T, 3, 3]), in the order of the file.

    Raises MeshletError, OSError.
    """
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        start = file.read(HEADER.itemsize)
        header = np.frombuffer(start.ljust(HEADER.itemsize, b"\0"), HEADER)[0]
        length = HEADER.itemsize + int(header["triangles"]) * TRIANGLE.itemsize
        if size == length or b"\0" in start:
            if size < max(length, HEADER.itemsize):
                raise MeshletError(CUT_OFF, "get it again")
            left = int(header["triangles"])
            while left:
                triangles = read_rows(file, TRIANGLE, left)
                if not len(triangles):
                    raise MeshletError("became shorter while it was read", "try again")
                yield 0, "", triangles["corners"]
                left -= len(triangles)
        else:
            file.seek(0)
            yield from _text(text_blocks(file))


def read(path: Path, new_rows: NewRows) -> MeshFile:
    """Read a mesh for each solid. Raises MeshletError, OSError."""
    meshes: dict[int, Mesh] = {}
    for number, name, corners in blocks(path):
        if number not in meshes:
            positions = {"POSITION": new_rows()}
            meshes[number] = Mesh(name or path.name, positions, [(("POSITION",), None)])
        meshes[number].attributes["POSITION"].add(corners.reshape(-1, 3))
    return MeshFile(list(meshes.values()))


def _text(texts: Iterator[bytes]) -> Iterator[Block]:
    number, name, inside = -1, "", False
    rest = np.empty((0, 3), np.float32)  # vertices of a facet that goes on in the next block
    for text in texts:
        (numbers, counts, at), (_, _, begins), (_, _, ends) = _codec.scan_lines(text, KEYWORDS)
        if (counts != 3).any():
            raise MeshletError("has a vertex that is not 3 numbers", EXPORT_AGAIN)
        vertices, first = to_floats(numbers).reshape(-1, 3), 0
        names = dict(zip(begins.tolist(), words_after(text, begins)))
        for offset in [*sorted([*names, *ends.tolist()]), len(text)]:
            last = int(np.searchsorted(at, offset))
            if inside and offset not in names:
                corners = np.concatenate([rest, vertices[first:last]])
                whole = len(corners) // 3 * 3
                yield number, name, corners[:whole].reshape(-1, 3, 3)
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

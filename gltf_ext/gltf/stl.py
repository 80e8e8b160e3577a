"""Reads .stl files, binary and text, in blocks."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gltf_ext import _codec
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.container import EXPORT_AGAIN
from gltf_ext.gltf.mesh_files import BLOCK_BYTES, CUT_OFF, Mesh, text_blocks, to_floats

HEADER = np.dtype([("text", "S80"), ("triangles", "<u4")])
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

Block = tuple[int, str, np.ndarray]


def blocks(path: Path) -> Iterator[Block]:
    """(number of a solid, its name, corners: float32[T, 3, 3]), in the order of the file.

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
                count = min(left, BLOCK_BYTES // TRIANGLE.itemsize or 1)
                triangles = np.fromfile(file, TRIANGLE, count)
                if len(triangles) < count:
                    raise MeshletError("became shorter while it was read", "try again")
                yield 0, "", triangles["corners"]
                left -= count
        else:
            file.seek(0)
            yield from _text(text_blocks(file))


def read(path: Path) -> tuple[list[Mesh], tuple[str, ...]]:
    """A mesh for each solid that has triangles, and no warnings. Raises MeshletError, OSError."""
    meshes = []
    for (_, name), group in itertools.groupby(blocks(path), lambda block: block[:2]):
        positions = np.concatenate([corners.reshape(-1, 3) for _, _, corners in group])
        if len(positions):
            triangles = np.arange(len(positions), dtype=np.uint32).reshape(-1, 3)
            meshes.append(Mesh(name or path.name, triangles, {"POSITION": positions}))
    return meshes, ()


def _text(texts: Iterator[bytes]) -> Iterator[Block]:
    number, name, inside = -1, "", False
    rest = np.empty((0, 3), np.float32)  # vertices of a facet that goes on in the next block
    for text in texts:
        lower, at = text.lower(), 0
        while at < len(text):
            found = lower.find(b"endsolid" if inside else b"solid", at)
            end = found if found >= 0 else len(text)
            if inside:
                vertices = np.concatenate([rest, _vertices(lower[at:end])])
                whole = len(vertices) // 3 * 3
                yield number, name, vertices[:whole].reshape(-1, 3, 3)
                rest = vertices[whole:]
            if found < 0:
                break
            if len(rest):
                raise MeshletError("has a facet that is no triangle", EXPORT_AGAIN)
            at = lower.find(b"\n", found) + 1 or len(text)
            inside = not inside
            if inside:
                number += 1
                name = text[found + len(b"solid") : at].decode(errors="replace").strip()
    if inside or number < 0:
        raise MeshletError(CUT_OFF, "get it again")


def _vertices(text: bytes) -> np.ndarray:
    numbers, counts, _ = _codec.scan_lines(text, "vertex")
    if (counts != 3).any():
        raise MeshletError("has a vertex that is not 3 numbers", EXPORT_AGAIN)
    return to_floats(numbers).reshape(-1, 3)

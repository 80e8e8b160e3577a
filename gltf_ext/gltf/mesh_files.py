"""What .obj, .ply and .stl have in common: blocks of text, polygons, meshes as a glTF document."""

from __future__ import annotations

import codecs
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pygltflib

from gltf_ext import _codec
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.accessors import add_accessor, bounds, set_bounds
from gltf_ext.gltf.container import EXPORT_AGAIN
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.images import mime_type
from gltf_ext.ranges import begins, first_of_each, numbers_of

CUT_OFF = "is cut off"
# Of the blocks in which a file is read. An .obj of 38 MB takes 15 % more time in blocks of 256 kB
# than of 1 MB, and 25 to 40 % more in 128 kB; one of 2 MB takes twice its size of memory in blocks
# of 256 kB, and four times in 1 MB.
LEAST_BYTES, MOST_BYTES = 1 << 18, 1 << 20


@dataclass(eq=False)
class Material:
    """properties: a glTF material; image: its base colour texture, encoded, if it has one."""

    properties: dict[str, Any]
    image: bytes | None = None


@dataclass
class Mesh:
    """Triangles of one material.

    triangles: uint32[T, 3]; attributes: glTF's name -> float32[V, n], or uint8[V, 4] for COLOR_0.
    """

    name: str
    triangles: np.ndarray
    attributes: dict[str, np.ndarray]
    material: Material | None = None


# Meshes, warnings, and the other files that were looked for, such as materials and textures.
Imported = tuple[list[Mesh], list[str], list[Path]]


def block_bytes(file: BinaryIO) -> int:
    """The size of the blocks in which a file is read: an eighth of it, between the two limits."""
    eighth = os.fstat(file.fileno()).st_size // 8
    return min(max(eighth, LEAST_BYTES), MOST_BYTES)


def read_rows(file: BinaryIO, row: np.dtype, most: int) -> np.ndarray:
    """The next block of a binary file: at most so many rows, and those that it has."""
    size = row.itemsize
    data = file.read(min(most, block_bytes(file) // size or 1) * size)
    return np.frombuffer(data, row, len(data) // size)


def text_blocks(file: BinaryIO) -> Iterator[bytes]:
    """The rest of a file in blocks of whole lines. Raises MeshletError if it is not text.

    A line that a backslash continues stays in one block. A file's byte order mark is left out.
    """
    size = block_bytes(file)
    if file.tell() == 0 and file.read(len(codecs.BOM_UTF8)) != codecs.BOM_UTF8:
        file.seek(0)
    while start := file.read(size):
        pieces, end = [start], start[-3:]
        while line := file.readline():
            pieces.append(line)
            end = (end + line)[-3:]
            if not end.rstrip(b"\r\n").endswith(b"\\"):
                break
        text = b"".join(pieces)
        if b"\0" in text:
            raise MeshletError("is not text", EXPORT_AGAIN)
        yield text


class Collected:
    """Rows of blocks, one after the other. A bytearray grows in place: a binary .ply or .stl takes
    half the memory, and an .stl two thirds of the time, of keeping the blocks to join them."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._row: tuple[np.dtype, tuple[int, ...]] = (np.dtype("u1"), ())

    def add(self, values: np.ndarray) -> None:
        """values: [n, ...], of one type and shape each time."""
        self._row = values.dtype, values.shape[1:]
        self._bytes += np.ascontiguousarray(values).data

    def rows(self) -> np.ndarray:
        """All, [n, ...]. No more can be added."""
        dtype, shape = self._row
        return np.frombuffer(self._bytes, dtype).reshape(-1, *shape)


def words_after(text: bytes, offsets: np.ndarray) -> list[bytes]:
    """The words after the keyword of each line, which starts at an offset."""
    ends = (text.find(b"\n", at) for at in offsets.tolist())
    lines = (text[at : end if end >= 0 else None] for at, end in zip(offsets.tolist(), ends))
    return [b" ".join(line.split()[1:]) for line in lines]


def fans(sizes: np.ndarray) -> tuple[np.ndarray | None, np.ndarray]:
    """Cuts polygons into triangles around their first corners.

    sizes: int64[F], corners of each polygon; those with fewer than 3 give no triangle. Returns
    (corners: int64[T, 3], in the order of all polygons' corners, or None if all are triangles;
    triangles of each: int64[F]).
    """
    if (sizes == 3).all():
        return None, np.broadcast_to(np.int64(1), len(sizes))
    counts = np.maximum(sizes - 2, 0)
    starts = begins(sizes)[:-1]
    second = numbers_of(starts + 1, counts)
    return np.stack([np.repeat(starts, counts), second, second + 1], axis=1), counts


def picked(values: np.ndarray, corners: np.ndarray | None) -> np.ndarray:
    """[T, 3, ...]: values [C, ...] of all polygons' corners at those that `fans` returns."""
    if corners is None:
        return values.reshape(-1, 3, *values.shape[1:])
    triangles: np.ndarray = values[corners]
    return triangles


def split_vertices(corners: Sequence[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
    """Makes a vertex of each different combination of numbers at a corner.

    corners: int32[T, 3] for each kind of number. Returns (triangles: uint32[T, 3], the vertices'
    numbers of each kind: int32[V]).
    """
    first, *others = corners
    keys = [first, *(c for c in others if not np.array_equal(c, first))]
    if len(keys) == 1:
        used = np.zeros(int(first.max(initial=-1)) + 1, bool)
        used[first.reshape(-1)] = True
        rows = np.flatnonzero(used).astype(np.int32)
        new = np.cumsum(used, dtype=np.uint32) - np.uint32(1)
        return new[first], [rows] * len(corners)
    table = np.stack([key.reshape(-1) for key in keys], axis=1)
    remap, count = _codec.weld(table.view(np.uint8))
    at = first_of_each(remap, count)
    return remap.reshape(-1, 3), [c.reshape(-1)[at] for c in corners]


def check_numbers(numbers: np.ndarray, count: int, kind: str) -> None:
    """Raises MeshletError for a number that is not in [0, count). numbers: int32."""
    if len(numbers) and numbers.view(np.uint32).max() >= count:
        wrong = next(n for n in (numbers.max(), numbers.min()) if not 0 <= n < count)
        raise MeshletError(f"a face uses {kind} {wrong + 1} of {count}", EXPORT_AGAIN)


def to_floats(values: np.ndarray) -> np.ndarray:
    """As float32; numbers beyond its largest become infinite, which compress refuses."""
    with np.errstate(over="ignore"):
        return values.astype(np.float32, copy=False)


def to_texcoords(values: np.ndarray) -> np.ndarray:
    """Texture coordinates [n, 2] with v upwards, as glTF has them: v grows downwards."""
    return to_floats(np.stack([values[:, 0], 1 - values[:, 1]], axis=1))


def color_bytes(values: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """Colours as uint8[n, 4]. values: [n, 3 or 4] of this type; floats are from 0 to 1."""
    most = np.iinfo(dtype).max if dtype.kind in "iu" else 1
    levels = np.nan_to_num(values.astype(np.float64), posinf=0, neginf=0) * (255 / most)
    result = np.full((len(values), 4), 255, np.uint8)
    result[:, : values.shape[1]] = np.clip(levels, 0, 255).round()
    return result


def to_document(meshes: Sequence[Mesh]) -> Document:
    """A document with a node for each mesh."""
    names = [mesh.name.encode(errors="replace").decode() for mesh in meshes]
    materials = list(dict.fromkeys(mesh.material for mesh in meshes if mesh.material))
    images = list(dict.fromkeys(m.image for m in materials if m.image is not None))
    document = Document(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(meshes)))}],
            "nodes": [{"mesh": i, "name": name} for i, name in enumerate(names)],
            "materials": [_with_texture(m, images) for m in materials],
            "textures": [{"source": i} for i in range(len(images))],
            "images": [{"mimeType": mime_type(image)} for image in images],
        }
    )
    for holder, image in zip(document.images, images):
        holder.bufferView = document.add_view(image)
    for mesh, name in zip(meshes, names):
        primitive = pygltflib.Primitive(
            indices=add_accessor(document, mesh.triangles.reshape(-1, 1)),
            attributes={n: add_accessor(document, v) for n, v in mesh.attributes.items()},
            material=materials.index(mesh.material) if mesh.material else None,
        )
        position = document.accessors[primitive.attributes["POSITION"]]
        set_bounds(position, *bounds(mesh.attributes["POSITION"]))
        document.meshes.append(pygltflib.Mesh(name=name, primitives=[primitive]))
    return document


def _with_texture(material: Material, images: list[bytes]) -> dict[str, Any]:
    """Its glTF properties; the texture of an image has the image's number."""
    if material.image is None:
        return material.properties
    pbr = material.properties.get("pbrMetallicRoughness", {})
    texture = {"index": images.index(material.image)}
    return {**material.properties, "pbrMetallicRoughness": {**pbr, "baseColorTexture": texture}}

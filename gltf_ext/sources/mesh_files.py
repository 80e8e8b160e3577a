"""What .obj, .ply and .stl have in common: blocks of text, polygons, meshes as a glTF document."""

from __future__ import annotations

import codecs
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from gltf_ext import _codec
from gltf_ext.document import gltf
from gltf_ext.document.accessors import add_accessor, bounds, set_bounds
from gltf_ext.document.container import EXPORT_AGAIN
from gltf_ext.document.document import Document
from gltf_ext.document.images import as_png_or_jpeg, mime_type
from gltf_ext.errors import MeshletError, blaming
from gltf_ext.portable import path_beside
from gltf_ext.ranges import begins, first_of_each, numbers_of
from gltf_ext.sources.row_arrays import RowArray

CUT_OFF = "is cut off"
# Of the blocks in which a file is read. An .obj of 38 MB takes 15 % more time in blocks of 256 kB
# than of 1 MB, and 25 to 40 % more in 128 kB; one of 2 MB takes twice its size of memory in blocks
# of 256 kB, and four times in 1 MB.
LEAST_BYTES, MOST_BYTES = 1 << 18, 1 << 20


@dataclass(eq=False)
class Material:
    """A material of a mesh.

    Attributes:
        properties: a glTF material; image: its base colour texture, encoded, if it has one.
    """

    properties: dict[str, Any]
    image: bytes | None = None


@dataclass
class IndexedMesh:
    """A mesh in memory whose attributes have the same numbers at corners, as in glTF.

    Attributes:
        triangles: uint32[T, 3]; attributes: name -> float32[V, n], or uint8[V, 4] for COLOR_0.
    """

    name: str
    triangles: np.ndarray
    attributes: dict[str, np.ndarray]
    material: Material | None


# Attributes that have the same numbers at corners, and these: int32[3 T, 1]. None for one attribute
# whose rows are the values at the corners.
Group = tuple[tuple[str, ...], RowArray | None]


@dataclass
class Mesh:
    """Triangles of one material, as a file has them.

    Attributes:
        attributes: glTF's name -> float32[n, components], or uint8[n, 4] for COLOR_0.
        groups: each attribute is in one.
        shares_rows: whether other meshes use the same arrays. Rows that this one does not use are
            then no vertices of it.
    """

    name: str
    attributes: dict[str, RowArray]
    groups: list[Group]
    material: Material | None = None
    shares_rows: bool = False

    @property
    def triangle_count(self) -> int:
        """The number of triangles."""
        names, numbers = self.groups[0]
        return (numbers or self.attributes[names[0]]).count // 3

    def indexed(self) -> IndexedMesh:
        """Return the mesh with a vertex for each different combination of rows at a corner."""
        values = {name: rows.rows(0, rows.count) for name, rows in self.attributes.items()}
        if len(self.groups) == 1 and not self.shares_rows:
            ((_, numbers),) = self.groups
            triangles = (
                np.arange(3 * self.triangle_count, dtype=np.int32).reshape(-1, 3)
                if numbers is None
                else _read(numbers)
            )
            return IndexedMesh(self.name, triangles.view(np.uint32), values, self.material)
        corners = [
            _of_equal_rows(values[names[0]]) if numbers is None else _read(numbers)
            for names, numbers in self.groups
        ]
        triangles, numbers_of_groups = split_vertices(corners)
        rows_of = {
            name: rows for (names, _), rows in zip(self.groups, numbers_of_groups) for name in names
        }
        values = {name: values[name][rows_of[name]] for name in values}
        return IndexedMesh(self.name, triangles, values, self.material)

    def sample(self) -> IndexedMesh:
        """Return a mesh of one vertex with the same attributes, in the order of their groups."""
        names = [name for names, _ in self.groups for name in names]
        first = {name: self.attributes[name].rows(0, 1) for name in names}
        return IndexedMesh(self.name, np.zeros((1, 3), np.uint32), first, self.material)


@dataclass
class MeshFile:
    """The contents of an .obj, .ply or .stl.

    Attributes:
        warnings: a line for each thing that is left out.
        others: the other files that were looked for, such as materials and textures.
    """

    meshes: list[Mesh]
    warnings: list[str] = field(default_factory=list)
    others: list[Path] = field(default_factory=list)


def is_there(path: Path | None) -> bool:
    """Return whether `path_beside` leads to a file; False for a name too long for the system."""
    return path is not None and os.path.isfile(path)


def named_file(folder: Path, name: str, contents: MeshFile) -> Path | None:
    """Return a file that a model in the folder names, if it is there; else note a warning."""
    path = path_beside(folder, name)
    if path is not None:
        contents.others.append(path)
    if is_there(path):
        return path
    problem = "is not a relative path" if path is None else "is not there"
    short = MeshletError(name).message
    contents.warnings.append(f"{short} {problem}, so its material is left out")
    return None


def read_texture(folder: Path, name: str, contents: MeshFile) -> bytes | None:
    """Return an image that a model in the folder names, as PNG or JPEG, if it is there.

    Raises MeshletError, naming the image, when it cannot be read or takes too much memory.
    """
    path = named_file(folder, name, contents)
    if path is None:
        return None
    with blaming(path):
        return as_png_or_jpeg(path.read_bytes())


def block_bytes(file: BinaryIO) -> int:
    """Return the size of blocks in which a file is read: an eighth of it, between the limits."""
    eighth = os.fstat(file.fileno()).st_size // 8
    return min(max(eighth, LEAST_BYTES), MOST_BYTES)


def read_rows(file: BinaryIO, row: np.dtype, most: int) -> np.ndarray:
    """Read the next block of a binary file: at most so many rows, and those that it has."""
    size = row.itemsize
    data = file.read(min(most, block_bytes(file) // size or 1) * size)
    return np.frombuffer(data, row, len(data) // size)


def text_blocks(file: BinaryIO) -> Iterator[bytes]:
    """Yield the rest of a file in blocks of whole lines. Raises MeshletError if it is not text.

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


def words_after(text: bytes, offsets: np.ndarray) -> list[bytes]:
    """Return the words after the keyword of each line, which starts at an offset."""
    ends = (text.find(b"\n", at) for at in offsets.tolist())
    lines = (text[at : end if end >= 0 else None] for at, end in zip(offsets.tolist(), ends))
    return [b" ".join(line.split()[1:]) for line in lines]


def fans(sizes: np.ndarray) -> tuple[np.ndarray | None, np.ndarray]:
    """Cut polygons into triangles around their first corners.

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


def at_corners(values: np.ndarray, corners: np.ndarray | None) -> np.ndarray:
    """[T, 3, ...]: values [C, ...] of all polygons' corners at those that `fans` returns."""
    if corners is None:
        return values.reshape(-1, 3, *values.shape[1:])
    triangles: np.ndarray = values[corners]
    return triangles


class CornerNumbers:
    """Numbers of rows at corners: int32[3 T, 1], and their range.

    Attributes:
        rows: these numbers, as far as none of them is negative.
    """

    def __init__(self, rows: RowArray) -> None:
        """Start with rows that are empty."""
        self.rows = rows
        self.least, self.most = 0, -1

    def add(self, numbers: np.ndarray) -> None:
        """Append numbers of more triangles: int32[n, 3]. Raises OSError."""
        self.least = min(self.least, int(numbers.min(initial=0)))
        self.most = max(self.most, int(numbers.max(initial=-1)))
        if self.least >= 0:
            self.rows.add(numbers.reshape(-1, 1))

    def check(self, count: int, kind: str) -> None:
        """Raise MeshletError for a number that is not in [0, count)."""
        if self.most >= count or self.least < 0:
            wrong = self.most if self.most >= count else self.least
            raise MeshletError(f"a face uses {kind} {wrong + 1} of {count}", EXPORT_AGAIN)


def _read(numbers: RowArray) -> np.ndarray:
    """int32[T, 3]."""
    return numbers.rows(0, numbers.count).reshape(-1, 3)


def _of_equal_rows(values: np.ndarray) -> np.ndarray:
    """int32[T, 3]: for each corner, the first with the same value. values: [3 T, components]."""
    remap, count = _codec.weld(np.ascontiguousarray(values).view(np.uint8))
    return first_of_each(remap, count)[remap].view(np.int32).reshape(-1, 3)


def split_vertices(corners: Sequence[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
    """Make a vertex of each different combination of numbers at a corner.

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


def to_floats(values: np.ndarray) -> np.ndarray:
    """Return float32; numbers beyond its largest become infinite, which compress refuses."""
    with np.errstate(over="ignore"):
        return values.astype(np.float32, copy=False)


def to_texcoords(values: np.ndarray) -> np.ndarray:
    """Turn texture coordinates [n, 2] with v upwards into those of glTF: v grows downwards."""
    return to_floats(np.stack([values[:, 0], 1 - values[:, 1]], axis=1))


def color_bytes(values: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """Return colours as uint8[n, 4]. values: [n, 3 or 4] of this type; floats are from 0 to 1."""
    most = np.iinfo(dtype).max if dtype.kind in "iu" else 1
    levels = np.nan_to_num(values.astype(np.float64), posinf=0, neginf=0) * (255 / most)
    result = np.full((len(values), 4), 255, np.uint8)
    result[:, : values.shape[1]] = np.clip(levels, 0, 255).round()
    return result


def to_document(meshes: Sequence[IndexedMesh]) -> Document:
    """Return a document with a node for each mesh."""
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
        holder["bufferView"] = document.add_view(image)
    for mesh, name in zip(meshes, names):
        primitive: gltf.Primitive = {
            "indices": add_accessor(document, mesh.triangles.reshape(-1, 1)),
            "attributes": {n: add_accessor(document, v) for n, v in mesh.attributes.items()},
        }
        if mesh.material:
            primitive["material"] = materials.index(mesh.material)
        position = document.accessors[primitive["attributes"]["POSITION"]]
        set_bounds(position, *bounds(mesh.attributes["POSITION"]))
        document.meshes.append({"name": name, "primitives": [primitive]})
    return document


def _with_texture(material: Material, images: list[bytes]) -> dict[str, Any]:
    """Its glTF properties; the texture of an image has the image's number."""
    if material.image is None:
        return material.properties
    pbr = material.properties.get("pbrMetallicRoughness", {})
    texture = {"index": images.index(material.image)}
    return {**material.properties, "pbrMetallicRoughness": {**pbr, "baseColorTexture": texture}}

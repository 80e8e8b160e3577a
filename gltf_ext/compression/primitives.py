"""Triangle primitives of a document as arrays: lists, strips and fans, welded on request."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
import pygltflib

from gltf_ext import _codec
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.accessors import (
    bounds,
    described_by,
    index_accessor,
    read_accessor,
    set_bounds,
    store,
)
from gltf_ext.gltf.document import TRIANGLE_MODES, Document
from gltf_ext.gltf.draco import DRACO, decode_draco
from gltf_ext.ranges import first_of_each

T = TypeVar("T")
Box = tuple[np.ndarray, np.ndarray]  # smallest and largest position


@dataclass(repr=False)
class Primitive:
    """One triangle primitive.

    Attributes:
        mesh, primitive: its place in the document.
        indices: uint32[T, 3].
        attributes: name -> [V, components] in the accessor's component type.
        targets: the same for the deltas of each morph target.
    """

    mesh: int
    primitive: int
    indices: np.ndarray
    attributes: dict[str, np.ndarray]
    targets: list[dict[str, np.ndarray]] = field(default_factory=list)

    def __repr__(self) -> str:
        return (
            f"Primitive(mesh={self.mesh}, primitive={self.primitive}, "
            f"triangles={len(self.indices)}, vertices={self.vertex_count}, "
            f"attributes={sorted(self.attributes)}, targets={len(self.targets)})"
        )

    @property
    def vertex_count(self) -> int:
        return len(self.attributes["POSITION"])

    @property
    def triangle_count(self) -> int:
        return len(self.indices)

    @property
    def where(self) -> str:
        """Its place, for errors."""
        return place(self.mesh, self.primitive)

    @property
    def box(self) -> Box | None:
        """The bounds of its positions; None without triangles, or for integers."""
        positions = self.attributes["POSITION"]
        if not len(self.indices) or positions.dtype.kind != "f":
            return None
        return bounds(positions)

    @property
    def sets(self) -> list[dict[str, np.ndarray]]:
        """The attributes, then those of each target."""
        return [self.attributes, *self.targets]

    @property
    def arrays(self) -> list[tuple[str, np.ndarray]]:
        """(name, values) of every attribute, then of the targets as "targets[i].NAME"."""
        return named(self.sets)


@dataclass
class Dropped:
    """Counts of vertices and triangles left out of primitives.

    incomplete_triangles: primitives whose indices end in one or two corners of a triangle.
    """

    degenerate_triangles: int = 0
    incomplete_triangles: int = 0
    unreferenced_vertices: int = 0
    duplicate_vertices: int = 0

    def add(self, other: Dropped) -> None:
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + value)


def place(mesh: int, primitive: int) -> str:
    """A primitive's place in its document, for errors."""
    return f"mesh {mesh} primitive {primitive}"


def named(sets: list[dict[str, T]]) -> list[tuple[str, T]]:
    """(name, value) of every attribute, then of the targets as "targets[i].NAME"."""
    return [
        (f"targets[{i - 1}].{name}" if i else name, value)
        for i, values in enumerate(sets)
        for name, value in values.items()
    ]


def all_primitives(document: Document) -> Iterator[tuple[int, int, pygltflib.Primitive]]:
    """(mesh, primitive, object) of each primitive."""
    for m, mesh in enumerate(document.meshes):
        for p, primitive in enumerate(mesh.primitives):
            yield m, p, primitive


def triangle_primitives(document: Document) -> list[tuple[int, int, pygltflib.Primitive]]:
    """(mesh, primitive, object) of each primitive that is a list, strip or fan of triangles."""
    return [found for found in all_primitives(document) if found[2].mode in TRIANGLE_MODES]


def read_primitive(document: Document, mesh: int, index: int) -> tuple[Primitive, Dropped]:
    """A primitive that is not compressed with our extension; its triangles are as in the file.

    Checks every count and index. Raises MeshletError.
    """
    primitive = document.meshes[mesh].primitives[index]
    where = place(mesh, index)
    names = primitive.attributes
    if "POSITION" not in names:
        raise MeshletError(f"{where} has no POSITION", "export the model again")
    is_draco = DRACO in (primitive.extensions or {})
    decoded = decode_draco(document, primitive, where) if is_draco else {}
    indices = decoded.pop("indices", None)
    attributes: dict[str, np.ndarray] = {}
    count = None
    for name in sorted(names, key=lambda name: name != "POSITION"):
        if name not in decoded:
            decoded[name] = read_accessor(document, names[name], f"{name} of {where}", count)
        attributes[name] = decoded[name]
        count = len(attributes["POSITION"])
    targets = [
        {
            name: read_accessor(document, accessor, f"{name} of target {t} of {where}", count)
            for name, accessor in target.items()
        }
        for t, target in enumerate(primitive.targets)
    ]
    if indices is None:
        indices = _read_indices(document, primitive, len(attributes["POSITION"]), where)
    result = Primitive(mesh, index, _triangles(indices, primitive.mode), attributes, targets)
    _check_widths(result)
    incomplete = primitive.mode == pygltflib.TRIANGLES and len(indices) % 3 != 0
    return result, Dropped(incomplete_triangles=int(incomplete))


def _check_widths(primitive: Primitive) -> None:
    for target, values_of in enumerate(primitive.sets):
        widths = {"POSITION": 3, "NORMAL": 3, "TANGENT": 3 if target else 4}
        for name, values in values_of.items():
            if values.shape[1] != widths.get(name, values.shape[1]):
                raise MeshletError(
                    f"{name} of {primitive.where} has {values.shape[1]} components "
                    f"instead of {widths[name]}",
                    "export the model again",
                )


def _read_indices(
    document: Document, primitive: pygltflib.Primitive, vertex_count: int, where: str
) -> np.ndarray:
    if primitive.indices is None:
        return np.arange(vertex_count, dtype=np.uint32)
    values = read_accessor(document, primitive.indices, f"indices of {where}")
    if values.dtype.kind != "u" or values.shape[1] != 1:
        raise MeshletError(
            f"indices of {where} are not unsigned integers", "export the model again"
        )
    indices = np.ascontiguousarray(values[:, 0], np.uint32)
    if len(indices) and indices.max() >= vertex_count:
        raise MeshletError(
            f"indices of {where} reach {indices.max()}, but it has {vertex_count} vertices",
            "export the model again",
        )
    return indices


def _triangles(indices: np.ndarray, mode: int) -> np.ndarray:
    """uint32[T, 3] from the indices of a list, strip or fan. The winding of strips alternates."""
    if mode == pygltflib.TRIANGLES:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    count = max(len(indices) - 2, 0)
    i = np.arange(count)
    if mode == pygltflib.TRIANGLE_STRIP:
        return indices[np.stack([i, i + 1 + i % 2, i + 2 - i % 2], axis=1)].reshape(-1, 3)
    return indices[np.stack([i + 1, i + 2, np.zeros_like(i)], axis=1)].reshape(-1, 3)


def weld(primitive: Primitive) -> tuple[Primitive, Dropped]:
    """Merges vertices that are bit-identical in all attributes and targets.

    Drops unreferenced vertices, and triangles with a repeated vertex. May change the argument.
    """
    dropped = Dropped()
    primitive, dropped.unreferenced_vertices = _without_unreferenced(primitive)
    if not len(primitive.indices):
        return primitive, dropped
    remap, unique = _codec.weld(_rows([values for _, values in primitive.arrays]))
    dropped.duplicate_vertices = len(remap) - unique
    if dropped.duplicate_vertices:
        first = first_of_each(remap, unique)
        primitive = _selected(primitive, first, remap[primitive.indices])
    a, b, c = primitive.indices.T
    degenerate = (a == b) | (b == c) | (c == a)
    dropped.degenerate_triangles = int(degenerate.sum())
    if dropped.degenerate_triangles:
        primitive.indices = primitive.indices[~degenerate]
        # Only degenerate triangles used these vertices.
        primitive, unreferenced = _without_unreferenced(primitive)
        dropped.unreferenced_vertices += unreferenced
    return primitive, dropped


def _without_unreferenced(primitive: Primitive) -> tuple[Primitive, int]:
    used = np.zeros(primitive.vertex_count, bool)
    used[primitive.indices.ravel()] = True
    kept = np.flatnonzero(used)
    unreferenced = len(used) - len(kept)
    if not unreferenced:
        return primitive, 0
    new_index = np.zeros(len(used), np.uint32)
    new_index[kept] = np.arange(len(kept), dtype=np.uint32)
    return _selected(primitive, kept, new_index[primitive.indices]), unreferenced


def _selected(primitive: Primitive, rows: np.ndarray, indices: np.ndarray) -> Primitive:
    return Primitive(
        primitive.mesh,
        primitive.primitive,
        indices,
        {n: v[rows] for n, v in primitive.attributes.items()},
        [{n: v[rows] for n, v in target.items()} for target in primitive.targets],
    )


def _rows(arrays: list[np.ndarray]) -> np.ndarray:
    """The arrays' bytes side by side: uint8[V, stride]."""
    sizes = [a.shape[1] * a.dtype.itemsize for a in arrays]
    rows = np.empty((len(arrays[0]), sum(sizes)), np.uint8)
    start = 0
    for values, size in zip(arrays, sizes):
        rows[:, start : start + size] = (
            np.ascontiguousarray(values).view(np.uint8).reshape(len(rows), size)
        )
        start += size
    return rows


def position_ids(positions: np.ndarray) -> np.ndarray:
    """uint32[V]: one id per distinct position. Negative zero equals zero."""
    values = np.ascontiguousarray(positions)
    if values.dtype.kind == "f":
        values = values + np.float32(0)
    ids: np.ndarray = _codec.weld(_rows([values]))[0]
    return ids


def check_finite(primitive: Primitive) -> None:
    """Raises MeshletError for NaN and infinity, except in custom attributes: they are lossless."""
    for name, values in primitive.arrays:
        if values.dtype.kind != "f" or name.rpartition(".")[2].startswith("_"):
            continue
        with np.errstate(invalid="ignore"):
            # Finite only if all values are: float32 values cannot overflow a float64 sum.
            total = values.sum(dtype=np.float64)
        if not np.isfinite(total):
            raise MeshletError(
                f"{name} of {primitive.where} has a NaN or infinite value",
                "repair the model first",
            )


def describe(
    document: Document,
    names: dict[str, int],
    vertex_count: int,
    box: tuple[np.ndarray, np.ndarray] | None,
) -> dict[str, int]:
    """Name -> new accessor for decoded data, of the old accessor's type; box: of POSITION."""
    first = len(document.accessors)
    for name, old in names.items():
        accessor = described_by(document.accessors[old], vertex_count)
        if name == "POSITION" and box:
            set_bounds(accessor, *box)
        document.accessors.append(accessor)
    return {name: first + i for i, name in enumerate(names)}


def describe_indices(document: Document, triangle_count: int, vertex_count: int) -> int:
    """The number of a new accessor for triangles."""
    document.accessors.append(index_accessor(3 * triangle_count, vertex_count))
    return len(document.accessors) - 1


def store_primitive(
    document: Document, primitive: pygltflib.Primitive, decoded: Primitive, fallback: bool
) -> None:
    """Gives the primitive's accessors buffer views with the decoded data.

    fallback: see Document.add_view.
    """
    accessors = document.accessors
    indices, kind = decoded.indices.reshape(-1, 1), pygltflib.ELEMENT_ARRAY_BUFFER
    store(document, accessors[primitive.indices], indices, kind, fallback)
    for names, arrays in zip([primitive.attributes, *primitive.targets], decoded.sets):
        for name, accessor in names.items():
            store(document, accessors[accessor], arrays[name], pygltflib.ARRAY_BUFFER, fallback)

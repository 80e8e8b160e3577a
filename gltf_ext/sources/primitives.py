"""Triangle primitives of a document as arrays, and how a document describes them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.accessors import described_by, index_accessor, set_bounds, store
from gltf_ext.document.document import Document
from gltf_ext.sources.attribute_names import pair_names

EXTENSION = "EXT_meshlet_edgebreaker"

T = TypeVar("T")


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
        """Count and names, without the arrays."""
        return (
            f"Primitive(mesh={self.mesh}, primitive={self.primitive}, "
            f"triangles={len(self.indices)}, vertices={self.vertex_count}, "
            f"attributes={sorted(self.attributes)}, targets={len(self.targets)})"
        )

    @property
    def vertex_count(self) -> int:
        """The number of vertices."""
        return len(self.attributes["POSITION"])

    @property
    def triangle_count(self) -> int:
        """The number of triangles."""
        return len(self.indices)

    @property
    def where(self) -> str:
        """Its place, for errors."""
        return place(self.mesh, self.primitive)

    @property
    def sets(self) -> list[dict[str, np.ndarray]]:
        """The attributes, then those of each target."""
        return [self.attributes, *self.targets]

    @property
    def arrays(self) -> list[tuple[str, np.ndarray]]:
        """(name, values) of every attribute, then of the targets as "targets[i].NAME"."""
        return pair_names(self.sets)


@dataclass
class DropCounts:
    """Counts of vertices and triangles left out of primitives.

    incomplete_triangles: primitives whose indices end in one or two corners of a triangle.
    non_finite_triangles: those with a position that is not finite.
    """

    degenerate_triangles: int = 0
    incomplete_triangles: int = 0
    unreferenced_vertices: int = 0
    duplicate_vertices: int = 0
    non_finite_triangles: int = 0

    def add(self, other: DropCounts) -> None:
        """Add other counts."""
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + value)


def place(mesh: int, primitive: int) -> str:
    """Return a primitive's place in its document, for errors."""
    return f"mesh {mesh} primitive {primitive}"


def is_compressed(primitive: gltf.Primitive) -> bool:
    """Return whether the primitive has the extension."""
    return gltf.has_extension(primitive, EXTENSION)


def all_primitives(document: Document) -> Iterator[tuple[int, int, gltf.Primitive]]:
    """Return (mesh, primitive, object) of each primitive."""
    for m, mesh in enumerate(document.meshes):
        for p, primitive in enumerate(mesh["primitives"]):
            yield m, p, primitive


def triangle_primitives(document: Document) -> list[tuple[int, int, gltf.Primitive]]:
    """Return (mesh, primitive, object) of each list, strip or fan of triangles with positions."""
    return [place for place in all_primitives(document) if gltf.has_triangles(place[2])]


def describe(
    document: Document,
    names: dict[str, int],
    vertex_count: int,
    box: tuple[np.ndarray, np.ndarray] | None,
) -> dict[str, int]:
    """Return name -> new accessor for decoded data, with the old types. box: of POSITION."""
    first = len(document.accessors)
    for name, old in names.items():
        accessor = described_by(document.accessors[old], vertex_count)
        if name == "POSITION" and box:
            set_bounds(accessor, *box)
        document.accessors.append(accessor)
    return {name: first + i for i, name in enumerate(names)}


def describe_indices(document: Document, triangle_count: int, vertex_count: int) -> int:
    """Return the number of a new accessor for triangles."""
    document.accessors.append(index_accessor(3 * triangle_count, vertex_count))
    return len(document.accessors) - 1


def store_primitive(
    document: Document, primitive: gltf.Primitive, decoded: Primitive, fallback: bool
) -> None:
    """Give the primitive's accessors buffer views with the decoded data.

    fallback: see Document.add_view.
    """
    accessors = document.accessors
    indices, kind = decoded.indices.reshape(-1, 1), gltf.ELEMENT_ARRAY_BUFFER
    store(document, accessors[primitive["indices"]], indices, kind, fallback)
    for names, arrays in zip(gltf.attribute_sets(primitive), decoded.sets):
        for name, accessor in names.items():
            store(document, accessors[accessor], arrays[name], gltf.ARRAY_BUFFER, fallback)

"""Compares vertices, boundary edges and islands of a primitive with those of its source."""

from __future__ import annotations

from dataclasses import dataclass

from gltf_ext._codec import Bytes
from gltf_ext._joinable import Joinable, topology
from gltf_ext.attributes.equal_vertices import source_vertices_of
from gltf_ext.attributes.join import without_copies
from gltf_ext.attributes.records import Triangles, join_equal
from gltf_ext.ranges import has_repeats


@dataclass(frozen=True)
class Topology:
    """Counts of a mesh.

    Attributes:
        vertices: of triangles; boundary_edges: those of exactly one triangle, none in a closed
            mesh; islands: parts that no vertex connects.
    """

    vertices: int = 0
    boundary_edges: int = 0
    islands: int = 0

    def plus(self, other: Topology) -> Topology:
        """Return the sums of both."""
        return Topology(*(a + b for a, b in zip(vars(self).values(), vars(other).values())))


def topologies(
    triangles: Triangles, joinable: Joinable, source_vertices: int, table: Bytes | None = None
) -> tuple[Topology, Topology, Topology]:
    """Return the topology of the triangles of a source, of their weld, and of what they decode to.

    In the weld, equal vertices of the source are one. Triangles that have such a vertex twice
    do not count.

    Args:
        triangles: of the source.
        joinable: what they decode to.
        source_vertices: of the extension's object.
        table: of equal vertices; None for none.

    Raises:
        ValueError: the table is malformed.
    """
    corners, _, count = join_equal(triangles)
    has_area = ~has_repeats(corners)
    weld = Topology(**topology(corners[has_area], count))
    whole = weld
    if count < len(triangles.records):
        vertices = source_vertices_of(triangles)
        corners = vertices[triangles.corners_between(0, triangles.count)[has_area]]
        whole = Topology(**topology(corners, len(vertices)))
    decoded, (numbers,) = without_copies(
        joinable, [joinable.integers[0]], max(source_vertices, 1), table
    )
    return whole, weld, Topology(**topology(decoded, len(numbers)))


def difference(before: Topology, after: Topology) -> str:
    """Say what differs; empty for nothing."""
    pairs = zip(vars(before).items(), vars(after).values())
    changes = [f"{a:,} {name.replace('_', ' ')} became {b:,}" for (name, a), b in pairs if a != b]
    return ", ".join(changes)

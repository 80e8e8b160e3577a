"""Compares vertices, boundary edges and islands of a primitive with those of its source."""

from __future__ import annotations

from dataclasses import dataclass

from gltf_ext._joinable import Joinable, topology
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
    triangles: Triangles, joinable: Joinable, source_vertices: int
) -> tuple[Topology, Topology]:
    """Return the topology of the triangles of a source, and of what they decode to.

    Equal vertices of the source are one; triangles that have a vertex twice do not count. Raises
    ValueError.
    """
    corners, _, count = join_equal(triangles)
    decoded, (numbers,) = without_copies(joinable, [joinable.integers[0]], max(source_vertices, 1))
    return (
        Topology(**topology(corners[~has_repeats(corners)], count)),
        Topology(**topology(decoded, len(numbers))),
    )


def difference(before: Topology, after: Topology) -> str:
    """Say what differs; empty for nothing."""
    pairs = zip(vars(before).items(), vars(after).values())
    changes = [f"{a:,} {name.replace('_', ' ')} became {b:,}" for (name, a), b in pairs if a != b]
    return ", ".join(changes)

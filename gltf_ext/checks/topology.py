"""Compares vertices, boundary edges and islands of a primitive with those of its source."""

from __future__ import annotations

from dataclasses import dataclass

from gltf_ext._joinable import topology
from gltf_ext.attributes.join import decode_view
from gltf_ext.attributes.records import RecordFormat
from gltf_ext.sources.source import Source


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
    source: Source, record_format: RecordFormat, view: bytes | memoryview, source_vertices: int
) -> tuple[Topology, Topology]:
    """Return the topology of a source in memory, and of what its view decodes to.

    Equal vertices of the source are one; triangles that have a vertex twice do not count. Raises
    ValueError.
    """
    before = record_format.vertices_of(record_format.triangles_of(source))
    triangles, values = decode_view(view, source_vertices)
    return (
        Topology(**topology(before.triangles, len(before.records))),
        Topology(**topology(triangles, len(values[0]))),
    )


def difference(before: Topology, after: Topology) -> str:
    """Say what differs; empty for nothing."""
    pairs = zip(vars(before).items(), vars(after).values())
    changes = [f"{a:,} {name.replace('_', ' ')} became {b:,}" for (name, a), b in pairs if a != b]
    return ", ".join(changes)

"""Vertices that were one in the source, and the topology of triangles, by the codec."""

from __future__ import annotations

from ctypes import byref, c_uint32
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gltf_ext._library import Topology, UInt32s, Vertices, array_of, functions, pointers


@dataclass
class Joinable:
    """Decoded triangles with what tells which vertices were one in the source.

    Attributes:
        triangles: uint32[T, 3]; integers: uint32[V, elements] per stream.
        first_vertices: uint64: of each blob.
        shared: uint32[V]: each vertex, or an earlier one that has its position by a reference; None
            if that is not known.
    """

    triangles: UInt32s
    integers: list[UInt32s]
    first_vertices: NDArray[np.uint64]
    shared: UInt32s | None = None

    def join(self, source_vertices: int) -> tuple[UInt32s, int]:
        """Find the vertices of the source.

        source_vertices: how many it had, 0 if that is not known.

        Returns (uint32[V]: their numbers, equal for one vertex, in order of first occurrence; how
        many there are).
        """
        count = len(self.integers[0])
        numbers, different = np.empty(count, np.uint32), c_uint32()
        integers = [array_of(i, np.uint32, count, -1) for i in self.integers]
        arrays = {
            "triangles": array_of(self.triangles, np.uint32, -1, 3),
            "integers": pointers(integers),
            "elements": np.array([i.shape[1] for i in integers], np.uint32),
            "first_vertices": array_of(self.first_vertices, np.uint64, -1),
        }
        if self.shared is not None:
            arrays["shared"] = array_of(self.shared, np.uint32, count)
        counts = {
            "stream_count": len(integers),
            "triangle_count": len(self.triangles),
            "vertex_count": count,
            "page_count": len(self.first_vertices),
            "source_vertices": source_vertices,
        }
        functions.join_vertices(Vertices(**arrays, **counts), numbers.ctypes, byref(different))
        return numbers, different.value


def topology(triangles: UInt32s, vertex_count: int) -> dict[str, int]:
    """Count vertices of triangles uint32[T, 3], boundary edges (of one triangle), and islands."""
    triangles, counts = array_of(triangles, np.uint32, -1, 3), Topology()
    functions.get_topology(triangles.ctypes, len(triangles), vertex_count, counts)
    return {name: getattr(counts, name) for name in ("vertices", "boundary_edges", "islands")}

"""A primitive on its grid, as the builder of levels sees it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from gltf_ext.lod.corners import Choices
from gltf_ext.ranges import first_of_each, has_repeats


@dataclass
class Surface:
    """Triangles whose vertices lie on a grid.

    Attributes:
        triangles: uint32[T, 3], without repeated corners.
        points: float32[V, 3], integers: positions on the grid.
        position_ids: uint32[V], equal where points are.
        canonical_vertices: uint32[V]: the same vertex for all vertices that are equal in all
            quantised values, or that edges of length zero connect.
        seam_points: float32[V, 3]: `points`, moved apart where only the grid joins vertices.
        attributes, weights: float32[V, A], float32[A]: values that count in the choice of edges,
            beside positions.
        morph_points: float32[V, 3] for each morph target: points with the target at weight 1.
        is_locked: bool[V]: vertices that simplification keeps, equal where points are; None for
            no vertex.
        choices: which vertices may stand for each other; None without normals.
    """

    triangles: np.ndarray
    points: np.ndarray
    position_ids: np.ndarray
    canonical_vertices: np.ndarray
    seam_points: np.ndarray
    attributes: np.ndarray
    weights: np.ndarray
    morph_points: list[np.ndarray] = field(default_factory=list)
    is_locked: np.ndarray | None = None
    choices: Choices | None = None

    @cached_property
    def vertex_of_position(self) -> np.ndarray:
        """The first vertex at each position, by its id: uint32[P]."""
        return first_of_each(self.position_ids, int(self.position_ids.max()) + 1)

    def is_degenerate(self, triangles: np.ndarray) -> np.ndarray:
        """Return bool[T]: whether two corners of a triangle, uint32[T, 3], share a position."""
        return has_repeats(self.position_ids[triangles])


def longest_side(points: np.ndarray) -> float:
    """Return the longest side of the box around points, [N, C]."""
    return float(np.ptp(points, axis=0).max())

"""A primitive on its grid, as the builder of levels sees it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np


@dataclass
class Surface:
    """Triangles whose vertices lie on a grid.

    Attributes:
        triangles: uint32[T, 3], no vertex twice in one.
        points: float32[V, 3], integers: positions on the grid.
        position_ids: uint32[V], equal where points are.
        canonical: uint32[V]: one vertex for all that are equal in all quantised values, and for
            all that edges without length join.
        apart: float32[V, 3]: points, but different where only the grid made vertices equal.
        attributes, weights: float32[V, A] and float32[A], for the choice of edges.
        morphed: points with each morph target at weight 1, float32[V, 3].
        fixed: bool[V] or None: vertices that stay, equal where points are.
    """

    triangles: np.ndarray
    points: np.ndarray
    position_ids: np.ndarray
    canonical: np.ndarray
    apart: np.ndarray
    attributes: np.ndarray
    weights: np.ndarray
    morphed: list[np.ndarray] = field(default_factory=list)
    fixed: np.ndarray | None = None

    @cached_property
    def vertex_at(self) -> np.ndarray:
        """uint32[P]: one vertex of each position, by its id."""
        ids = self.position_ids[::-1]
        found = np.zeros(int(ids.max()) + 1, np.uint32)
        found[ids] = np.arange(len(ids) - 1, -1, -1, dtype=np.uint32)
        return found

    def is_flat(self, triangles: np.ndarray) -> np.ndarray:
        """bool[T]: whether a triangle has two corners at one position."""
        a, b, c = self.position_ids[triangles].T
        flat: np.ndarray = (a == b) | (b == c) | (c == a)
        return flat


def longest_side(points: np.ndarray) -> float:
    """Of the box around points, [N, C]."""
    return float(np.ptp(points, axis=0).max())

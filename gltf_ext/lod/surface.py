"""A primitive on its grid, as the builder of levels sees it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Choices:
    """Vertices that may stand for each other at a corner of a level.

    Attributes:
        place: uint32[V]: equal for vertices that differ in normals, tangents, texture coordinates
            and colours only.
        normals: float32[V, 3], of length one or zero.
        others: float32[V, A]: texture coordinates and colours in a box of size 1.
    """

    place: np.ndarray
    normals: np.ndarray
    others: np.ndarray


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


def longest_side(points: np.ndarray) -> float:
    """Return the longest side of the box around points, [N, C]."""
    return float(np.ptp(points, axis=0).max())


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors, [N, 3], with length one; zeros stay."""
    length = np.sqrt((vectors * vectors).sum(axis=1, keepdims=True))
    result: np.ndarray = vectors / np.where(length > 0.0, length, 1.0)
    return result


def face_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return float64[T, 3]: unit normals of triangles, zero for those without area."""
    corners = points[triangles].astype(np.float64)
    (a, b, c), (d, e, f) = (corners[:, 1:] - corners[:, :1]).transpose(1, 2, 0)
    # np.cross takes twice as long for small meshes.
    return unit(np.stack([b * f - c * e, c * d - a * f, a * e - b * d], axis=1))

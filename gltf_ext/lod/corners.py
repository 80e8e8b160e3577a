"""Corners of replacements choose among the vertices of level 0 at their positions.

The simplifier leaves each corner the vertex of the edge that it collapsed, and one vertex of each
position where seams are ignored. Another vertex there, of the other side of a seam or a hard edge,
may have the normal and the texture coordinates that the corner's triangle needs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gltf_ext.lod.nearest import nearest_weights
from gltf_ext.ranges import begins, members, occurring

# Corners are compared with level 0 at the middle of their triangle: at a corner itself, all sides
# of a seam or a hard edge are equally near.
NORMAL_WEIGHT = 0.25  # beside other values, in a box of size 1
FLIPPED = 10.0  # cost of a normal that points against the triangle: more than all others
# A triangle goes to the side of a seam that its middle is nearest to if its corners then are nearer
# to what level 0 has there by this factor, all three: corners on two sides would stretch a texture.
OTHER_SIDE = 0.5
# Another vertex must be better than this: as five degrees between normals. Otherwise corners of
# triangles that are neighbours would part for nothing.
CHANGE = 0.0005
SPARE = 5.0  # cost of a vertex that level 0 joins with another: only where all others are flipped
OUTSIDE = 2.0  # errors of the surface that a point outside is away

Nearest = Callable[[np.ndarray], np.ndarray]


@dataclass
class Choices:
    """Vertices that may stand for each other at a corner.

    Attributes:
        place: uint32[V]: equal for vertices that differ in normals, tangents, texture coordinates
            and colours only.
        begin, vertices: int64[P + 1], uint32[N]: the vertices of level 0 at each place.
        is_canonical: bool[V].
        normals: float32[V, 3], of length one or zero.
        others: float32[V, A]: texture coordinates and colours in a box of size 1.
    """

    place: np.ndarray
    begin: np.ndarray
    vertices: np.ndarray
    is_canonical: np.ndarray
    normals: np.ndarray
    others: np.ndarray

    @classmethod
    def of(
        cls,
        place: np.ndarray,
        triangles: np.ndarray,
        canonical_vertices: np.ndarray,
        normals: np.ndarray,
        others: np.ndarray,
    ) -> Choices:
        """Return the choices between the vertices of level 0.

        Args:
            place: as the attribute.
            triangles: uint32[T, 3].
            canonical_vertices: uint32[V], as in Surface.
            normals: as the attribute.
            others: as the attribute.
        """
        used = occurring(triangles, len(place))
        counts = np.bincount(place[used], minlength=int(place.max()) + 1)
        vertices = used[np.argsort(place[used], kind="stable")]
        is_canonical = canonical_vertices == np.arange(len(place))
        return cls(place, begins(counts), vertices, is_canonical, normals, others)

    @property
    def guard(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places, begins and normals, as the simplifier's guard takes them."""
        return self.place, self.begin.astype(np.uint32), self.normals[self.vertices]

    def candidates(self, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (int64: index in `vertices`; uint32: a candidate for it), index after index."""
        places = self.place[vertices]
        counts = np.diff(self.begin)[places]
        owners = np.repeat(np.arange(len(vertices)), counts)
        return owners, self.vertices[members(self.begin, places)]


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


def choose_vertices(
    choices: Choices,
    points: np.ndarray,
    triangles: np.ndarray,
    errors: np.ndarray,
    nearest: Nearest,
) -> np.ndarray:
    """Return triangles with the vertices that fit them best at the same positions.

    Args:
        choices: the vertices of level 0.
        points: float32[V, 3]: their positions.
        triangles: uint32[T, 3].
        errors: float64[T]: by how much each triangle may be off the surface of level 0.
        nearest: from points, float32[N, 3], to the nearest triangles of level 0, uint32[N, 3].
    """
    is_open = (np.diff(choices.begin)[choices.place[triangles]] > 1).any(axis=1)
    if not is_open.any():
        return triangles
    some, level_0 = triangles[is_open], _Level0(choices, points, nearest)
    faces, corners = face_normals(points, some), some.reshape(-1)
    owner, candidate = choices.candidates(corners)
    middles = points[some].astype(np.float64).mean(axis=1)
    normals, others, is_away = level_0.at(middles, faces, errors[is_open])
    triangle = owner // 3
    targets = choices.others[corners].reshape(len(some), 3, -1)
    if others.shape[1]:
        sides = _best(owner, _squared(choices.others[candidate] - others[triangle]))
        best = choices.others[candidate[sides]].reshape(targets.shape)
        off, best_off = (np.abs(v - others[:, None]).max(axis=(1, 2)) for v in (targets, best))
        is_other_side = ~is_away & (best_off < OTHER_SIDE * off)
        targets[is_other_side] = best[is_other_side]
    cost = NORMAL_WEIGHT**2 * _squared(choices.normals[candidate] - normals[triangle])
    cost += _squared(choices.others[candidate] - targets.reshape(len(corners), -1)[owner])
    cost += FLIPPED * ((choices.normals[candidate] * faces[triangle]).sum(axis=1) < 0.0)
    cost += SPARE * ~choices.is_canonical[candidate]
    cost -= CHANGE * (candidate == corners[owner])
    result: np.ndarray = triangles.copy()
    result[is_open] = candidate[_best(owner, cost)].reshape(-1, 3)
    return result


def _squared(vectors: np.ndarray) -> np.ndarray:
    lengths: np.ndarray = (vectors * vectors).sum(axis=1)
    return lengths


def _best(owner: np.ndarray, cost: np.ndarray) -> np.ndarray:
    """Return int64: the index of the cheapest candidate of each owner. owner: ascending."""
    order = np.lexsort([cost, owner])
    best: np.ndarray = order[np.flatnonzero(np.diff(owner[order], prepend=-1))]
    return best


@dataclass
class _Level0:
    """Level 0, to look up what it has near replacements; as the arguments of choose_vertices."""

    choices: Choices
    points: np.ndarray
    nearest: Nearest

    def at(
        self, places: np.ndarray, faces: np.ndarray, errors: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return normals and other values near some places, and where level 0 faces away.

        A thin part has two sides: where the nearest one faces away, the side that is nearest to a
        point outside counts. Where that faces away, too, the normal is that of the place.

        Args:
            places: float64[N, 3].
            faces: float64[N, 3]: normals of the triangles there.
            errors: float64[N]: by how much they may be off.
        """
        nearest_triangles = self.nearest(places.astype(np.float32))
        is_away = (face_normals(self.points, nearest_triangles) * faces).sum(axis=1) < 0.0
        if is_away.any():
            outside = places[is_away] + OUTSIDE * errors[is_away, None] * faces[is_away]
            nearest_triangles[is_away] = self.nearest(outside.astype(np.float32))
            is_away = (face_normals(self.points, nearest_triangles) * faces).sum(axis=1) < 0.0
        weights = nearest_weights(places, self.points[nearest_triangles].astype(np.float64))
        normals = unit(np.einsum("nk,nkc->nc", weights, self.choices.normals[nearest_triangles]))
        normals[is_away] = faces[is_away]
        return (
            normals,
            np.einsum("nk,nkc->nc", weights, self.choices.others[nearest_triangles]),
            is_away,
        )

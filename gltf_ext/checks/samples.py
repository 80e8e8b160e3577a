"""Points on surfaces, and how far two surfaces are apart there: in space, normals and texcoords."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.details import areas_of
from gltf_ext.sources.attribute_names import semantic
from gltf_ext.sources.primitives import Primitive

# Of the samples for distances, of which the largest counts, a share is enough for the median and
# the 95th percentile of shading, but not fewer than so many.
SHADING_SHARE, LEAST_SHADING = 8, 1_000


@dataclass(frozen=True)
class SurfacePoints:
    """Points on triangles.

    triangle: int64[N]; weights: float64[N, 3], of the corners, with sum 1.
    """

    triangle: np.ndarray
    weights: np.ndarray

    def of(self, primitive: Primitive, attribute: str) -> np.ndarray:
        """Return float64[N, C]: the attribute at the points."""
        corners = primitive.indices[self.triangle]
        values = primitive.attributes[attribute][corners].astype(np.float64)
        result: np.ndarray = np.einsum("nk,nkc->nc", self.weights, values)
        return result


def spread_by_area(primitive: Primitive, samples: int) -> SurfacePoints:
    """Return points spread by area, the same ones each time; one on a surface without area."""
    random = np.random.default_rng(0)
    sums = np.cumsum(
        areas_of(primitive.attributes["POSITION"].astype(np.float64)[primitive.indices])
    )
    if not len(sums) or not sums[-1] > 0.0:
        return SurfacePoints(np.zeros(1, np.int64), np.array([[1.0, 0.0, 0.0]]))
    # In the order of triangles: the search for the nearest one begins at the last, and takes a
    # third of the time on dragon, which has 871,306.
    triangle = np.searchsorted(sums / sums[-1], np.sort(random.random(samples)), "right")
    u, v = random.random(samples), random.random(samples)
    beyond = u + v > 1.0
    u[beyond], v[beyond] = 1.0 - u[beyond], 1.0 - v[beyond]
    return SurfacePoints(triangle, np.stack([1.0 - u - v, u, v], axis=1))


def sample_surface(primitive: Primitive, samples: int) -> np.ndarray:
    """Return float32[samples, 3]: points spread by area, the same ones each time."""
    return spread_by_area(primitive, samples).of(primitive, "POSITION").astype(np.float32)


def distances_to(points: np.ndarray, primitive: Primitive) -> np.ndarray:
    """Return float32[N]: distances of points, float32[N, 3], to a surface."""
    return _nearest_triangles(points, primitive)[0]


def nearest_points(points: np.ndarray, primitive: Primitive) -> tuple[np.ndarray, SurfacePoints]:
    """Return (float32[N]: distances of points, float32[N, 3], to a surface; the nearest ones)."""
    distances, triangle = _nearest_triangles(points, primitive)
    corners = _corners(primitive, triangle)
    return distances, SurfacePoints(triangle, _nearest_weights(points.astype(np.float64), corners))


def _nearest_triangles(points: np.ndarray, primitive: Primitive) -> tuple[np.ndarray, np.ndarray]:
    positions = primitive.attributes["POSITION"].astype(np.float32)
    return _codec.surface_distances(points, positions, primitive.indices)


def surface_distances(first: Primitive, second: Primitive, samples: int) -> np.ndarray:
    """Return float32[2 * samples]: distances of points on each surface to the other one."""
    pairs = ((first, second), (second, first))
    return np.concatenate(
        [distances_to(sample_surface(one, samples), other) for one, other in pairs]
    )


def shading_differences(
    surface: Primitive, original: Primitive, samples: int
) -> dict[str, np.ndarray]:
    """Return differences in shading at the nearest points of the original.

    Returns:
        Name -> float64[samples] for each set of normals (degrees) and texture coordinates (units of
        uv).
    """
    points = spread_by_area(surface, samples)
    _, nearest = nearest_points(points.of(surface, "POSITION").astype(np.float32), original)
    return _shading_at(points, surface, nearest, original)


def compare_surfaces(
    surface: Primitive, original: Primitive, original_points: np.ndarray, samples: int
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the results of surface_distances, and of shading_differences at fewer samples.

    Looks for the nearest triangles of the original once. original_points: sample_surface of it.
    """
    points = spread_by_area(surface, samples)
    places = points.of(surface, "POSITION").astype(np.float32)
    distances, triangle = _nearest_triangles(places, original)
    back = distances_to(original_points, surface)
    if not _shaded(original):
        return np.concatenate([back, distances]), {}
    count = min(max(LEAST_SHADING, len(places) // SHADING_SHARE), len(places))
    some = np.arange(count) * len(places) // count  # all over the surface
    of_some = SurfacePoints(points.triangle[some], points.weights[some])
    corners = _corners(original, triangle[some])
    weights = _nearest_weights(places[some].astype(np.float64), corners)
    nearest = SurfacePoints(triangle[some], weights)
    return np.concatenate([back, distances]), _shading_at(of_some, surface, nearest, original)


def _shading_at(
    surface_points: SurfacePoints, surface: Primitive, nearest: SurfacePoints, original: Primitive
) -> dict[str, np.ndarray]:
    """Return the differences of shading_differences between points of two surfaces."""
    differences = {}
    for name in _shaded(original):
        a, b = surface_points.of(surface, name), nearest.of(original, name)
        if semantic(name) == "TEXCOORD":
            differences[name] = np.linalg.norm(a - b, axis=1)
        else:
            crossed = np.linalg.norm(np.cross(a, b), axis=1)
            differences[name] = np.degrees(np.arctan2(crossed, (a * b).sum(axis=1)))
    return differences


def _shaded(primitive: Primitive) -> list[str]:
    """Return the names of normals and texture coordinates."""
    names = primitive.attributes
    return [name for name in names if name == "NORMAL" or semantic(name) == "TEXCOORD"]


def _corners(primitive: Primitive, triangles: np.ndarray) -> np.ndarray:
    """Return float64[N, 3, 3]: the positions of the triangles' corners."""
    positions = primitive.attributes["POSITION"]
    corners: np.ndarray = positions[primitive.indices[triangles]].astype(np.float64)
    return corners


def _nearest_weights(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return float64[N, 3]: corner weights of the nearest point of each triangle, [N, 3, 3].

    Tries the three edges and the projection into the triangle, so that degenerate ones need no
    cases of their own.
    """
    best = np.full(len(points), np.inf)
    weights = np.zeros((len(points), 3))

    def offer(candidate: np.ndarray, is_valid: np.ndarray) -> None:
        apart = np.einsum("nk,nkc->nc", candidate, corners) - points
        distance = _dot(apart, apart)
        better = is_valid & (distance < best)
        best[better], weights[better] = distance[better], candidate[better]

    for k in range(3):
        a, b = corners[:, k], corners[:, (k + 1) % 3]
        length = _dot(b - a, b - a)
        along = _dot(points - a, b - a) / np.where(length > 0.0, length, 1.0)
        candidate = np.zeros((len(points), 3))
        candidate[:, (k + 1) % 3] = along.clip(0.0, 1.0)
        candidate[:, k] = 1.0 - candidate[:, (k + 1) % 3]
        offer(candidate, np.ones(len(points), bool))
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = _dot(normal, normal)
    inside = np.stack(
        [
            _dot(np.cross(q - p, points - p), normal) / np.where(area > 0.0, area, 1.0)
            for p, q in ((b, c), (c, a), (a, b))
        ],
        axis=1,
    )
    offer(inside, (area > 0.0) & (inside >= 0.0).all(axis=1))
    return weights


def _dot(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return float64[N]: the dot products of vectors, [N, 3]."""
    result: np.ndarray = np.einsum("nc,nc->n", first, second)
    return result

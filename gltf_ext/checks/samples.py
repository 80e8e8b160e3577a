"""Points on surfaces, and how far two surfaces are apart there: in space and in shading."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.details import areas_of
from gltf_ext.lod.surface import face_normals
from gltf_ext.sources.attribute_names import semantic
from gltf_ext.sources.primitives import Primitive

# Of the samples for distances, of which the largest counts, a share is enough for the median and
# the 95th percentile of shading, but not fewer than so many.
SHADING_SHARE, LEAST_SHADING = 8, 1_000
SHADED = ("TEXCOORD", "COLOR")
# Errors of the surface by which a point is moved outside of it: then the side of a thin part that
# faces the same way is the nearer one.
OUTSIDE = 2.0


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
    return distances, SurfacePoints(
        triangle, _codec.nearest_weights(points.astype(np.float64), corners)
    )


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
        Name -> float64[samples] for normals (degrees), texture coordinates (units of uv) and
        colours (the largest of a component).
    """
    points = spread_by_area(surface, samples)
    _, nearest = nearest_points(points.of(surface, "POSITION").astype(np.float32), original)
    return _shading_at(points, surface, nearest, original)


def compare_surfaces(
    surface: Primitive,
    original: Primitive,
    original_points: np.ndarray,
    samples: int,
    error: float = 0.0,
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the results of surface_distances, and of shading_differences at fewer samples.

    Looks for the nearest triangles of the original once. Where the nearest one faces away, shading
    is compared with the one that is nearest to a point outside of the surface: thin parts have two
    sides.

    Args:
        surface: that is compared.
        original: with the expected shading.
        original_points: sample_surface of the original.
        samples: number of points on the surface.
        error: by how much the surface may be off.
    """
    points = spread_by_area(surface, samples)
    places = points.of(surface, "POSITION").astype(np.float32)
    back = distances_to(original_points, surface)
    if not _shaded(original):
        return np.concatenate([back, _nearest_triangles(places, original)[0]]), {}
    count = min(max(LEAST_SHADING, len(places) // SHADING_SHARE), len(places))
    some = np.arange(count) * len(places) // count  # all over the surface
    of_some = SurfacePoints(points.triangle[some], points.weights[some])
    positions = surface.attributes["POSITION"], original.attributes["POSITION"]
    faces = face_normals(positions[0], surface.indices[of_some.triangle])
    outside = (places[some] + OUTSIDE * error * faces).astype(np.float32)
    distances, triangle = _nearest_triangles(np.concatenate([places, outside]), original)
    both_ways = np.concatenate([back, distances[: len(places)]])
    nearest = triangle[some]
    is_away = (face_normals(positions[1], original.indices[nearest]) * faces).sum(axis=1) < 0.0
    nearest[is_away] = triangle[len(places) :][is_away]
    weights = _codec.nearest_weights(places[some].astype(np.float64), _corners(original, nearest))
    return both_ways, _shading_at(of_some, surface, SurfacePoints(nearest, weights), original)


def _shading_at(
    surface_points: SurfacePoints, surface: Primitive, nearest: SurfacePoints, original: Primitive
) -> dict[str, np.ndarray]:
    """Return the differences of shading_differences between points of two surfaces."""
    differences = {}
    for name in _shaded(original):
        a, b = surface_points.of(surface, name), nearest.of(original, name)
        if semantic(name) == "TEXCOORD":
            differences[name] = np.linalg.norm(a - b, axis=1)
        elif semantic(name) == "COLOR":
            differences[name] = np.abs(a - b).max(axis=1)
        else:
            crossed = np.linalg.norm(np.cross(a, b), axis=1)
            differences[name] = np.degrees(np.arctan2(crossed, (a * b).sum(axis=1)))
    return differences


def _shaded(primitive: Primitive) -> list[str]:
    """Return the names of normals, texture coordinates and colours."""
    return [name for name in primitive.attributes if name == "NORMAL" or semantic(name) in SHADED]


def _corners(primitive: Primitive, triangles: np.ndarray) -> np.ndarray:
    """Return float64[N, 3, 3]: the positions of the triangles' corners."""
    positions = primitive.attributes["POSITION"]
    corners: np.ndarray = positions[primitive.indices[triangles]].astype(np.float64)
    return corners

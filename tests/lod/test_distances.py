"""Distances to triangles, beside each triangle by itself in float64."""

from __future__ import annotations

import numpy as np
import pytest

from gltf_ext import _codec


def to_segment(p, a, b):
    along = b - a
    length = float(along @ along)
    share = np.clip((p - a) @ along / length, 0, 1)[:, None] if length else 0.0
    return np.linalg.norm(p - (a + share * along), axis=1)


def to_triangle(p, a, b, c):
    """float64[N]: distances of points, by the edges and by the plane."""
    edges = [to_segment(p, *ends) for ends in ((a, b), (b, c), (c, a))]
    result = np.min(edges, axis=0)
    normal = np.cross(b - a, c - a)
    if normal @ normal > 1e-9:
        sides = [(p - s) @ np.cross(normal, e - s) for s, e in ((a, b), (b, c), (c, a))]
        inside = np.min(sides, axis=0) >= 0
        height = np.abs((p - a) @ normal) / np.linalg.norm(normal)
        result = np.where(inside, height, result)
    return result


@pytest.mark.parametrize("count", [1, 2, 4, 5, 17, 64, 65, 300])
def test_distances_are_those_of_the_nearest_triangle(count):
    random = np.random.default_rng(count)
    positions = random.uniform(0, 10, (3 * count, 3)).astype(np.float32)
    triangles = np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)
    triangles[::7, 2] = triangles[::7, 0]  # a line
    triangles[::11] = triangles[::11, :1]  # a point
    inside = positions[triangles].mean(axis=1)
    points = np.concatenate([random.uniform(-5, 15, (200, 3)), inside, positions])
    points = points.astype(np.float32)
    found, nearest = _codec.surface_distances(points, positions, triangles, threads=1)
    exact = positions.astype(np.float64)[triangles]
    distances = np.array([to_triangle(points.astype(np.float64), *t) for t in exact])
    np.testing.assert_allclose(found, distances.min(axis=0), rtol=1e-4, atol=2e-3)
    at_nearest = distances[nearest, np.arange(len(points))]
    np.testing.assert_allclose(at_nearest, distances.min(axis=0), rtol=1e-4, atol=2e-3)

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
    dense = np.linspace(*random.uniform(-5, 15, (2, 3)), 2000)  # most have the nearest one before
    points = np.concatenate([random.uniform(-5, 15, (200, 3)), inside, positions, dense])
    points = points.astype(np.float32)
    found, nearest = _codec.surface_distances(points, positions, triangles, threads=1)
    exact = positions.astype(np.float64)[triangles]
    distances = np.array([to_triangle(points.astype(np.float64), *t) for t in exact])
    np.testing.assert_allclose(found, distances.min(axis=0), rtol=1e-4, atol=2e-3)
    at_nearest = distances[nearest, np.arange(len(points))]
    np.testing.assert_allclose(at_nearest, distances.min(axis=0), rtol=1e-4, atol=2e-3)
    near, _ = _codec.surface_distances(points, positions, triangles, enough=1.0, threads=1)
    np.testing.assert_array_equal(near > 1.0, found > 1.0)
    np.testing.assert_array_equal(near[near > 1.0], found[near > 1.0])


@pytest.mark.parametrize("height", [0.5, 20.0, 2000.0])
def test_slivers_keep_their_distances(height):
    """Long triangles on a fine grid, as in coarse levels of large models: doubles are needed."""
    random = np.random.default_rng(7)
    starts, turns = random.uniform(0, 65535, (40, 1, 3)), random.normal(size=(40, 2, 3))
    along, across = np.split(
        np.linalg.qr(turns.transpose(0, 2, 1))[0].transpose(0, 2, 1), 2, axis=1
    )
    place = random.uniform(0, 1, (40, 1, 1))
    corners = starts + np.concatenate(
        [0 * along, 80000 * along, 80000 * place * along + height * across], axis=1
    )
    positions = corners.reshape(-1, 3).astype(np.float32)
    weights = random.dirichlet([1, 1, 1], (40, 50))
    exact = positions.astype(np.float64).reshape(-1, 3, 3)
    points = np.einsum("twk,tkx->twx", weights, exact) + random.normal(size=(40, 50, 3))
    points = points.reshape(-1, 3).astype(np.float32)
    triangles = np.arange(len(positions), dtype=np.uint32).reshape(-1, 3)
    found, _ = _codec.surface_distances(points, positions, triangles, threads=1)
    distances = np.min([to_triangle(points.astype(np.float64), *t) for t in exact], axis=0)
    np.testing.assert_allclose(found, distances, atol=0.05)

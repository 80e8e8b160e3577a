"""bench.quality: distances between surfaces, beside those by hand and by brute force."""

import numpy as np
import pytest

from bench import quality

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def test_point_and_triangle_by_hand():
    corners = np.tile(np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0]], float), (5, 1, 1))
    points = np.array([[0.5, 0.5, 3], [-1, 0.5, 0], [3, -1, 0], [2, 2, 0], [0.5, 0.5, 0]], float)
    assert quality.distances_to_triangles(points, corners) == pytest.approx(
        [3, 1, 2**0.5, 2**0.5, 0]
    )


def test_triangle_without_area_is_its_edges():
    corners = np.array([[[0, 0, 0], [1, 0, 0], [3, 0, 0]], [[1, 1, 1]] * 3], float)
    assert quality.distances_to_triangles(
        np.array([[2, 0, 5], [1, 1, 3]], float), corners
    ) == pytest.approx([5, 2])


def test_distance_to_a_surface_is_that_to_its_nearest_triangle():
    random = np.random.default_rng(5)
    positions = random.uniform(-1, 1, (300, 3)) * random.choice(
        [1, 0.01], (300, 1)
    )  # large and small triangles
    triangles = random.integers(0, 300, (150, 3))
    triangles = triangles[(np.diff(np.sort(triangles, axis=1), axis=1) > 0).all(axis=1)]
    points = random.uniform(-1.2, 1.2, (200, 3))
    every = [
        quality.distances_to_triangles(
            np.tile(point, (len(triangles), 1)), positions[triangles]
        ).min()
        for point in points
    ]
    assert quality.Surface(positions, triangles).distances(points) == pytest.approx(every)


def test_distance_between_surfaces_goes_both_ways():
    lifted = quality.surface_distance(
        quality.Surface(SQUARE, TRIANGLES),
        quality.Surface(SQUARE + np.array([0, 0, 0.25]), TRIANGLES),
    )
    assert lifted == pytest.approx({"hausdorff": 0.25, "rms": 0.25})
    half = quality.Surface(SQUARE, TRIANGLES[:1])  # the other half's far corner is sqrt(1/2) away
    assert quality.surface_distance(half, quality.Surface(SQUARE, TRIANGLES))[
        "hausdorff"
    ] == pytest.approx(0.5**0.5)


def test_rendered_difference_by_hand():
    black, grey = np.zeros((2, 2, 3)), np.full((2, 2, 3), 25.5)
    assert quality.rendered_difference(black, grey) == pytest.approx(
        {"psnr": 20, "mean": 25.5, "largest": 25.5}
    )
    assert quality.rendered_difference(black, black)["psnr"] is None

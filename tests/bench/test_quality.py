"""bench.quality: distances between surfaces, beside those by hand."""

import numpy as np
import pytest

from bench import quality
from tools.rasterizer import Mesh

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def mesh(positions: np.ndarray, triangles: np.ndarray) -> Mesh:
    return Mesh(positions, positions, triangles, np.ones((len(triangles), 3)))


def test_distance_between_surfaces_goes_both_ways():
    lifted = quality.surface_distance(
        mesh(SQUARE, TRIANGLES), mesh(SQUARE + np.array([0, 0, 0.25]), TRIANGLES)
    )
    assert lifted == pytest.approx({"hausdorff": 0.25, "rms": 0.25})
    half = mesh(SQUARE, TRIANGLES[:1])  # the other half's far corner is sqrt(1/2) away
    distance = quality.surface_distance(half, mesh(SQUARE, TRIANGLES))
    assert distance["hausdorff"] == pytest.approx(0.5**0.5)


def test_rendered_difference_by_hand():
    black, grey = np.zeros((2, 2, 3)), np.full((2, 2, 3), 25.5)
    assert quality.rendered_difference(black, grey) == pytest.approx(
        {"psnr": 20, "mean": 25.5, "largest": 25.5}
    )
    assert quality.rendered_difference(black, black)["psnr"] is None

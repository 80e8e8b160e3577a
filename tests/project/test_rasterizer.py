"""The rasteriser for pictures of the documentation."""

import numpy as np
import pytest

from tools.rasterizer import Camera, Mesh, rasterize


def test_rasterizer_draws_the_nearer_of_two_squares():
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    positions = np.concatenate([square, square * 0.5 + [0, 0, 1]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    colors = np.array([[1, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]], float)
    mesh = Mesh(positions, np.tile([0.0, 0.0, 1.0], (8, 1)), triangles, colors)
    picture = rasterize(mesh, Camera(eye=(0, 0, 6), target=(0, 0, 0), field_of_view=30), 90, 60)
    assert picture.shape == (60, 90, 4)
    assert picture[30, 45, 1] > 0 and picture[30, 45, 0] == 0, "the green square is in front"
    assert picture[30, 45 + 15, 0] > 0 and picture[30, 45 + 15, 1] == 0, (
        "the red square stands out behind it"
    )
    assert picture[2, 2, 3] == 0 and picture[30, 2, 3] == 0, "nothing is drawn beside them"
    covered = picture[..., 3].sum() / 255
    side = 60 / (2 * np.tan(np.radians(15)) * 6) * 2
    assert covered == pytest.approx(side * side, rel=0.02), (
        "the picture's size follows from the camera"
    )

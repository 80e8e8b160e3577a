"""Polygons as triangles: their number, direction and area."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gltf_ext import _codec
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.source import read_primitive


def areas(points, triangles):
    """float64[T, 3]: twice the area of each triangle, along its normal."""
    a, b, c = np.float64(points)[triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def newell(points):
    """Twice the area of a polygon, along its normal."""
    p = np.float64(points)
    return np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)


def check(points, exact=True):
    """The triangles of a polygon that does not cross itself have its area, and turn as it does."""
    points = np.float32(points)
    triangles = _codec.triangulate(points, np.array([len(points)]))
    assert len(triangles) == len(points) - 2
    assert set(triangles.ravel().tolist()) == set(range(len(points)))
    whole, parts = newell(points), areas(points, triangles)
    length = np.linalg.norm(whole)
    along = parts @ (whole / length)
    assert along.min() >= -1e-6 * length
    if exact:
        assert np.linalg.norm(parts, axis=1).sum() == pytest.approx(length, rel=1e-5)
    return triangles


FLAT = np.float64([[1, 0, 0], [0, 1, 0]])
TILTED = np.float64([[0.48, 0.6, 0.64], [-0.8, 0.6, 0.0]])
DOWN = np.float64([[0, 0, 1], [-1, 0, 0]])
PLANES = {"flat": FLAT, "tilted": TILTED, "down": DOWN}
SHAPES = {
    "arrow": [(0, 0), (4, 0), (4, 4), (2, 1), (0, 4)],
    "dart": [(0, 0), (2, 1), (4, 0), (2, 4)],
    "dart, reflex first": [(2, 1), (4, 0), (2, 4), (0, 0)],
    "L": [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)],
    "T, corners on a line": [
        (0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (2, 1), (2, 3), (1, 3), (1, 1), (0, 1),
    ],
    "square with a hole": [
        (0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1),
    ],
    "spiral": [
        (0, 0), (7, 0), (7, 7), (1, 7), (1, 2), (5, 2), (5, 5), (3, 5), (3, 4), (4, 4), (4, 3),
        (2, 3), (2, 6), (6, 6), (6, 1), (0, 1),
    ],
    "comb": [(x / 2, 5 * (x % 2)) for x in range(40)] + [(19.5, -1), (0, -1)],
    "square with a corner on each edge": [
        (0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1),
    ],
}  # fmt: skip


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("turn", [1, -1])
def test_concave(shape, plane, turn):
    for first in range(len(SHAPES[shape])):
        corners = np.roll(np.float64(SHAPES[shape]), -first, axis=0)[::turn]
        check(corners @ PLANES[plane] * 0.5 + 3)


@given(
    st.lists(st.floats(0.1, 3), min_size=4, max_size=40),
    st.integers(0, 39),
    st.sampled_from(sorted(PLANES)),
)
@settings(deadline=None)
def test_stars(radii, first, plane):
    """Polygons around a point, with any distances of their corners."""
    angles = np.arange(len(radii)) * 2 * np.pi / len(radii)
    star = np.stack([np.cos(angles), np.sin(angles)], axis=1) * np.array(radii)[:, None]
    check(np.roll(star, first, axis=0) @ PLANES[plane])


@given(st.lists(st.floats(-1, 1), min_size=2, max_size=40), st.integers(0, 99))
@settings(deadline=None)
def test_mountains(heights, first):
    """A line with any heights over a base below it."""
    top = [(len(heights) - i, height) for i, height in enumerate(heights)]
    polygon = np.float64([(0, -2), (len(heights) + 1, -2), *top])
    check(np.roll(polygon, first, axis=0) @ FLAT)


def test_convex_polygons_are_fans():
    angles = np.arange(9) * 2 * np.pi / 9
    points = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    assert check(points).tolist() == [[0, i, i + 1] for i in range(1, 8)]


@given(
    st.lists(st.tuples(*[st.sampled_from([0.0, 1.0, 2.0, np.nan, np.inf, 1e30])] * 3), max_size=12)
)
@settings(deadline=None)
def test_any_points(points):
    """Polygons that cross or touch themselves, or are no numbers, have as many triangles."""
    sizes = np.array([len(points)])
    points = np.float32(points).reshape(-1, 3)
    triangles = _codec.triangulate(points, sizes)
    assert triangles.shape == (max(len(points) - 2, 0), 3)
    assert (triangles < max(len(points), 1)).all()
    assert all(len(set(triangle)) == 3 for triangle in triangles.tolist())


def test_many_polygons():
    """Sizes of all kinds, one polygon after the other; those of two corners have no triangles."""
    arrow, square = np.float32(SHAPES["arrow"]), np.float32([(0, 0), (1, 0), (1, 1), (0, 1)])
    parts = [square[:3], arrow, square[:2], square, arrow, square[:0], square]
    points = np.concatenate(parts) @ np.float32(FLAT)
    triangles = _codec.triangulate(points, np.array([len(part) for part in parts]))
    assert len(triangles) == sum(max(len(part) - 2, 0) for part in parts)
    assert areas(points, triangles)[:, 2].sum() / 2 == pytest.approx(0.5 + 2 * 10 + 2 * 1)


def test_long_polygons_take_little_time():
    """With all ears compared with all corners, this takes minutes."""
    comb = [(x, 5 * (x % 2)) for x in range(100_000)] + [(99_999, -1), (0, -1)]
    check(np.float64(comb) @ FLAT)


def test_polygons_that_touch_themselves_everywhere_end():
    draw = np.random.default_rng(3)
    points = draw.integers(0, 9, (20_000, 3)).astype(np.float32)
    assert len(_codec.triangulate(points, np.array([20_000]))) == 19_998


# --- of files ---

ARROW = "0 0 0\n4 0 0\n4 4 0\n2 1 0\n0 4 0\n"
PLY = (
    f"ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
    f"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n{ARROW}"
)


@pytest.mark.parametrize(
    "name, text",
    [
        ("a.obj", "v " + ARROW.strip().replace("\n", "\nv ") + "\nf 1 2 3 4 5\n"),
        ("a.obj", "f 1 2 3 4 5\nv " + ARROW.strip().replace("\n", "\nv ")),
        ("a.obj", "v " + ARROW.strip().replace("\n", "\nv ") + "\nf -5 -4 -3 -2 -1\n"),
        ("a.obj", "v " + ARROW.strip().replace("\n", "\nv ") + "\nvt 0\nf 5/1 1/1 2/1 3/1 4/1\n"),
        ("a.ply", PLY + "5 0 1 2 3 4\n"),
        ("a.ply", PLY + "5 3 4 0 1 2\n"),
    ],
)
def test_concave_polygons_of_files(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    primitive, _ = read_primitive(open_model(tmp_path / name), 0, 0)
    parts = areas(primitive.attributes["POSITION"], primitive.indices)
    assert len(parts) == 3 and np.abs(parts[:, 2]).sum() / 2 == 10

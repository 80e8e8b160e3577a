"""Corners of levels have normals that fit: the simplifier's guard, and the choice of vertices."""

import numpy as np
import pytest

import gltf_ext
from gltf_ext.checks.flips import flipped_corners
from gltf_ext.lod import simplifier
from gltf_ext.lod.corners import Choices, choose_vertices
from gltf_ext.sources.primitives import Primitive
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder, wavy_sheet

NEAREST = np.array([[0, 1, 2], [3, 5, 4]], np.uint32)  # of a fold: the floor and the wall


def fold(texcoords=False):
    """Two triangles that meet at a hard edge, whose two positions have a vertex of each side."""
    points = np.float32([[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 0], [4, 0, 0], [0, 0, 4]])
    normals = np.float32([[0, 0, 1]] * 3 + [[0, 1, 0]] * 3)
    others = np.repeat(np.float32([[0.1], [0.9]]), 3, axis=0) if texcoords else np.zeros((6, 0))
    place = np.array([0, 1, 2, 0, 1, 3], np.uint32)
    numbers = np.arange(6, dtype=np.uint32)
    choices = Choices.of(place, NEAREST, numbers, normals, others.astype(np.float32))
    return choices, points


def nearest(points):
    """The wall is nearer to points that are higher above the floor than they are off the wall."""
    return NEAREST[(points[:, 2] > points[:, 1]).astype(int)]


@pytest.mark.parametrize("texcoords", [False, True])
@pytest.mark.parametrize("spoilt", [[0, 5, 1], [3, 5, 1], [0, 5, 4]])
def test_corners_at_a_hard_edge_take_the_vertices_of_their_side(texcoords, spoilt):
    choices, points = fold(texcoords)
    triangles = np.array([spoilt, [3, 4, 2]], np.uint32)
    chosen = choose_vertices(choices, points, triangles, np.ones(2), nearest)
    assert chosen.tolist() == [[3, 5, 4], [0, 1, 2]]


def test_corners_that_fit_stay():
    choices, points = fold()
    chosen = choose_vertices(choices, points, NEAREST, np.ones(2), nearest)
    assert chosen.tolist() == NEAREST.tolist()


def rough_sheet(side=60):
    """(points, triangles, normals of the vertices) of a sheet that simplification turns over."""
    points, triangles = wavy_sheet(side)
    points[:, 2] += np.random.default_rng(3).normal(0.0, 0.3, len(points))
    points = np.rint(64 * points).astype(np.float32)  # on a grid
    corners = points[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(points)
    for k in range(3):
        np.add.at(normals, triangles[:, k], faces)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return points, triangles.astype(np.uint32), normals.astype(np.float32)


def need_guard():
    environment.need_package("meshoptimizer")
    if not hasattr(simplifier._library(), simplifier.GUARDED):
        environment.missing("the package meshoptimizer has no guard")


def test_the_guard_refuses_collapses_that_turn_triangles_over():
    need_guard()
    points, triangles, normals = rough_sheet()
    numbers = np.arange(len(points), dtype=np.uint32)
    guard = numbers, np.arange(len(points) + 1, dtype=np.uint32), normals
    rest = points, normals, np.full(3, 0.05, np.float32), np.zeros(len(points), np.uint8)

    def flips(triangles):
        attributes = {"POSITION": points, "NORMAL": normals}
        return int(flipped_corners(Primitive(0, 0, triangles, attributes)).sum())

    assert flips(triangles) == 0
    target = len(triangles) // 8
    free, _ = simplifier.simplify(triangles, *rest, target)
    guarded, _ = simplifier.simplify(triangles, *rest, target, guard=guard)
    assert flips(free) > 10
    assert flips(guarded) == 0 and len(guarded) <= 2 * len(free)


def test_levels_have_no_flipped_corners(tmp_path):
    need_guard()
    points, triangles, normals = rough_sheet(60)
    builder = Builder()
    builder.mesh({"POSITION": points, "NORMAL": normals}, triangles)
    source, output = builder.write(tmp_path / "in.glb"), tmp_path / "out.glb"
    gltf_ext.compress(source, output, lod=True, position_bits=14)
    report = gltf_ext.verify(source, output)
    assert len(report["levels"]) > 2
    assert [level["flipped_corners"] for level in report["levels"]] == [0] * len(report["levels"])
    assert not report["problems"] and not gltf_ext.validate(output)

"""Corners of levels have normals that fit: the simplifier's guard."""

import numpy as np
import pytest

import gltf_ext
from gltf_ext.lod import simplifier
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder, wavy_sheet


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


@pytest.fixture
def without_guard(monkeypatch):
    """As where the PyPI package has the functions."""
    environment.need_package("meshoptimizer")
    if not hasattr(simplifier.library(), simplifier.GUARDED):
        environment.missing("the package meshoptimizer has no guard")
    return lambda: monkeypatch.setattr(simplifier, "GUARDED", "not_inside")


def test_levels_have_no_flipped_corners(tmp_path, without_guard):
    points, triangles, normals = rough_sheet()
    builder = Builder()
    builder.mesh({"POSITION": points, "NORMAL": normals}, triangles)
    source, output = builder.write(tmp_path / "in.glb"), tmp_path / "out.glb"

    def flips():
        gltf_ext.compress(source, output, lod=True, position_bits=14)
        report = gltf_ext.verify(source, output)
        assert len(report["levels"]) > 2
        assert not report["problems"] and not gltf_ext.validate(output)
        return sum(level["flipped_corners"] for level in report["levels"])

    assert flips() == 0
    without_guard()
    assert flips() > 10

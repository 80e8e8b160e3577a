"""Stated errors beside measured ones."""

import numpy as np

import gltf_ext
from gltf_ext.lod import builder as levels
from gltf_ext.lod.errors import VERTEX_FRACTION, sample_weights
from gltf_ext.lod.surface import Surface
from gltf_ext.options import Options
from gltf_ext.ranges import members
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder, wavy_sheet


def test_weights_spread_points_evenly():
    weights = sample_weights(3000)
    assert weights.min() >= 0.0
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    # Each corner is the nearest one for a third of the points, and far for a quarter.
    np.testing.assert_allclose(np.bincount(weights.argmax(axis=1)) / 3000, 1 / 3, atol=0.01)
    np.testing.assert_allclose((weights > 0.5).mean(axis=0), 1 / 4, atol=0.01)


def test_stated_errors_of_a_noisy_scan_hold_and_are_close(tmp_path):
    environment.need_package("meshoptimizer")
    points, triangles = wavy_sheet(150)
    points = points + np.random.default_rng(0).normal(0.0, 0.3, points.shape)
    builder = Builder()
    builder.mesh({"POSITION": points.astype(np.float32)}, triangles)
    source, output = builder.write(tmp_path / "scan.glb"), tmp_path / "levels.glb"
    gltf_ext.compress(source, output, lod=True)
    for level in gltf_ext.verify(source, output)["levels"]:
        assert level["share_within"] >= 0.999, level
        assert level["stated_error"] <= 1.3 * level["measured_error"], level


def test_stated_errors_of_a_plane_hold(tmp_path):
    environment.need_package("meshoptimizer")
    points, triangles = wavy_sheet(200, height=0.0)
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles)
    source, output = builder.write(tmp_path / "plane.glb"), tmp_path / "levels.glb"
    gltf_ext.compress(source, output, lod=True, page_bytes=4096)
    assert gltf_ext.verify(source, output)["problems"] == []


def test_samples_stay_on_groups_of_level_0_that_are_stuck():
    """Half of a sheet is too rough for the limit."""
    environment.need_package("meshoptimizer")
    points, triangles = wavy_sheet(120, height=0.0)
    points[points[:, 0] > 60, 2] += 9 * np.random.default_rng(0).random((points[:, 0] > 60).sum())
    points = points.astype(np.float32)
    ids = np.arange(len(points), dtype=np.uint32)
    nothing = np.zeros((len(points), 0), np.float32), np.zeros(0, np.float32)
    surface = Surface(triangles, points, ids, ids, points, *nothing)
    builder = levels.Builder(surface, Options(), 48, 0.5, 5.0, 1)
    builder.add_level(may_end=False)
    assert builder.stuck_triangles[0] > 0
    ungrouped = members(builder.clusters.ranges.triangle_begin, builder.frontier)
    assert np.isin(builder.meter._sample_triangle_id, ungrouped).all()
    sides = np.diff(points[triangles], axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2
    assert area * (1 - VERTEX_FRACTION) <= 1.001 * builder.meter._sample_areas.sum() <= 1.01 * area

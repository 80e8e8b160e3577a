"""Stated errors beside measured ones."""

import numpy as np

import gltf_ext
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder, wavy_sheet


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

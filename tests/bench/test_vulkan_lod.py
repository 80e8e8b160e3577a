"""The scenes and the flight of bench.vulkan_lod."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest

import gltf_ext
from bench import vulkan_lod
from gltf_ext.sources.importers import open_model
from gltf_scene.scene import read_scene
from tests.helpers.gltf_builder import Builder, grid_mesh

FRAME = {
    "milliseconds": 1.0,
    "host_milliseconds": 2.0,
    "steps": {"cut": 0.5},
    "triangles": 10,
    "clusters": 2,
    "decoded": 1,
    "hidden": 3,
    "read_bytes": 7,
    "allowed_pixels": 1.0,
    "shown_pixels": 1.0,
    "missing_pages": 0,
}


def test_instances_in_a_grid(tmp_path):
    builder = Builder()
    positions, triangles = grid_mesh(4, 4)
    builder.mesh({"POSITION": positions}, triangles)
    gltf_ext.compress(builder.write(tmp_path / "raw.glb"), tmp_path / "one.glb")
    path = vulkan_lod.placed(tmp_path / "one.glb", 7, tmp_path / "seven.glb")
    assert struct.unpack_from("<I", path.read_bytes(), 8)[0] == path.stat().st_size
    scene = read_scene(open_model(path))
    places = np.array([m[:3, 3] for p in scene.primitives for m in p.matrices])
    assert len(np.unique(places, axis=0)) == 7
    assert gltf_ext.validate(path) == []


def test_the_flight_is_smooth():
    pytest.importorskip("vulkan", exc_type=Exception)
    low, high = np.array([-9.0, 0, -9]), np.array([9.0, 1, 9])
    eyes = np.array(
        [vulkan_lod.camera_at(t, low, high, 1.0).to_world[:3, 3] for t in np.linspace(0, 1, 400)]
    )
    distance = np.linalg.norm(eyes - (low + high) / 2, axis=1)
    assert distance.min() < 0.6 and distance.max() > 15
    assert (np.linalg.norm(np.diff(eyes, axis=0), axis=1) < 0.05 * distance[1:] + 0.01).all()


def test_summary():
    frames = [{**FRAME, "milliseconds": t, "allowed_pixels": a} for t, a in ((1, 1.0), (3, 1.5))]
    found = vulkan_lod.summarised(frames)
    assert found["median"] == 2 and found["share_at_error"] == 0.5
    assert found["share_shown"] == 1 and found["worst_shown"] == 1
    assert found["read_bytes"] == 14 and found["worst_allowed"] == 1.5
    row = {"triangles": 5e6, "instances": 1, "file_bytes": 1, "pool": 1, "device_bytes": 1}
    row |= {"occlusion": True, "exact": {"least_share": 0.9994}}
    row |= {"first_seconds": 0.1, "complete_seconds": 0.2, "frames": found}
    row |= {"paced": {**found, "share_shown": 0.985, "worst_shown": 1.25}}
    text = vulkan_lod.summary({"rows": [row], "rate": 60.0})
    assert "98.5 %" in text and "1.25 px" in text and "at 60 Hz" in text
    assert "99.94 %" in text and "5 M" in text and "cut" in text and json.dumps(row)

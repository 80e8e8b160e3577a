"""The measurement of models larger than memory: its model, its tables."""

import argparse
import shutil

import numpy as np
import pytest

import gltf_ext
from bench import largest, models, out_of_core
from bench.large_model import write_displaced
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder

TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
SIDES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.uint32)


@pytest.fixture
def small(tmp_path):
    """A model of four triangles."""
    builder = Builder()
    builder.mesh({"POSITION": TETRAHEDRON}, SIDES)
    gltf_ext.compress(builder.write(tmp_path / "in.glb"), tmp_path / "small.glb")
    return tmp_path / "small.glb"


@pytest.mark.parametrize("n", [1, 2, 3, 5])
@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_the_model_is_closed(small, tmp_path, n, suffix):
    large = write_displaced(small, n, tmp_path / f"large{suffix}")
    gltf_ext.compress(large, tmp_path / "out.glb", position_bits=20)
    (mesh,) = gltf_ext.load(tmp_path / "out.glb")
    assert len(mesh.indices) == 4 * n * n
    _, corner = np.unique(mesh.attributes["POSITION"], axis=0, return_inverse=True)
    triangles = corner[mesh.indices]
    edges = np.stack([triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)], axis=1)
    forward = {tuple(edge) for edge in edges.tolist()}
    assert len(forward) == len(edges) and all((b, a) in forward for a, b in forward)
    assert corner.max() + 1 == 2 * n * n + 2  # Euler


def test_the_tables_have_a_row_for_each_run():
    run = {"triangles": 4, "bytes": 10, "cpu_seconds": 1.0, "seconds": 1.0, "peak_bytes": 1 << 20}
    level = {"triangles": 2, "stated": 0.2, "measured": 0.1, "within": 1.0}
    small = {"n": 2, "memory": "500M", "whole": run, "chunks": run, "levels": [level]}
    chunks = {**run, "triangles": 5_000_000, "group_bytes": 3 << 20}
    large = {"n": 11, "memory": "2G", "chunks": chunks, "levels": [level], "problems": []}
    origin = {"machine": {"cpu": "x", "cores": 2}, "commit": "", "date": "2026-01-01"}
    origin["script"] = "bench.out_of_core"
    text = out_of_core.block({"models": [small, large], **origin})
    assert text.count("\n| 4 |") == 3 and "\n| 5,000,000 | 2G |" in text and "1.000" in text
    assert "| 3 MiB |" in text and "| 5,000,000 | 1 |" in text
    assert "Of 5,000,000 triangles, `validate` and `verify` find no problem" in text
    large["problems"] = ["a hole"]
    assert "FIND 1 PROBLEMS: a hole" in out_of_core.block({"models": [large], **origin})


def test_a_model_is_built_and_checked(small, tmp_path, monkeypatch):
    environment.need_package("meshoptimizer")
    monkeypatch.setattr(models, "MODELS", tmp_path)
    shutil.copy(small, tmp_path / "dragon.glb")
    monkeypatch.setattr(out_of_core, "LARGE", 60)
    options = argparse.Namespace(sides=[20, 80], memory="1G", work_dir=str(tmp_path))
    in_both, in_chunks = out_of_core.measure(options)["models"]
    for model in (in_both, in_chunks):
        assert model["problems"] == [] and model["chunks"]["group_bytes"] > 1 << 24
        assert all(level["within"] > 0.9 for level in model["levels"])
    assert in_both["levels"] and in_both["whole"]["triangles"] == 1600 and "whole" not in in_chunks


def test_the_same_model_on_any_number_of_threads(small, tmp_path, monkeypatch):
    environment.need_package("meshoptimizer")
    shutil.copy(small, tmp_path / "dragon.glb")
    monkeypatch.setenv("GLTF_MESHLET_MODELS", str(tmp_path))
    monkeypatch.setattr(models, "MODELS", tmp_path)
    options = argparse.Namespace(
        millions=[100e-6], threads=[1, 2], memory="1G", work_dir=str(tmp_path)
    )
    result = largest.measure(options)
    assert [row["triangles"] for row in result["rows"]] == [100, 144, 144]
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "dragon.glb",
        "in.glb",
        "small.glb",
    ]
    origin = {"machine": {"cpu": "x", "cores": 3}, "commit": "", "date": "2026-01-01"}
    text = largest.block({**result, **origin, "script": "bench.largest"})
    assert "\n| 144 | 2 |" in text and "\n| 100 | 3 |" in text and "bytes are the same" in text
    result["rows"][1]["digest"] = "another"
    assert "THE BYTES DIFFER" in largest.block({**result, **origin, "script": "bench.largest"})


def test_stated_errors_of_a_noisy_tetrahedron_hold(small, tmp_path):
    environment.need_package("meshoptimizer")
    large = write_displaced(small, 40, tmp_path / "large.glb")
    gltf_ext.compress(large, tmp_path / "out.glb", lod=True, position_bits=16)
    report = gltf_ext.verify(large, tmp_path / "out.glb")
    assert not [problem for problem in report["problems"] if "is off by" in problem]

"""bench.defaults: pictures with a glossy material, and what is made of their differences."""

import numpy as np
import pytest

from bench import defaults, glossy
from tests.helpers.gltf_builder import Builder, grid_mesh

ORIGIN = {
    "script": "bench.defaults",
    "date": "2026-11-28",
    "commit": None,
    "machine": {"cpu": "a processor", "cores": 2},
}


@pytest.fixture
def model(tmp_path):
    positions, triangles = grid_mesh(12, 12)
    builder = Builder()
    builder.mesh({"POSITION": positions, "TEXCOORD_0": positions[:, :2] / 2}, triangles)
    return builder.write(tmp_path / "in.glb")


def test_a_picture_shows_errors(model, monkeypatch):
    pytest.importorskip("flip_evaluator")
    monkeypatch.setattr(glossy, "SIZE", 48)
    (placed,) = glossy.read_placed(model)
    camera = glossy.cameras_of([placed])[0]
    before = glossy.picture([placed], camera)
    assert before.shape == (48, 48, 3) and 0 < before.min() < before.max() < 1
    assert glossy.flip(before, before) == 0
    placed.uv = placed.uv + 1 / 64
    moved = glossy.flip(before, glossy.picture([placed], camera))
    placed.normals = placed.normals + np.random.default_rng(1).normal(size=placed.normals.shape)
    assert 0 < moved < glossy.flip(before, glossy.picture([placed], camera))


def test_a_model_that_looks_worse_is_named():
    def row(name, size, errors):
        steps = {"POSITION": [13, 14]}
        ours = {"bytes": size, "flip": errors, "bits": steps, "collapsed_percent": 0}
        ours["raw_bytes"] = 10 * size
        usual = {"bytes": 100, "flip": [0.1, 0.2, 0.3], "bits": {}, "collapsed_percent": 0}
        return {"model": name, "triangles": 1, "chosen": ours, "usual": usual}

    rows = [row("a", 90, [0.1, 0.1, 0.1]), row("b", 120, [0.1, 0.2001, 0.3]), row("c", 95, [0] * 3)]
    assert defaults.worst(rows[1]) == pytest.approx(0.0001)
    text = defaults.report({**ORIGIN, "rows": rows})
    assert "0.950 of those of 14/10/12 in the median" in text and "no worse in any view" in text
    rows[1]["chosen"]["flip"][2] = 0.31
    assert "by at most 0.0100 worse in a view of b" in defaults.report({**ORIGIN, "rows": rows})

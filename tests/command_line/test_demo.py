"""The demo: its model, and the whole run into an empty folder."""

import sys
from argparse import Namespace

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from gltf_meshlet.demo import model as demo_model
from gltf_meshlet.demo import run as demo
from tests.helpers.mitsuba_reference import require


@pytest.fixture(scope="module")
def primitives():
    return demo_model.generate()


def test_model_has_what_a_codec_must_survive(primitives):
    assert sum(len(primitive.triangles) for primitive in primitives) > 50_000
    assert len({primitive.mesh for primitive in primitives}) == 3 and len(primitives) == 5
    for primitive in primitives:
        assert primitive.triangles.max() == len(primitive.positions) - 1
        assert np.allclose(np.linalg.norm(primitive.normals, axis=1), 1, atol=1e-6)
        assert primitive.texcoords.min() >= 0 and primitive.texcoords.max() <= 1
        points = len(np.unique(primitive.positions, axis=0))
        assert points < len(primitive.positions), f"{primitive.name} has no seam"


def test_model_faces_outwards(primitives):
    for primitive in primitives:
        a, b, c = (primitive.positions[primitive.triangles[:, k]].astype(float) for k in range(3))
        face = np.cross(b - a, c - a)
        assert np.all(np.linalg.norm(face, axis=1) > 0), (
            f"{primitive.name} has a degenerate triangle"
        )
        assert np.all(np.sum(face * primitive.normals[primitive.triangles[:, 0]], axis=1) > 0), (
            primitive.name
        )


@pytest.mark.parametrize("name", ["knot", "planet", "gear"])
def test_solid_primitives_are_closed_by_position(primitives, name):
    primitive = next(primitive for primitive in primitives if primitive.name == name)
    corners = np.unique(primitive.positions, axis=0, return_inverse=True)[1].reshape(-1)[
        primitive.triangles
    ]
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    assert np.all(np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)[1] == 2)


def test_model_is_the_same_every_time(primitives, tmp_path):
    demo_model.write_glb(primitives, tmp_path / "a.glb")
    demo_model.write_glb(demo_model.generate(), tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


def test_demo_runs_and_saves(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(demo, "_save_pictures", lambda *_: [])
    folder = tmp_path / "\x1b[2J"  # which must not control the terminal
    assert demo.run(Namespace(output=folder)) == 0
    printed = capsys.readouterr().out
    assert "verified" in printed and "times smaller" in printed
    assert "\x1b" not in printed and "\\x1b[2J: original.glb" in printed
    names = {path.name for path in folder.iterdir()}
    assert names == {"original.glb", "compressed.glb", "decompressed.glb"}
    totals = gltf_ext.inspect(folder / "compressed.glb")["totals"]
    assert totals["triangles"] == sum(
        len(primitive.triangles) for primitive in demo_model.generate()
    )
    assert totals["ratio"] > 5


def test_demo_renders_the_compressed_file_like_the_original(tmp_path, primitives, monkeypatch):
    require("scalar_rgb")
    monkeypatch.setattr(demo, "RENDERED", (64, 48, 16))
    monkeypatch.setattr(demo, "MESHLETS_RENDERED", (64, 48, 4))
    original, compressed = tmp_path / "original.glb", tmp_path / "compressed.glb"
    demo_model.write_glb(primitives, original)
    gltf_ext.compress(original, compressed)
    totals = gltf_ext.inspect(compressed)["totals"]
    paths = demo._save_pictures(tmp_path, original, compressed, totals)
    both, meshlets = (np.asarray(Image.open(path), float) for path in paths)
    before, after = both[:48, :64], both[:48, 64:]
    assert before.shape == after.shape == meshlets.shape == (48, 64, 3)
    assert before.std() > 20 and np.abs(before.mean() - after.mean()) < 2
    assert np.abs(before - after).mean() < 8, "the same view of the same thing, but for noise"
    saturation = np.ptp(meshlets, axis=2) / np.maximum(meshlets.max(axis=2), 1)
    assert (saturation > 0.2).mean() > 0.2, "meshlets have colours"


def test_demo_without_mitsuba_is_one_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "gltf_meshlet.demo.studio", None)
    monkeypatch.delattr("gltf_meshlet.demo.studio", raising=False)
    assert demo._save_pictures(tmp_path, tmp_path / "a.glb", tmp_path / "b.glb", {}) == []
    assert len(capsys.readouterr().out.splitlines()) == 1


def test_a_full_disk_names_the_file(tmp_path, monkeypatch):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(OSError) as caught:
        demo.run(Namespace(output=tmp_path / "out"))
    assert caught.value.filename == str(tmp_path / "out" / "original.glb")
    assert not list((tmp_path / "out").iterdir())

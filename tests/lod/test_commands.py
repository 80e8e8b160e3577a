"""Levels on the command line and in trimesh."""

import json

import pytest

import gltf_ext
from gltf_meshlet import cli
from gltf_meshlet.demo import model
from spec.make_lod_vectors import FOLDER
from tests.helpers.gltf_builder import Builder, everything

LEVELS = FOLDER / "lod_levels.glb"  # 192, 96 and 48 triangles, errors 1 and 2


@pytest.mark.parametrize(
    "arguments, triangles",
    [
        ([], 192),
        (["--level", "0"], 192),
        (["--level", "1"], 96),
        (["--level", "2"], 48),
        (["--level", "9"], 48),
        (["--error", "0.5"], 192),
        (["--error", "1"], 96),
        (["--error", "100%"], 48),
    ],
)
def test_decompress_writes_a_level(arguments, triangles, tmp_path, capsys):
    output = tmp_path / "out.glb"
    assert cli.main(["decompress", str(LEVELS), str(output), *arguments]) == 0
    assert f"{triangles} triangles" in capsys.readouterr().out
    (mesh,) = gltf_ext.load(output)
    assert len(mesh.indices) == triangles


@pytest.mark.parametrize("arguments", [["--level", "-1"], ["--error", "x"], ["--error", "nan"]])
def test_decompress_refuses_other_details(arguments, tmp_path, capsys):
    output = tmp_path / "out.glb"
    assert cli.main(["decompress", str(LEVELS), str(output), *arguments]) == 2
    error = capsys.readouterr().err
    assert arguments[0] in error and error.count("\n") == 1
    assert not output.exists()


def test_inspect_shows_levels(capsys):
    assert cli.main(["inspect", str(LEVELS), "--json"]) == 0
    (lod,) = json.loads(capsys.readouterr().out)["lod"]
    assert [level["triangles"] for level in lod["levels"]] == [192, 96, 48]
    assert [level["error"] for level in lod["levels"]] == [0.0, 1.0, 2.0]
    assert [level["stuck_triangles"] for level in lod["levels"]] == [0, 0, 0]
    assert sum(level["bytes"] for level in lod["levels"]) == lod["page_bytes"]
    assert cli.main(["inspect", str(LEVELS)]) == 0
    assert "level 2: 48 triangles" in capsys.readouterr().out


def test_verify_measures_levels(capsys):
    assert cli.main(["verify", str(LEVELS), str(LEVELS)]) == 0
    assert "level 2: 48 triangles, error 2 stated, 0.999 measured" in capsys.readouterr().out


def test_trimesh_loads_a_level():
    from gltf_ext.trimesh_handler import load

    for detail, triangles in ({"level": 1}, 96), ({"error": 5.0}, 48), ({}, 192):
        (mesh,) = load(LEVELS, **detail).geometry.values()
        assert len(mesh.faces) == triangles


def test_files_without_levels_say_so(tmp_path, capsys):
    values, triangles, _ = everything()
    plain = Builder()
    plain.mesh({"POSITION": values["POSITION"]}, triangles)
    source, output = plain.write(tmp_path / "in.glb"), tmp_path / "out.glb"
    gltf_ext.compress(source, output)
    for arguments, warned in (["--level", "1"], True), (["--error", "1%"], True), ([], False):
        target = tmp_path / "plain.glb"
        assert cli.main(["decompress", str(output), str(target), *arguments]) == 0
        assert ("it has no levels of detail" in capsys.readouterr().err) == warned


def test_inspect_leaves_out_what_is_not_there(capsys):
    assert cli.main(["inspect", str(LEVELS)]) == 0
    assert "not simplified" not in capsys.readouterr().out


def test_verify_allows_for_rounding_on_planes(tmp_path):
    """Levels of flat ground have hardly an error: less than float32 distances have."""
    source, output = tmp_path / "in.glb", tmp_path / "out.glb"
    model.write_glb(model.generate(), source)
    gltf_ext.compress(source, output, lod=True)
    assert gltf_ext.verify(source, output)["problems"] == []

"""bench.blender: its errors come before any measurement, its table shows every format."""

import argparse

import pytest

import gltf_ext
from bench import blender
from tools import blender_python, build_blender, build_wheels

OPTIONS = argparse.Namespace(models=["suzanne"])


def test_the_extension_is_the_zip_of_this_machine(tmp_path, monkeypatch):
    """As build_blender names it."""
    (tag,) = build_wheels.GROUPS["here"]
    (tmp_path / f"gltf_meshlet-{gltf_ext.__version__}-py3-none-{tag}.whl").touch()
    monkeypatch.setattr(build_blender, "download", lambda folder: [])
    (path,) = build_blender.build(tmp_path, ["here"])
    assert blender.ROOT / "dist" / path.name == blender.EXTENSION


def test_missing_extension_and_missing_blender_are_named(monkeypatch, tmp_path):
    monkeypatch.setattr(blender, "EXTENSION", blender.ROOT / "dist" / "none.zip")
    with pytest.raises(SystemExit, match="run make blender"):
        blender.check(OPTIONS)
    monkeypatch.setattr(blender, "EXTENSION", tmp_path / "extension.zip")
    (tmp_path / "extension.zip").touch()
    monkeypatch.setattr(blender_python, "PYTHON", tmp_path / "python")
    with pytest.raises(SystemExit, match="has no bpy"):
        blender.check(OPTIONS)


def test_table_has_a_column_per_format_and_figure():
    formats = {
        name: {"bytes": 1e6 * n, "seconds": n, "peak_bytes": 2e6 * n}
        for n, name in enumerate(blender.FORMATS, 1)
    }
    result = {"models": [{"model": "cube", "triangles": 12, "formats": formats}]}
    row = blender.table(result).splitlines()[2]
    assert row == "| cube | 12 | 1.00 | 2.00 | 3.00 | 1.00 | 2.00 | 3.00 | 2 | 4 | 6 |"

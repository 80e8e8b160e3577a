"""What the extension writes beside an exported file, without Blender."""

import importlib
import os
import sys
import types

import pytest

import gltf_ext
from tests.helpers.environment import ROOT
from tests.helpers.gltf_builder import write_grid


@pytest.fixture
def exporter(monkeypatch):
    package = types.ModuleType("extension_here")
    package.__path__ = [str(ROOT / "blender")]
    monkeypatch.setitem(sys.modules, "bpy", types.ModuleType("bpy"))
    monkeypatch.setitem(sys.modules, "extension_here", package)
    yield importlib.import_module("extension_here.exporter")
    for name in ("exporter", "importer"):
        sys.modules.pop(f"extension_here.{name}", None)


def test_the_file_is_replaced_with_its_fallback(exporter, tmp_path):
    path = write_grid(tmp_path / "a.glb", 20)
    (tmp_path / "a.fallback.bin").write_bytes(b"of the export before")
    report = exporter._compress(path, {"fallback": True})
    assert gltf_ext.validate(path) == []
    assert (tmp_path / "a.fallback.bin").stat().st_size == report["fallback_bytes"] > 100
    assert sorted(os.listdir(tmp_path)) == ["a.fallback.bin", "a.glb"]


@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_the_fallback_is_not_written_over_the_file(exporter, tmp_path, link):
    path = write_grid(tmp_path / "a.glb", 20)
    before = path.read_bytes()
    link(path, tmp_path / "a.fallback.bin")
    with pytest.raises(gltf_ext.MeshletError, match="is the input too"):
        exporter._compress(path, {"fallback": True})
    assert path.read_bytes() == before and (tmp_path / "a.fallback.bin").read_bytes() == before
    assert sorted(os.listdir(tmp_path)) == ["a.fallback.bin", "a.glb"]


def test_a_failure_keeps_both_files(exporter, tmp_path):
    path = write_grid(tmp_path / "a.glb", 20)
    before = path.read_bytes()
    (tmp_path / "a.fallback.bin").mkdir()
    with pytest.raises(OSError, match=r"a\.fallback\.bin"):
        exporter._compress(path, {"fallback": True})
    assert path.read_bytes() == before
    assert sorted(os.listdir(tmp_path)) == ["a.fallback.bin", "a.glb"]

"""What the extension makes of an exported file, and writes beside it; without Blender."""

import importlib
import json
import os
import re
import stat
import sys
import types

import numpy as np
import pytest

import gltf_ext
from tests.helpers.environment import ROOT
from tests.helpers.gltf_builder import Builder, glb_parts, grid_mesh, write_grid

PNG = b"\x89PNG\r\n\x1a\n"  # nobody reads more of it


@pytest.fixture
def compression(monkeypatch):
    package = types.ModuleType("extension_here")
    package.__path__ = [str(ROOT / "blender")]
    monkeypatch.setitem(sys.modules, "extension_here", package)
    yield importlib.import_module("extension_here.compression")
    sys.modules.pop("extension_here.compression", None)


@pytest.fixture
def unfinished(tmp_path_factory):
    """The folder for unfinished files, which is empty afterwards."""
    folder = tmp_path_factory.mktemp("unfinished")
    yield folder
    assert os.listdir(folder) == []


def test_the_file_is_replaced_with_its_fallback(compression, tmp_path, unfinished):
    path = write_grid(tmp_path / "a.glb", 20)
    (tmp_path / "a.fallback.bin").write_bytes(b"of the export before")
    report = compression.compress_in_place(path, {"fallback": True}, unfinished)
    assert gltf_ext.validate(path) == []
    assert (tmp_path / "a.fallback.bin").stat().st_size == report["fallback_bytes"] > 100
    assert sorted(os.listdir(tmp_path)) == ["a.fallback.bin", "a.glb"]


@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_the_fallback_is_not_written_over_the_file(compression, tmp_path, unfinished, link):
    path = write_grid(tmp_path / "a.glb", 20)
    before = path.read_bytes()
    link(path, tmp_path / "a.fallback.bin")
    with pytest.raises(gltf_ext.MeshletError, match="is the input too"):
        compression.compress_in_place(path, {"fallback": True}, unfinished)
    assert path.read_bytes() == before and (tmp_path / "a.fallback.bin").read_bytes() == before
    assert sorted(os.listdir(tmp_path)) == ["a.fallback.bin", "a.glb"]


def test_a_failure_keeps_both_files(compression, tmp_path, unfinished):
    path = write_grid(tmp_path / "a.glb", 20)
    before = path.read_bytes()
    (tmp_path / "a.fallback.bin").mkdir()
    with pytest.raises(OSError, match=r"a\.fallback\.bin"):
        compression.compress_in_place(path, {"fallback": True}, unfinished)
    assert path.read_bytes() == before
    assert sorted(os.listdir(tmp_path)) == ["a.fallback.bin", "a.glb"]


def test_links_and_modes_stay(compression, tmp_path, unfinished):
    (tmp_path / "real").mkdir()
    path = write_grid(tmp_path / "real" / "b.glb", 20)
    path.chmod(0o664)
    link = tmp_path / "a.glb"
    link.symlink_to(path)
    compression.compress_in_place(link, {}, unfinished)
    assert link.is_symlink() and gltf_ext.validate(path) == []
    assert stat.S_IMODE(path.stat().st_mode) == 0o664


def separate(path):
    """A .gltf with its .bin and a texture, as Blender writes them."""
    glb = write_grid(path.with_suffix(".glb"), 30)
    properties, binary = glb_parts(glb)
    properties["buffers"][0]["uri"] = path.with_suffix(".bin").name
    properties["images"] = [{"uri": "texture.png"}]
    path.write_text(json.dumps(properties))
    path.with_suffix(".bin").write_bytes(binary)
    path.with_name("texture.png").write_bytes(PNG)
    glb.unlink()
    return path


def test_a_separate_file_stays_separate(compression, tmp_path, unfinished):
    path = separate(tmp_path / "a.gltf")
    before = path.with_suffix(".bin").stat().st_size
    compression.compress_in_place(path, {"images": "keep"}, unfinished)
    assert sorted(os.listdir(tmp_path)) == ["a.bin", "a.gltf", "texture.png"]
    properties = json.loads(path.read_text())
    assert properties["images"] == [{"uri": "texture.png"}]
    assert properties["buffers"][0]["uri"] == "a.bin"
    assert path.with_suffix(".bin").stat().st_size < before / 2
    assert gltf_ext.validate(path) == []


def test_a_file_that_would_grow_stays_plain(compression, tmp_path, unfinished):
    """Unless it gets what plain files do not have."""
    path = write_grid(tmp_path / "a.glb", 2)
    before = path.read_bytes()
    text = compression.compress_in_place(path, {}, unfinished)
    assert text.startswith("compressed it would be larger (") and path.read_bytes() == before
    compression.compress_in_place(path, {"fallback": True}, unfinished)
    assert gltf_ext.validate(path) == [] and path.read_bytes() != before


def test_a_file_without_triangles_stays_plain(compression, tmp_path, unfinished):
    builder = Builder()
    builder.mesh({"POSITION": grid_mesh(9, 9)[0]}, mode=0)
    path = builder.write(tmp_path / "a.glb")
    before = path.read_bytes()
    assert "no triangles" in compression.compress_in_place(path, {}, unfinished)
    assert path.read_bytes() == before


def test_cancelling_keeps_the_plain_file(compression, tmp_path, unfinished):
    def cancel(_):
        raise InterruptedError

    path = write_grid(tmp_path / "a.glb", 30)
    before = path.read_bytes()
    with pytest.raises(InterruptedError):
        compression.compress_in_place(path, {"progress": cancel}, unfinished)
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["a.glb"]


def test_collapsed_and_dropped_triangles_are_told(compression, tmp_path, unfinished):
    """A small strip in a large mesh, and triangles with a vertex twice."""
    positions, triangles = grid_mesh(30, 30)
    strip = positions[:, [0, 2, 1]] * 1e-5
    both = np.vstack([triangles, triangles + len(positions), np.zeros((2, 3), np.uint32)])
    builder = Builder()
    builder.mesh({"POSITION": np.vstack([positions, strip])}, both.astype(np.uint32))
    path = builder.write(tmp_path / "a.glb")
    report = compression.compress_in_place(path, {"position_bits": 12, "lod": True}, unfinished)
    lines = compression.report_lines("a.glb", report)
    assert lines[-1][1].startswith("a.glb: ") and "times smaller" in lines[-1][1]
    text = "\n".join(text for _, text in lines)
    assert re.search(r"^1,\d\d\d triangles collapse by the step, .* % of the area$", text, re.M)
    assert re.search(r"^\d levels of detail, 3,364 to \d+ triangles; the coarser take ", text, re.M)
    assert text.count("2 degenerate triangles are dropped") == text.count("dropped") == 1

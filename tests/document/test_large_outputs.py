"""Results that do not fit a .glb, or are named .gltf: .bin files of a bounded size."""

import json

import numpy as np
import pytest

import gltf_ext
from gltf_ext.document import container
from tests.helpers.gltf_builder import Builder, grid_mesh
from tests.helpers.large import use_small_chunks


@pytest.fixture
def source(tmp_path):
    builder = Builder()
    for size in (40, 60, 20):
        builder.mesh({"POSITION": grid_mesh(size, size)[0]}, grid_mesh(size, size)[1])
    return builder.write(tmp_path / "in.glb")


def buffers_of(path):
    return json.loads(path.read_bytes())["buffers"]


def same_triangles(a, b):
    pairs = zip(gltf_ext.load(a), gltf_ext.load(b), strict=True)
    return all(
        np.array_equal(x.indices, y.indices)
        and np.array_equal(x.attributes["POSITION"], y.attributes["POSITION"])
        for x, y in pairs
    )


def test_an_output_that_is_named_gltf(source, tmp_path):
    output = tmp_path / "out file.gltf"
    report = gltf_ext.compress(source, output)
    assert [buffer["uri"] for buffer in buffers_of(output)] == ["out%20file.bin"]
    sizes = sum(p.stat().st_size for p in (output, tmp_path / "out file.bin"))
    assert report["output_bytes"] == sizes and report["output"] == str(output)
    assert gltf_ext.validate(output) == [] and gltf_ext.verify(source, output)["ok"]
    assert gltf_ext.inspect(output)["fallback_files"] == {}
    gltf_ext.decompress(output, tmp_path / "plain.gltf")
    assert gltf_ext.verify(tmp_path / "plain.gltf", output)["ok"]


def test_more_than_a_glb_holds(source, tmp_path, monkeypatch):
    """The limits are lowered to some kilobytes."""
    gltf_ext.compress(source, tmp_path / "whole.glb")
    monkeypatch.setattr(container, "MAX_BINARY_BYTES", 5000)
    monkeypatch.setattr(container, "BIN_BYTES", 2500)
    report = gltf_ext.compress(source, tmp_path / "out.glb", fallback=True)
    output = tmp_path / "out.gltf"
    assert report["output"] == str(output) and not (tmp_path / "out.glb").exists()
    assert "does not fit a .glb; it is out.gltf" in " ".join(report["warnings"])
    buffers = buffers_of(output)
    assert len(buffers) == 4 and buffers[-1]["uri"] == "out.fallback.bin"
    for number, buffer in enumerate(buffers[:-1]):
        assert buffer["uri"] == f"out.{number}.bin"
        assert (tmp_path / buffer["uri"]).stat().st_size == buffer["byteLength"]
    assert list(gltf_ext.inspect(output)["fallback_files"]) == ["out.fallback.bin"]
    assert gltf_ext.validate(output) == [] and gltf_ext.verify(source, output)["ok"]
    assert same_triangles(output, tmp_path / "whole.glb")


def test_levels_in_several_buffers(tmp_path, monkeypatch):
    pytest.importorskip("meshoptimizer")
    builder = Builder()
    builder.mesh({"POSITION": grid_mesh(120, 120)[0]}, grid_mesh(120, 120)[1])
    source = builder.write(tmp_path / "in.glb")
    monkeypatch.setattr(container, "BIN_BYTES", 1000)
    gltf_ext.compress(source, tmp_path / "out.gltf", lod=True, page_bytes=4096)
    names = {buffer["uri"] for buffer in buffers_of(tmp_path / "out.gltf")}
    assert names == {"out.0.bin", "out.1.bin", "out.2.bin"}  # tables, coarse pages, level 0
    assert gltf_ext.validate(tmp_path / "out.gltf") == []
    assert gltf_ext.verify(source, tmp_path / "out.gltf")["triangles_equal"]
    assert len(gltf_ext.inspect(tmp_path / "out.gltf")["lod"][0]["levels"]) > 2


def test_an_input_of_several_buffers(source, tmp_path, monkeypatch):
    """Also as a model larger than memory."""
    monkeypatch.setattr(container, "BIN_BYTES", 1000)
    gltf_ext.compress(source, tmp_path / "packed.glb")
    gltf_ext.decompress(tmp_path / "packed.glb", tmp_path / "plain.gltf")
    assert len(buffers_of(tmp_path / "plain.gltf")) > 2
    use_small_chunks(monkeypatch, 2000)
    gltf_ext.compress(tmp_path / "plain.gltf", tmp_path / "again.glb", max_memory="1G")
    assert gltf_ext.verify(tmp_path / "plain.gltf", tmp_path / "again.glb")["ok"]

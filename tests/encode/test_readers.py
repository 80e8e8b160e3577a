"""Commands that read compressed files part by part: the same results, in little memory."""

import os
import signal
import subprocess
import sys

import pytest

import gltf_ext
from gltf_ext import work_files
from gltf_ext.attributes import extension
from gltf_ext.sources import memory
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder
from tests.helpers.large import peak_of, sheet, use_small_chunks


def write(path, size):
    points, normals, triangles = sheet(size)
    builder = Builder()
    builder.mesh({"POSITION": points, "NORMAL": normals}, triangles)
    return builder.write(path)


def test_many_parts_are_as_one(tmp_path, monkeypatch):
    environment.need_package("meshoptimizer")
    source = write(tmp_path / "in.glb", 100)
    gltf_ext.compress(source, tmp_path / "out.glb", lod=True, fallback=True)
    gltf_ext.decompress(tmp_path / "out.glb", tmp_path / "whole.glb")
    monkeypatch.setattr(extension, "PART_BYTES", 4096)
    monkeypatch.setattr(work_files, "BUCKET_BYTES", 10_000)
    monkeypatch.setattr(work_files, "MAX_SPOOLED", 1000)
    gltf_ext.decompress(tmp_path / "out.glb", tmp_path / "parts.glb")
    assert (tmp_path / "parts.glb").read_bytes() == (tmp_path / "whole.glb").read_bytes()
    assert gltf_ext.validate(tmp_path / "out.glb") == []
    fallback = tmp_path / "out.fallback.bin"
    data = bytearray(fallback.read_bytes())
    data[-9] ^= 1
    fallback.write_bytes(data)
    assert "the fallback of NORMAL is not" in " ".join(gltf_ext.validate(tmp_path / "out.glb"))


@pytest.fixture
def small_chunks(monkeypatch):
    """Primitives of more than 8000 triangles are read in parts."""
    use_small_chunks(monkeypatch)
    monkeypatch.setattr(extension, "PART_BYTES", 4096)
    monkeypatch.setattr(work_files, "BUCKET_BYTES", 10_000)


@pytest.mark.parametrize("share", [0.3, 5e-5], ids=["one pass", "several passes"])
def test_verify_finds_the_same(tmp_path, small_chunks, monkeypatch, share):
    monkeypatch.setattr(memory, "VERTEX_FRACTION", share)
    source = write(tmp_path / "in.glb", 100)
    gltf_ext.compress(source, tmp_path / "out.glb", position_bits=5)
    whole = gltf_ext.verify(source, tmp_path / "out.glb")
    parts = gltf_ext.verify(source, tmp_path / "out.glb", max_memory="1G")
    assert parts["ok"] and parts["warnings"] and parts["collapsed_triangles"] > 0
    for name in ("area_error", "area_error_percent"):  # needs all errors at once
        assert parts.pop(name) == dict.fromkeys(whole.pop(name))
    for name in ("rms_error", "rms_error_percent", "collapsed_area_percent"):
        assert parts.pop(name) == pytest.approx(whole.pop(name))
    assert parts.pop("topology") is None and whole.pop("topology")
    assert parts == whole


def test_verify_finds_differences(tmp_path, small_chunks):
    points, normals, triangles = sheet(100)
    source = write(tmp_path / "in.glb", 100)
    gltf_ext.compress(source, tmp_path / "out.glb")
    points[777] *= 1.1
    builder = Builder()
    builder.mesh({"POSITION": points, "NORMAL": normals}, triangles[:-3])
    changed = builder.write(tmp_path / "changed.glb")
    whole = gltf_ext.verify(changed, tmp_path / "out.glb")
    parts = gltf_ext.verify(changed, tmp_path / "out.glb", max_memory="1G")
    assert not parts["ok"] and parts["max_error"] == {"POSITION": None, "NORMAL": None}
    for name in ("missing_triangles", "extra_triangles", "triangles"):
        assert parts[name] == whole[name]
    assert parts["missing_triangles"] == 6 and parts["extra_triangles"] == 9
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles)
    other = builder.write(tmp_path / "other.glb")
    problems = gltf_ext.verify(other, tmp_path / "out.glb", max_memory="1G")["problems"]
    assert "attributes differ: NORMAL only in the compressed file" in problems[0]


CUTTING = """
import importlib, os, sys
from gltf_ext.document import document
from gltf_meshlet import __main__
document.MOST_READ = 0
modules = {"compress": "sources.large", "decompress": "commands.decompress"}
command = importlib.import_module(f"gltf_ext.{modules[sys.argv[1]]}")
opened = command.open_model
def cutting(path, *options):
    result = opened(path, *options)
    os.truncate(path, 0)
    return result
command.open_model = cutting
sys.exit(__main__.main())
"""


@pytest.mark.skipif(not hasattr(signal, "SIGBUS"), reason="mapped files cannot be cut off here")
@pytest.mark.parametrize("command", ["compress", "decompress"])
def test_a_mapped_file_that_is_cut_off(tmp_path, command):
    source = write(tmp_path / "in.glb", 100)
    if command == "decompress":
        gltf_ext.compress(source, source.with_name("whole.glb"))
        source.with_name("whole.glb").rename(source)
    arguments = [sys.executable, "-c", CUTTING, command, source, tmp_path / "out.glb"]
    done = subprocess.run(arguments, capture_output=True, text=True)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr == "gltf-meshlet: a file was cut off while it was read; run again\n"
    assert os.listdir(tmp_path) == ["in.glb"]


@pytest.mark.full
@pytest.mark.parametrize("command", ["decompress", "validate", "inspect"])
def test_memory_does_not_grow_with_the_model(tmp_path, command):
    """2 M triangles in the memory of a process and some parts; 145 bytes a triangle once."""
    environment.need_package("meshoptimizer")
    source = write(tmp_path / "in.glb", 1000)
    gltf_ext.compress(source, tmp_path / "out.glb", lod=True)
    os.unlink(source)
    outputs = [tmp_path / "plain.glb"] if command == "decompress" else []
    assert peak_of(command, tmp_path / "out.glb", *outputs) < 160 << 20

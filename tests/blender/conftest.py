"""Blender (bpy) with the extension, and a file for it."""

import pytest

import gltf_ext
from tests.helpers import blender as blender_process
from tests.helpers.gltf_builder import NORMALIZED, Builder, everything
from tools import build_blender, build_wheels


@pytest.fixture(scope="session")
def extension(tmp_path_factory):
    """The zip for this machine, made of a wheel of this checkout."""
    blender_process.need_bpy()
    folder = tmp_path_factory.mktemp("extension")
    assert build_wheels.main([str(folder), "--only", "here"]) == 0
    (path,) = build_blender.build(folder, ["here"])
    return path


@pytest.fixture(scope="module")
def blender(extension, tmp_path_factory):
    with blender_process.running(extension, tmp_path_factory.mktemp("blender")) as process:
        yield process


@pytest.fixture
def rich(tmp_path):
    """A small compressed file with all kinds of attributes."""
    attributes, triangles, targets = everything()
    for name in ("_FRAME", "_HEAT", "_SIGNED"):  # Blender's importer fails on several custom ones
        del attributes[name]
    builder = Builder()
    builder.mesh(attributes, triangles, targets, NORMALIZED)
    original = builder.write(tmp_path / "rich.glb")
    gltf_ext.compress(original, tmp_path / "compressed.glb")
    return tmp_path / "compressed.glb"

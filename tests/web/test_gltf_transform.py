"""The glTF-Transform extension: reads, keeps unchanged blobs, and works in its command line."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import gltf_ext
from gltf_ext import compress, decompress
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.document.gltf import has_extension
from gltf_ext.sources.importers import open_model
from spec.make_vectors import FOLDER, object_of, pack_glb, parts_of
from tests.helpers import environment, web_package
from tests.helpers.equal_vertices import VECTOR, assert_equal_vertices
from tests.helpers.gltf_builder import Builder
from tests.helpers.topology import topology, torus

NAME = "EXT_meshlet_edgebreaker"
PACKAGES = ("@gltf-transform/core", "@gltf-transform/extensions", "@gltf-transform/cli")
CONVERT = Path(__file__).with_name("convert.mjs")
CONFIG = """
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { createDecoder } from 'gltf-meshlet';
import { DECODER, EXTMeshletEdgebreaker } from 'gltf-meshlet/gltf-transform';
export default {
  extensions: [...ALL_EXTENSIONS, EXTMeshletEdgebreaker],
  dependencies: { [DECODER]: await createDecoder() },
};
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = web_package.install(tmp_path_factory.mktemp("package") / "user", *PACKAGES)
    shutil.copy(CONVERT, folder)
    (folder / "config.mjs").write_text(CONFIG)
    return folder


def convert(folder: Path, source: Path, target: Path, change: str = "none") -> str:
    command = ["node", "convert.mjs", source, target, change]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def blobs(path: Path) -> list[bytes]:
    return [compressed.blob for compressed in require_compressed(open_model(path))]


def assert_same_geometry(first: Path, second: Path) -> None:
    for a, b in zip(gltf_ext.load(first), gltf_ext.load(second), strict=True):
        assert np.array_equal(a.indices, b.indices)
        assert a.attributes.keys() == b.attributes.keys()
        for name in a.attributes:
            assert np.array_equal(a.attributes[name], b.attributes[name]), name


MODELS = [
    "nasty/Box.glb",
    "nasty/CesiumMan_skinned.glb",
    "nasty/AnimatedMorphCube.glb",
    "DamagedHelmet.glb",
]


@pytest.mark.parametrize("name", MODELS)
def test_unchanged_blobs_are_kept(name, folder, model, tmp_path):
    compress(model(name), tmp_path / "in.glb")
    assert convert(folder, tmp_path / "in.glb", tmp_path / "out.glb") == ""
    assert blobs(tmp_path / "out.glb") == blobs(tmp_path / "in.glb")
    gltf_ext.validate(tmp_path / "out.glb")
    assert_same_geometry(tmp_path / "out.glb", tmp_path / "in.glb")


def test_equal_vertices_of_the_source_are_apart(folder, tmp_path):
    """Two tori in one place, of one primitive; written as plain accessors."""
    points, triangles = torus(24, 12)
    both = np.concatenate([triangles, triangles + len(points)])
    builder = Builder()
    builder.mesh({"POSITION": np.concatenate([points, points])}, both.astype(np.uint32))
    compress(builder.write(tmp_path / "in.glb"), tmp_path / "compressed.glb")
    assert convert(folder, tmp_path / "compressed.glb", tmp_path / "moved.glb", "move") == ""
    (moved,) = gltf_ext.load(tmp_path / "moved.glb")
    assert topology(moved.indices) == topology(both)
    assert moved.vertex_count == 2 * len(points)


def test_the_vector_with_a_table_of_equal_vertices(folder, tmp_path):
    """It has more vertices with the table than its indices, of 8 bits, can number."""
    assert convert(folder, VECTOR, tmp_path / "moved.glb", "move") == ""
    (moved,) = gltf_ext.load(tmp_path / "moved.glb")
    assert_equal_vertices(moved.indices, moved.attributes["POSITION"] - 1)


@pytest.mark.parametrize("name", [f.stem for f in sorted(FOLDER.glob("malformed_gltf_table_*"))])
def test_malformed_tables_are_refused(name, folder, tmp_path):
    message = convert(folder, FOLDER / f"{name}.glb", tmp_path / "out.glb")
    assert "its table of equal vertices" in message


@pytest.mark.parametrize("value", [7, {"bufferView": 99}, None], ids=str)
def test_a_table_that_is_not_there_is_refused(value, folder, tmp_path):
    document, buffer = parts_of(VECTOR.read_bytes())
    object_of(document)["equalVertices"] = value
    (tmp_path / "in.glb").write_bytes(pack_glb(document, buffer))
    message = convert(folder, tmp_path / "in.glb", tmp_path / "out.glb")
    assert "its table of equal vertices is not there" in message


@pytest.mark.parametrize("bits", [7, 12])
def test_each_vertex_of_the_source_is_there_once(bits, folder, tmp_path):
    positions, triangles = torus(120, 50)
    uv = np.abs(positions[:, :2])
    builder = Builder()
    builder.mesh({"POSITION": positions, "TEXCOORD_0": uv}, triangles)
    original, packed = builder.write(tmp_path / "in.glb"), tmp_path / "packed.glb"
    compress(original, packed, page_bytes=4096, position_bits=bits)
    (compressed,) = require_compressed(open_model(packed))
    assert compressed.vertex_count > len(positions)
    assert convert(folder, packed, tmp_path / "kept.glb") == ""
    assert blobs(tmp_path / "kept.glb") == blobs(packed)
    assert gltf_ext.validate(tmp_path / "kept.glb") == []
    assert convert(folder, packed, tmp_path / "plain.glb", "move") == ""
    (plain,) = gltf_ext.load(tmp_path / "plain.glb")
    assert topology(plain.indices) == topology(triangles)
    assert plain.vertex_count == len(positions)
    moved = compressed.decode()
    moved.attributes["POSITION"] = moved.attributes["POSITION"] + np.float32(1)
    for name, values in moved.attributes.items():
        np.testing.assert_array_equal(
            plain.attributes[name][plain.indices], values[moved.indices], err_msg=name
        )


def test_packed_files_are_read(folder, model, tmp_path):
    for name, transport in (("packed", True), ("in", False)):
        compress(model("DamagedHelmet.glb"), tmp_path / f"{name}.glb", transport=transport)
    assert convert(folder, tmp_path / "packed.glb", tmp_path / "out.glb") == ""
    assert blobs(tmp_path / "out.glb") == blobs(tmp_path / "in.glb")
    assert not open_model(tmp_path / "out.glb").was_packed
    error = convert(folder, tmp_path / "packed.glb", tmp_path / "none.glb", "no-decoder")
    assert "registerDependencies" in error


@pytest.mark.parametrize("name", MODELS)
def test_changed_primitives_are_written_plain(name, folder, model, tmp_path):
    compress(model(name), tmp_path / "in.glb")
    assert convert(folder, tmp_path / "in.glb", tmp_path / "out.glb", "move") == ""
    document = open_model(tmp_path / "out.glb")
    changed = document.primitive(0, 0)
    assert not has_extension(changed, NAME)
    positions = document.accessors[changed["attributes"]["POSITION"]]
    before = gltf_ext.load(tmp_path / "in.glb")[0].attributes["POSITION"]
    assert np.allclose(positions["min"], before.min(axis=0) + 1, atol=1e-5)


def test_command_line_converts(folder, model, tmp_path):
    program = environment.need_npm_package("@gltf-transform/cli") / "bin" / "cli.js"
    compress(model("nasty/CesiumMan_skinned.glb"), tmp_path / "in.glb")
    decompress(tmp_path / "in.glb", tmp_path / "plain.glb")
    config = ["--config", folder / "config.mjs"]
    command = ["node", program, "dequantize", tmp_path / "in.glb", tmp_path / "out.glb", *config]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert_same_geometry(tmp_path / "out.glb", tmp_path / "plain.glb")


def test_missing_decoder_is_an_error(folder, model, tmp_path):
    compress(model("nasty/Box.glb"), tmp_path / "in.glb")
    problem = convert(folder, tmp_path / "in.glb", tmp_path / "out.glb", "no-decoder")
    assert "needs its decoder: io.registerDependencies" in problem
    assert not (tmp_path / "out.glb").exists()


def test_damaged_blob_is_an_error_that_names_the_primitive(folder, model, tmp_path):
    compress(model("nasty/Box.glb"), tmp_path / "in.glb")
    data = bytearray((tmp_path / "in.glb").read_bytes())
    data[data.index(b"EBM1") + 4] = 77  # the version
    (tmp_path / "in.glb").write_bytes(data)
    problem = convert(folder, tmp_path / "in.glb", tmp_path / "out.glb")
    assert problem.startswith("mesh 0 primitive 0: ") and "version" in problem

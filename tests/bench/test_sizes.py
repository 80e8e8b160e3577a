"""bench.size, bench.paper and bench.peers: pictures show their results, sizes are reproducible."""

import shutil
from collections import Counter
from unittest import mock

import numpy as np
import pytest

import gltf_ext
from bench import common, meshlet_peers, paper, peers, size
from bench.generated import torus, write_generated
from gltf_ext import _codec
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.attributes.streams import Bits
from gltf_ext.sources.importers import open_model
from gltf_meshlet.demo import model as demo_model
from spec import make_vectors, reference_decoder
from spec.reference_decoder import BlobFile, Meshlet

RECOMPUTED = ("suzanne", "DamagedHelmet")
# Share of grid points that codecs may round differently: coordinates halfway between two steps.
TIES = 0.02


# --- sizes ---


def compressed_demo(folder):
    """Writes parts of the demo's model to in.glb; returns their compressed file."""
    demo_model.write_glb(demo_model.generate()[2:], folder / "in.glb")
    gltf_ext.compress(folder / "in.glb", folder / "out.glb", **common.BITS)
    return folder / "out.glb"


def test_size_rows_add_up():
    for row in common.read_result("size")["models"]:
        bits = dict(row["bits_per_triangle"])
        assert sum(bits.values()) == pytest.approx(2 * bits.pop("total"))
        assert sum(row["sections"].values()) == pytest.approx(row["bits_per_triangle"]["total"])
        assert row["ratio"] == pytest.approx(row["raw_bytes"] / row["compressed_bytes"])
        for codec in row["codecs"].values():
            assert codec["ratio"] == pytest.approx(row["raw_bytes"] / codec["file_bytes"])
            assert codec["resident_ratio"] == pytest.approx(
                row["raw_bytes"] / codec["resident_bytes"]
            )


def test_paper_rows_add_up():
    for row in common.read_result("paper")["rows"]:
        assert 8 * row["file_bytes"] == pytest.approx(
            sum(row["bits_per_triangle"].values()) * row["counts"]["triangles"]
        )
        assert sum(row["symbols"].values()) == pytest.approx(1)


@pytest.mark.parametrize("name", RECOMPUTED)
def test_sizes_are_todays(model, name):
    """Ours and the paper's encoding, and every codec that is here in the committed version."""
    committed = common.read_result("size")
    (row,) = (row for row in committed["models"] if row["model"] == name)
    here, formats = (
        [codec for codec in found if committed["codecs"].get(codec.name) == codec.version]
        for found, _ in (peers.available(), meshlet_peers.available())
    )
    today = size.measure_model(model(f"{name}.glb"), here, formats)
    expected = {codec: row["codecs"][codec] for codec in today["codecs"]}
    assert today == {**row, "codecs": expected}
    assert {size.OURS, size.PAPER} <= today["codecs"].keys()


def test_generated_sizes_are_todays(tmp_path):
    row = next(
        row for row in common.read_result("size")["models"] if row["model"] == "generated_boxes"
    )
    path = next(path for path in write_generated(tmp_path) if path.stem == "generated_boxes")
    today = size.measure_model(path, [], [])
    assert today == {**row, "codecs": {codec: row["codecs"][codec] for codec in today["codecs"]}}


@pytest.mark.parametrize("name", RECOMPUTED)
def test_the_papers_encoding_is_todays(model, name):
    (row,) = (
        row
        for row in common.read_result("paper")["rows"]
        if row["model"] == name and row["meshlets_of"] == "ours"
    )
    assert paper.measure_model(name, peers.read_parts(model(f"{name}.glb")), "ours") == row


def test_sections_are_the_bits_that_the_reference_decoder_reads(tmp_path):
    for compressed in require_compressed(open_model(compressed_demo(tmp_path))):
        file, counted = BlobFile(compressed.blob), size.SectionFile(compressed.blob)
        for m in range(file.meshlet_count):
            read, again = Meshlet(file, m), Meshlet(counted, m)
            assert again.reader.position == read.reader.position
            assert again.chain_residuals == read.chain_residuals
            assert again.anchors == read.anchors
        bits = size.section_bits(compressed.blob)
        assert bits.keys() == set(size.SECTIONS)
        assert bits.total() == 8 * len(compressed.blob) and min(bits.values()) >= 0
        assert bits["connectivity"] == _codec.describe(compressed.blob)["bits"]["connectivity"]


@pytest.mark.parametrize("make", [make_vectors.several_groups, make_vectors.seams_between_meshlets])
def test_interior_is_what_the_reference_decoder_reads(make):
    blob = make()
    read: Counter = Counter()

    class CountingReader(reference_decoder.BitReader):
        def read(self, width, name):
            read[size.section_of(name)] += width
            return super().read(width, name)

    with mock.patch.object(reference_decoder, "BitReader", CountingReader):
        decoder = reference_decoder.Decoder(blob)
        for m in range(decoder.file.meshlet_count):
            decoder.meshlet(m)
    bits = size.section_bits(blob)
    assert read["interior"] == bits["interior"] > 0
    assert read["anchors"] == bits["anchors"] > 0


# --- the other codecs ---


def codecs() -> list:
    """A maker of each codec by name; it raises PeerMissing where the codec is not installed."""
    makers = {
        "draco-7": lambda: peers.Draco(7),
        "draco-10": lambda: peers.Draco(10),
        "corto": peers.Corto,
        "quantised": lambda: peers.Gltfpack(False),
        "meshopt": lambda: peers.Gltfpack(True),
    }
    return [pytest.param(maker, id=name) for name, maker in makers.items()]


@pytest.fixture(scope="module")
def torus_parts(tmp_path_factory) -> list[peers.Part]:
    path = tmp_path_factory.mktemp("torus") / "torus.glb"
    demo_model.write_glb([torus(4000)], path)
    return peers.read_parts(path)


def decoded_part(codec, buffers: list[bytes]) -> peers.Part:
    """The only primitive, in steps; of gltfpack, texture coordinates are in steps of each axis."""
    (found,) = codec.decoder(buffers)()
    if isinstance(codec, peers.Draco):
        arrays = (found.points, np.asarray(found.faces, np.uint32), found.normals, found.tex_coord)
    elif isinstance(codec, peers.Corto):
        positions, triangles, normals, _, texcoords = found
        arrays = (positions, triangles, normals, texcoords * 2.0 ** Bits().texcoord)
    else:
        arrays = gltf_arrays(peers.glb_chunks(buffers[0])[0], found)
    positions, triangles, normals, texcoords = arrays
    return peers.Part(triangles, np.rint(positions), normals, np.rint(texcoords))


def gltf_arrays(document: dict, views: list[bytes]) -> tuple[np.ndarray, ...]:
    """Positions, triangles, normals and texture coordinates of the first node's primitive."""
    types = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
    widths = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
    (node,) = (node for node in document["nodes"] if node["name"] == "part 0")
    (primitive,) = document["meshes"][node["mesh"]]["primitives"]

    def values(number: int) -> np.ndarray:
        accessor = document["accessors"][number]
        dtype, width = np.dtype(types[accessor["componentType"]]), widths[accessor["type"]]
        view = accessor["bufferView"]
        stride = document["bufferViews"][view].get("byteStride", dtype.itemsize * width)
        shape = (accessor["count"], width)
        strides = (stride, dtype.itemsize)
        return np.ndarray(shape, dtype, views[view], accessor["byteOffset"], strides)

    positions, normals, texcoords = (
        values(primitive["attributes"][name]).astype(np.float32)
        for name in ("POSITION", "NORMAL", "TEXCOORD_0")
    )
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    triangles = values(primitive["indices"]).reshape(-1, 3).astype(np.uint32)
    return positions, triangles, normals, texcoords


@pytest.mark.parametrize("maker", codecs())
def test_codecs_keep_triangles_and_steps(maker, torus_parts):
    """Decoding gives as many triangles and the same steps except for ties; normals are close."""
    try:
        codec = maker()
        decoded = decoded_part(codec, codec.encode(torus_parts))
    except peers.PeerMissing as missing:
        pytest.skip(str(missing))
    (before,), after = torus_parts, decoded
    assert len(after.triangles) == len(before.triangles)
    expected, found = (
        set(map(tuple, np.rint(part.positions).astype(int).tolist())) for part in (before, after)
    )
    assert len(expected ^ found) <= TIES * len(expected)
    assert np.array_equal(after.positions, np.rint(after.positions))
    places = {
        tuple(np.rint(p).astype(int).tolist()): n for p, n in zip(before.positions, before.normals)
    }
    pairs = [
        (places[key], n)
        for p, n in zip(after.positions, after.normals)
        if (key := tuple(p.astype(int).tolist())) in places
    ]
    cosines = [float(np.dot(a, b)) for a, b in pairs]
    assert np.median(cosines) > np.cos(np.radians(1))
    assert after.texcoords.max() == 2 ** Bits().texcoord - 1


@pytest.mark.parametrize("maker", codecs())
def test_codecs_report_what_they_write(maker, torus_parts):
    try:
        codec = maker()
    except peers.PeerMissing as missing:
        pytest.skip(str(missing))
    buffers = codec.encode(torus_parts)
    assert 0 < codec.file_bytes(buffers) <= sum(map(len, buffers))
    assert codec.resident_bytes(torus_parts, buffers) >= codec.file_bytes(buffers)
    assert codec.name and codec.version


def test_quantised_gltf_takes_two_bytes_per_component(torus_parts):
    """A vertex has 8 bytes of position, 4 of normal and 4 of texcoord, an index 2."""
    try:
        codec = peers.Gltfpack(False)
    except peers.PeerMissing as missing:
        pytest.skip(str(missing))
    part = torus_parts[0]
    plain = 16 * len(part.positions) + 6 * len(part.triangles)
    spanning_node = 64  # bytes of the node that spans the grid, at most
    assert plain <= codec.file_bytes(codec.encode(torus_parts)) <= plain + spanning_node


def test_missing_codecs_say_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setattr(peers, "NODE_MODULES", tmp_path)
    monkeypatch.setattr(peers, "CORTO", "")
    monkeypatch.setattr(shutil, "which", lambda command: None)
    found, missing = peers.available()
    assert not any(codec.name in ("Corto", "quantised glTF") for codec in found)
    assert len(missing) >= 2 and all(
        ("install" in line or "build" in line) and "\n" not in line for line in missing
    )


def test_parts_have_the_encoders_steps(tmp_path):
    """A part's rounded positions are the integers that our file decodes to."""
    blobs = require_compressed(open_model(compressed_demo(tmp_path)))
    parts = peers.read_parts(tmp_path / "in.glb")
    for part, compressed in zip(parts, blobs, strict=True):
        ours = _codec.decode(compressed.blob)[1][0]
        rounded = set(map(tuple, np.rint(part.positions).astype(int).tolist()))
        assert len(rounded ^ set(map(tuple, ours.tolist()))) <= TIES * len(rounded)

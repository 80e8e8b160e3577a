"""bench.meshlet_peers: the other formats of meshlets keep every triangle and every integer."""

import numpy as np
import pytest

from bench import common, meshlet_formats, meshlet_peers, peers
from bench.generated import torus
from bench.meshlet_peers import Integers
from gltf_ext import _codec
from gltf_ext.sources.primitives import Primitive
from gltf_meshlet.demo import model as demo_model

MAKERS = {
    "meshopt": meshlet_peers.MeshoptMeshlets,
    "dgf-sah": meshlet_peers.DenseGeometry,
    "dgf-hpg24": lambda: meshlet_peers.DenseGeometry("HPG24"),
}


@pytest.fixture(scope="module")
def primitives(tmp_path_factory) -> list[Primitive]:
    path = tmp_path_factory.mktemp("torus") / "torus.glb"
    demo_model.write_glb([torus(3000), torus(500)], path)
    return peers.read_primitives(path)


def triangle_rows(triangles: np.ndarray, values: np.ndarray) -> np.ndarray:
    """int64[T, 3 E]: the values of each triangle's corners, in an order that forgets the first.

    Each triangle begins with its least corner; the rows are sorted.
    """
    corners = values.astype(np.int64)[triangles]
    turned = [np.roll(corners, k, axis=1).reshape(len(corners), -1).tolist() for k in range(3)]
    return np.array(sorted(min(rows) for rows in zip(*turned)))


def made(name: str):
    try:
        return MAKERS[name]()
    except peers.PeerMissing as missing:
        pytest.skip(str(missing))


@pytest.mark.parametrize("name", MAKERS)
def test_decoding_gives_every_triangle(name, primitives):
    parts = meshlet_peers.integers_of(primitives)
    run = made(name).run(parts)
    assert len(parts) == len(run.decoded) == 2
    for before, after in zip(parts, run.decoded):
        elements = after.values.shape[1]
        assert elements in (3, before.values.shape[1])
        expected = triangle_rows(before.triangles, before.values[:, :elements])
        assert np.array_equal(triangle_rows(after.triangles, after.values), expected)
    assert 0 < run.meshlets < sum(len(part.triangles) for part in parts)
    assert min(run.decode_seconds) > 0


def test_meshopt_meshlets_hold_all_elements(primitives):
    parts = meshlet_peers.integers_of(primitives)
    run = made("meshopt").run(parts)
    assert [part.bits for part in run.decoded] == [part.bits for part in parts]
    assert [part.values.shape[1] for part in run.decoded] == [7, 7]


def test_blocks_carry_attributes_beside_them(primitives):
    """2 bytes of normal and 3 of texture coordinates per vertex of a block; a block has 128."""
    run = made("dgf-sah").run(meshlet_peers.integers_of(primitives))
    vertices = sum(len(part.values) for part in run.decoded)
    assert run.bytes == 128 * run.meshlets + 5 * vertices


def test_integers_are_those_of_our_encoder(primitives):
    _, blobs = meshlet_peers.compressed(primitives)
    for part, blob in zip(meshlet_peers.integers_of(primitives), blobs):
        triangles, values = _codec.decode(blob)[:2]
        ours = triangle_rows(np.asarray(triangles).reshape(-1, 3), np.concatenate(values, axis=1))
        assert np.array_equal(ours, triangle_rows(part.triangles, part.values))


def test_files_of_parts_are_read_as_written():
    parts = [
        Integers(np.array([[0, 1, 2]], np.uint32), np.arange(9, dtype=np.uint32).reshape(3, 3), b)
        for b in ((12, 12, 12), (4, 4, 5))
    ]
    again = meshlet_peers._parts(meshlet_peers._words(parts))
    assert [part.bits for part in again] == [part.bits for part in parts]
    for before, after in zip(parts, again):
        assert np.array_equal(after.triangles, before.triangles)
        assert np.array_equal(after.values, before.values)


def test_missing_checkouts_are_named(monkeypatch, tmp_path):
    monkeypatch.setenv("GLTF_MESHLET_DGF", str(tmp_path))
    monkeypatch.delenv("GLTF_MESHLET_MESHOPTIMIZER", raising=False)
    found, missing = meshlet_peers.available()
    assert not found and len(missing) == 2
    for line, variable in zip(missing, ("GLTF_MESHLET_DGF", "GLTF_MESHLET_MESHOPTIMIZER")):
        assert variable in line and "github.com/" in line and "\n" not in line


def test_committed_positions_hold_all_formats():
    rows, models = (
        common.read_result("meshlet_formats")["rows"],
        common.read_result("size")["models"],
    )
    assert [row["model"] for row in rows] == [row["model"] for row in models]
    for row in rows:
        ours = row["formats"][meshlet_formats.OURS]
        assert row["formats"][meshlet_formats.SINGLE]["bytes"] == ours["bytes"]
        for name in ("meshopt meshlets", "AMD DGF, SAH", "AMD DGF, HPG24"):
            assert row["formats"][name]["bytes"] > ours["bytes"]
            assert row["formats"][name]["decode_seconds"]["low"] > 0

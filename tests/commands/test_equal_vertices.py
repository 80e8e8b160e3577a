"""Vertices that are equal, or become so on the grid, are apart if those of the source are."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import gltf_ext
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.errors import MeshletError
from gltf_ext.sources import large
from gltf_ext.sources.importers import open_model
from gltf_meshlet.cli import main
from spec import reference_decoder, reference_gltf
from tests.helpers.environment import need_package
from tests.helpers.equal_vertices import VECTOR, assert_equal_vertices
from tests.helpers.gltf_builder import Builder, glb_bytes, glb_parts, grid_mesh
from tests.helpers.large import use_small_chunks
from tests.helpers.topology import topology, torus

EXTENSION = "EXT_meshlet_edgebreaker"


def tiles(count, size=8):
    """Square tiles in a row, each with vertices of its own along its edges."""
    positions, triangles = grid_mesh(size, size)
    positions[:, 2] = 0
    width = np.ptp(positions[:, 0])
    moved = [positions + np.float32([tile * width, 0, 0]) for tile in range(count)]
    numbers = [triangles + tile * len(positions) for tile in range(count)]
    return np.concatenate(moved), np.concatenate(numbers).astype(np.uint32)


def write(path, positions, triangles, **attributes):
    builder = Builder()
    builder.mesh({"POSITION": positions, **attributes}, triangles)
    builder.properties["nodes"] = [{"mesh": 0}]
    builder.properties["scenes"] = [{"nodes": [0]}]
    return builder.write(path)


def object_of(properties):
    return properties["meshes"][0]["primitives"][0]["extensions"][EXTENSION]


def changed(path, change):
    """Changes the JSON of a file."""
    properties, binary = glb_parts(path)
    change(properties)
    path.write_bytes(glb_bytes(properties, bytes(binary)))


@pytest.mark.parametrize(
    "options", [{}, {"page_bytes": 4096}, {"lod": True}, {"transport": True}], ids=str
)
def test_tiles_stay_apart(tmp_path, options):
    positions, triangles = tiles(5, 24 if options.get("lod") else 12)
    source = write(tmp_path / "tiles.glb", positions, triangles)
    output = tmp_path / "out.glb"
    report = gltf_ext.compress(source, output, **options)
    assert report["dropped"]["duplicate_vertices"] == 0
    (primitive,) = gltf_ext.load(output)
    assert topology(primitive.indices) == topology(triangles)
    assert primitive.vertex_count == len(positions)
    assert gltf_ext.validate(output) == []
    verified = gltf_ext.verify(source, output)
    assert verified["ok"] and verified["topology"]["original"]["islands"] == 5
    gltf_ext.decompress(output, tmp_path / "plain.glb")
    (plain,) = gltf_ext.load(tmp_path / "plain.glb")
    assert np.array_equal(plain.indices, primitive.indices)
    table = object_of(glb_parts(output)[0])["equalVertices"]["bufferView"]
    table_bytes = glb_parts(output)[0]["bufferViews"][table]["byteLength"]
    (compressed,) = require_compressed(open_model(output))
    assert compressed.table_bytes == table_bytes
    inspected = gltf_ext.inspect(output)["totals"]
    assert (
        inspected["compressed_bytes"] == len(compressed.blob) + compressed.json_bytes + table_bytes
    )


@pytest.mark.parametrize("options", [{}, {"transport": True}, {"fallback": True}], ids=str)
def test_meshes_that_share_a_primitive_share_the_table(tmp_path, options):
    """The views in front go, so that the table's gets another number, once for both meshes."""
    positions, triangles = tiles(3)
    source = write(tmp_path / "tiles.glb", positions, triangles)

    def share(properties):
        properties["meshes"].append(json.loads(json.dumps(properties["meshes"][0])))
        properties["nodes"].append({"mesh": 1})
        properties["scenes"][0]["nodes"].append(1)

    changed(source, share)
    gltf_ext.compress(source, tmp_path / "out.glb", **options)
    assert gltf_ext.validate(tmp_path / "out.glb") == []
    first, second = require_compressed(open_model(tmp_path / "out.glb"))
    assert first.object == second.object
    for primitive in gltf_ext.load(tmp_path / "out.glb"):
        assert topology(primitive.indices) == topology(triangles)


def test_the_reference_reads_the_same(tmp_path):
    positions, triangles = tiles(4)
    source = write(tmp_path / "tiles.glb", positions, triangles)
    gltf_ext.compress(source, tmp_path / "out.glb", page_bytes=4096)
    reference_gltf.check_file((tmp_path / "out.glb").read_bytes())
    (compressed,) = require_compressed(open_model(tmp_path / "out.glb"))
    decoded = reference_decoder.decode_view(bytes(compressed.blob))
    pairs = reference_gltf.read_equal_vertices(bytes(compressed.equal_vertices), decoded)
    numbers = {pair: number for number, pair in enumerate(dict.fromkeys(pairs))}
    corners = np.array([numbers[pair] for pair in pairs])
    (primitive,) = gltf_ext.load(tmp_path / "out.glb")
    assert len(set(zip(corners, primitive.indices.reshape(-1)))) == len(positions)
    assert topology(corners.reshape(-1, 3)) == topology(triangles)


def test_trimesh_has_them_apart(tmp_path):
    need_package("trimesh")
    import trimesh

    import gltf_ext.trimesh_handler

    positions, triangles = tiles(3)
    source = write(tmp_path / "tiles.glb", positions, triangles)
    gltf_ext.compress(source, tmp_path / "out.glb")
    (mesh,) = trimesh.load(tmp_path / "out.glb", process=False).geometry.values()
    assert topology(mesh.faces) == topology(triangles)
    (mesh,) = trimesh.load(VECTOR, process=False).geometry.values()
    assert_equal_vertices(mesh.faces, mesh.vertices)


def test_a_soup_is_joined_and_counted(tmp_path, capsys):
    positions, triangles = grid_mesh(9, 9)
    soup = positions[triangles].reshape(-1, 3).astype(np.float32)
    source = write(
        tmp_path / "soup.glb", soup, np.arange(len(soup), dtype=np.uint32).reshape(-1, 3)
    )
    assert main(["compress", str(source), str(tmp_path / "out.glb")]) == 0
    joined = len(soup) - len(positions)
    assert f"{joined:,} equal vertices joined" in capsys.readouterr().out
    (primitive,) = gltf_ext.load(tmp_path / "out.glb")
    assert primitive.vertex_count == len(positions)
    assert gltf_ext.verify(source, tmp_path / "out.glb")["ok"]


def test_parts_say_what_they_join(tmp_path, capsys, monkeypatch):
    positions, triangles = tiles(4)
    source = write(tmp_path / "tiles.glb", positions, triangles)
    use_small_chunks(monkeypatch, 100)
    output = tmp_path / "out.glb"
    assert main(["compress", str(source), str(output), "--max-memory", "1G"]) == 0
    assert "; 24 equal vertices joined" in capsys.readouterr().out
    monkeypatch.undo()
    assert gltf_ext.verify(source, output)["joined_vertices"] == 24


def test_parts_of_several_numberings_say_that_they_join(tmp_path, monkeypatch):
    """Nothing counts the vertices of such a file."""
    positions, triangles = tiles(4)
    lines = [f"v {x} {y} {z}" for x, y, z in positions.tolist()]
    lines += ["vn 0 0 1", *("f " + " ".join(f"{v}//1" for v in t + 1) for t in triangles)]
    (tmp_path / "tiles.obj").write_text("\n".join(lines))
    report = gltf_ext.compress(tmp_path / "tiles.obj", tmp_path / "out.glb")
    assert report["dropped"]["duplicate_vertices"] == 0 and report["warnings"] == []
    use_small_chunks(monkeypatch, 100)
    monkeypatch.setattr(large, "_memory_of", lambda path: 1 << 40)
    report = gltf_ext.compress(tmp_path / "tiles.obj", tmp_path / "out.glb", max_memory="1G")
    assert report["dropped"]["duplicate_vertices"] == 0
    (warning,) = report["warnings"]
    assert warning.startswith("mesh 0 primitive 0: read in parts, so vertices that are equal")


def test_verify_says_what_is_joined(tmp_path):
    positions, triangles = tiles(3)
    source = write(tmp_path / "tiles.glb", positions, triangles)
    output = tmp_path / "out.glb"
    gltf_ext.compress(source, output)
    changed(output, lambda properties: object_of(properties).pop("equalVertices"))
    verified = gltf_ext.verify(source, output)
    assert verified["ok"] and verified["joined_vertices"] == 2 * 8
    assert "are joined: " in verified["warnings"][0]


def test_a_compressed_source_keeps_them(tmp_path):
    positions, triangles = tiles(3)
    source = write(tmp_path / "tiles.glb", positions, triangles)
    gltf_ext.compress(source, tmp_path / "once.glb", page_bytes=4096)
    gltf_ext.compress(tmp_path / "once.glb", tmp_path / "twice.glb")
    (primitive,) = gltf_ext.load(tmp_path / "twice.glb")
    assert topology(primitive.indices) == topology(triangles)


def test_vertices_that_the_grid_makes_equal_stay_apart(tmp_path):
    """Two sheets closer than any step."""
    positions, triangles = grid_mesh(12, 12)
    other = positions + np.float32([0, 0, 1e-6])
    both = np.concatenate([positions, other]).astype(np.float32)
    numbers = np.concatenate([triangles, triangles + len(positions)]).astype(np.uint32)
    source = write(tmp_path / "sheets.glb", both, numbers)
    gltf_ext.compress(source, tmp_path / "out.glb", position_bits=8)
    (primitive,) = gltf_ext.load(tmp_path / "out.glb")
    assert topology(primitive.indices) == topology(numbers)
    assert gltf_ext.verify(source, tmp_path / "out.glb")["ok"]


@settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 10**6), share=st.sampled_from([0.02, 0.3, 1.0]), bits=st.integers(4, 14))
def test_any_split_of_vertices_comes_back(tmp_path, seed, share, bits):
    """Corners at random vertices get copies, at random."""
    random = np.random.default_rng(seed)
    positions, triangles = torus(9, 7)
    chosen = np.isin(triangles, np.flatnonzero(random.random(len(positions)) < share))
    copy = np.where(chosen, random.integers(0, 3, triangles.shape), 0)
    numbers, corners = np.unique(triangles + len(positions) * copy, return_inverse=True)
    corners = corners.reshape(-1, 3).astype(np.uint32)
    positions = positions[numbers % len(positions)].astype(np.float32)
    source = write(tmp_path / "in.glb", positions, corners)
    gltf_ext.compress(source, tmp_path / "out.glb", position_bits=bits, page_bytes=4096)
    (primitive,) = gltf_ext.load(tmp_path / "out.glb")
    assert primitive.vertex_count == len(positions)
    assert topology(primitive.indices) == topology(corners)


@pytest.mark.parametrize("seed", range(12))
def test_a_damaged_table_is_refused_or_read(tmp_path, seed):
    positions, triangles = tiles(3)
    source = write(tmp_path / "tiles.glb", positions, triangles)
    output = tmp_path / "out.glb"
    gltf_ext.compress(source, output)
    random = np.random.default_rng(seed)

    def damage(properties):
        number = object_of(properties)["equalVertices"]["bufferView"]
        view = properties["bufferViews"][number]
        if seed % 3 == 0:
            view["byteLength"] = int(random.integers(1, view["byteLength"]))
        else:
            view["byteOffset"] = 4 * int(random.integers(0, view["byteOffset"] // 4))

    changed(output, damage)
    try:
        (primitive,) = gltf_ext.load(output)
    except MeshletError as error:
        assert "equal vertices" in str(error)
        assert any("equal vertices" in problem for problem in gltf_ext.validate(output))
    else:
        assert primitive.triangle_count == len(triangles)
        assert primitive.indices.max() < primitive.vertex_count


@pytest.mark.parametrize("value", [7, {}, {"bufferView": 99}, {"bufferView": "0"}, None], ids=str)
def test_a_table_that_is_none(tmp_path, value):
    positions, triangles = tiles(2)
    source = write(tmp_path / "tiles.glb", positions, triangles)
    gltf_ext.compress(source, tmp_path / "out.glb")

    changed(
        tmp_path / "out.glb",
        lambda properties: object_of(properties).update(equalVertices=value),
    )
    with pytest.raises(MeshletError):
        gltf_ext.load(tmp_path / "out.glb")
    assert gltf_ext.validate(tmp_path / "out.glb")

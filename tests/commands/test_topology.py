"""One vertex of the source is one vertex of what is decoded, by every reader in Python."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import gltf_ext
from gltf_ext.attributes import extension, join
from gltf_ext.lod.cuts import cut_at_error, cut_at_level
from gltf_ext.lod.reading import open_lod
from gltf_ext.sources.importers import open_model
from gltf_meshlet.cli import main
from tests.helpers.environment import need_package
from tests.helpers.gltf_builder import Builder, grid_mesh
from tests.helpers.topology import topology, torus


def with_attributes(positions, triangles, *, seam, morph, skin, seed=0):
    """(attributes, triangles, targets): along a seam, vertices have two texture coordinates."""
    random = np.random.default_rng(seed)
    uv = np.abs(positions[:, :2]).astype(np.float32)
    if seam:
        is_moved = positions[triangles].mean(axis=1)[:, 2] > 0
        moved = np.unique(triangles[is_moved])
        place = np.zeros(len(positions), np.uint32)
        place[moved] = len(positions) + np.arange(len(moved))
        triangles = np.where(is_moved[:, None], place[triangles], triangles).astype(np.uint32)
        positions, uv = (
            np.concatenate([positions, positions[moved]]),
            np.concatenate([uv, uv[moved] + 9]),
        )
    count = len(positions)
    attributes = {"POSITION": positions, "TEXCOORD_0": uv}
    if skin:
        attributes["JOINTS_0"] = random.integers(0, 4, (count, 4)).astype(np.uint8)
        attributes["WEIGHTS_0"] = random.dirichlet(np.ones(4), count).astype(np.float32)
    targets = [{"POSITION": (0.1 * positions[:, ::-1]).astype(np.float32)}] if morph else []
    return attributes, triangles, targets


def write(path, *meshes):
    builder = Builder()
    for attributes, triangles, targets in meshes:
        builder.mesh(attributes, triangles, targets)
    builder.properties["nodes"] = [{"mesh": m} for m in range(len(meshes))]
    builder.properties["scenes"] = [{"nodes": list(range(len(meshes)))}]
    return builder.write(path)


def assert_same(decoded, *expected):
    assert [topology(p.indices) for p in decoded] == [topology(t) for _, t, _ in expected]
    for primitive in decoded:
        assert primitive.vertex_count == len(np.unique(primitive.indices))
        a, b, c = primitive.indices.T
        assert not ((a == b) | (b == c) | (c == a)).any()


ATTRIBUTES = [
    {"seam": False, "morph": False, "skin": False},
    {"seam": True, "morph": True, "skin": True},
]
OPTIONS = [
    {},
    {"lod": True},
    {"page_bytes": 4096},
    {"page_bytes": 4096, "lod": True, "fallback": True},
    {"page_bytes": 4096, "position_bits": 7},  # many triangles collapse
]


@pytest.mark.parametrize("attributes", ATTRIBUTES, ids=["plain", "seams"])
@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_closed_surfaces_stay_closed(options, attributes, tmp_path):
    mesh = with_attributes(*torus(160, 60), **attributes)
    original = write(tmp_path / "in.glb", mesh)
    packed, plain = tmp_path / "out.glb", tmp_path / "plain.glb"
    gltf_ext.compress(original, packed, **options)
    assert_same(gltf_ext.load(packed), mesh)
    gltf_ext.decompress(packed, plain)
    assert_same(gltf_ext.load(plain), mesh)
    gltf_ext.decompress(packed, plain, level=0)
    assert_same(gltf_ext.load(plain), mesh)
    report = gltf_ext.verify(original, packed)
    assert report["ok"], report["problems"]
    vertices, edges, islands = topology(mesh[1])
    expected = {"vertices": vertices, "boundary_edges": edges, "islands": islands}
    assert report["topology"] == {"original": expected, "compressed": expected}


def test_values_are_those_of_the_file(tmp_path):
    """Joined vertices and triangles have the values that the file has."""
    mesh = with_attributes(*torus(120, 50), seam=True, morph=True, skin=True)
    gltf_ext.compress(write(tmp_path / "in.glb", mesh), tmp_path / "out.glb", page_bytes=4096)
    (compressed,) = extension.compressed_primitives(open_model(tmp_path / "out.glb"))
    whole, joined = compressed.decode(), join.decode(compressed)
    assert joined.vertex_count < whole.vertex_count
    for (name, a), (_, b) in zip(whole.arrays, joined.arrays, strict=True):
        np.testing.assert_array_equal(a[whole.indices], b[joined.indices], err_msg=name)


@pytest.mark.parametrize("bits", [7, 12])
def test_parts_are_joined_as_the_whole(bits, tmp_path, monkeypatch):
    """decompress reads large files in parts."""
    mesh = with_attributes(*torus(120, 50), seam=True, morph=False, skin=False)
    original = write(tmp_path / "in.glb", mesh)
    gltf_ext.compress(original, tmp_path / "out.glb", page_bytes=4096, position_bits=bits)
    monkeypatch.setattr(extension, "PART_BYTES", 5_000)
    (compressed,) = extension.compressed_primitives(open_model(tmp_path / "out.glb"))
    assert len(list(extension.parts_of(compressed.blob))) > 3
    gltf_ext.decompress(tmp_path / "out.glb", tmp_path / "plain.glb")
    (plain,), (loaded,) = (gltf_ext.load(tmp_path / f"{n}.glb") for n in ("plain", "out"))
    assert_same([plain], mesh)
    np.testing.assert_array_equal(plain.indices, loaded.indices)
    for (name, a), (_, b) in zip(plain.arrays, loaded.arrays, strict=True):
        np.testing.assert_array_equal(a, b, err_msg=name)


def test_levels_are_closed(tmp_path):
    mesh = with_attributes(*torus(160, 60), seam=False, morph=False, skin=False)
    gltf_ext.compress(
        write(tmp_path / "in.glb", mesh),
        tmp_path / "out.glb",
        lod=True,
        page_bytes=4096,
        position_bits=12,
    )
    for level in (1, 2, 3):
        gltf_ext.decompress(tmp_path / "out.glb", tmp_path / "plain.glb", level=level)
        (coarse,) = gltf_ext.load(tmp_path / "plain.glb")
        _, edges, islands = topology(coarse.indices)
        assert (edges, islands) == (0, 1) and coarse.triangle_count < len(mesh[1])
    (primitive,) = open_lod(tmp_path / "out.glb")
    errors = np.unique(primitive.tables.groups["error"])
    for error in errors[:: max(len(errors) // 5, 1)]:
        edges, islands = topology(primitive.mesh(cut_at_error(primitive.tables, error)).indices)[1:]
        assert (edges, islands) == (0, 1)
    assert_same([primitive.mesh(cut_at_level(primitive.tables, 0))], mesh)


def cracked(columns, rows, width):
    """A torus, cut open along a ring where both sides lie `width` apart."""
    positions, triangles = torus(columns, rows)
    half = triangles.max(axis=1) < columns * rows // 2
    shared = np.intersect1d(triangles[half], triangles[~half])
    place = np.arange(len(positions))
    place[shared] = len(positions) + np.arange(len(shared))
    opened = np.where(half[:, None], place[triangles], triangles).astype(np.uint32)
    return np.concatenate([positions, positions[shared] * np.float32(1 - width)]), opened


def test_cracks_narrower_than_the_grid_stay_open(tmp_path):
    positions, triangles = cracked(60, 40, 1e-6)
    mesh = ({"POSITION": positions}, triangles, [])
    assert topology(triangles)[1] > 100
    original = write(tmp_path / "in.glb", mesh)
    for options in ({}, {"page_bytes": 65536}):
        gltf_ext.compress(original, tmp_path / "out.glb", **options)
        assert_same(gltf_ext.load(tmp_path / "out.glb"), mesh)
        assert gltf_ext.verify(original, tmp_path / "out.glb")["ok"]


def test_verify_fails_when_a_crack_closes(tmp_path, capsys):
    positions, triangles = cracked(60, 40, 1e-6)
    original = write(tmp_path / "in.glb", ({"POSITION": positions}, triangles, []))
    closed, all_triangles = torus(60, 40)
    other = write(tmp_path / "closed.glb", ({"POSITION": closed}, all_triangles, []))
    gltf_ext.compress(other, tmp_path / "out.glb", position_bits=12)
    report = gltf_ext.verify(original, tmp_path / "out.glb")
    assert report["triangles_equal"] and not report["ok"]
    (problem,) = report["problems"]
    assert problem.startswith("mesh 0 primitive 0: ") and "boundary edges became 0" in problem
    assert main(["verify", str(original), str(tmp_path / "out.glb")]) == 1
    assert "CONNECTED DIFFERENTLY" in capsys.readouterr().out


def test_touching_surfaces_stay_apart_and_points_together(tmp_path):
    """Two closed surfaces that share one vertex are one island; two that lie on each other, two."""
    positions, triangles = torus(30, 20)
    second = triangles + np.uint32(len(positions))
    second[second == len(positions)] = 0
    touching = ({"POSITION": np.concatenate([positions, positions * np.float32([-1, 1, 1])
                 + np.float32([6, 0, 0])])}, np.concatenate([triangles, second]), [])  # fmt: skip
    double = ({"POSITION": np.concatenate([positions, positions + np.float32(1e-6)])},
              np.concatenate([triangles, triangles + np.uint32(len(positions))]), [])  # fmt: skip
    for page_bytes in (0, 4096):
        gltf_ext.compress(
            write(tmp_path / "in.glb", touching),
            tmp_path / "out.glb",
            page_bytes=page_bytes or None,
        )
        assert_same(gltf_ext.load(tmp_path / "out.glb"), touching)
    gltf_ext.compress(write(tmp_path / "in.glb", double), tmp_path / "out.glb")
    assert_same(gltf_ext.load(tmp_path / "out.glb"), double)


def test_trimesh_loads_closed_meshes(tmp_path):
    need_package("trimesh")
    import trimesh

    import gltf_ext.trimesh_handler

    mesh = ({"POSITION": torus(120, 50)[0]}, torus(120, 50)[1], [])
    gltf_ext.compress(write(tmp_path / "in.glb", mesh), tmp_path / "out.glb", page_bytes=4096)
    for loaded in (
        trimesh.load(tmp_path / "out.glb", process=False),
        gltf_ext.trimesh_handler.load(tmp_path / "out.glb", process=False),
    ):
        (geometry,) = loaded.geometry.values()
        assert geometry.is_watertight
        assert topology(np.asarray(geometry.faces)) == topology(mesh[1])


@given(
    sizes=st.lists(st.tuples(st.integers(3, 40), st.integers(3, 40)), min_size=1, max_size=3),
    noise=st.sampled_from([0.0, 0.02]),
    seed=st.integers(0, 1000),
    bits=st.integers(9, 16),
    page_bytes=st.sampled_from([None, 4096]),
    lod=st.booleans(),
    attributes=st.fixed_dictionaries({n: st.booleans() for n in ("seam", "morph", "skin")}),
)
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_random_closed_surfaces(
    sizes, noise, seed, bits, page_bytes, lod, attributes, tmp_path_factory
):
    folder = tmp_path_factory.mktemp("random")
    parts = [
        torus(*size, offset=7.0 * i, noise=noise, seed=seed + i) for i, size in enumerate(sizes)
    ]
    begins = np.cumsum([0, *(len(points) for points, _ in parts)]).astype(np.uint32)
    positions = np.concatenate([points for points, _ in parts])
    triangles = np.concatenate([t + begin for (_, t), begin in zip(parts, begins)])
    mesh = with_attributes(positions, triangles, seed=seed, **attributes)
    original = write(folder / "in.glb", mesh)
    gltf_ext.compress(
        original, folder / "out.glb", position_bits=bits, page_bytes=page_bytes, lod=lod
    )
    assert_same(gltf_ext.load(folder / "out.glb"), mesh)
    assert gltf_ext.verify(original, folder / "out.glb")["ok"]


@pytest.mark.parametrize("seam", [False, True])
def test_cracks_that_are_noise_stay(tmp_path, seam):
    """Two halves of a sheet whose borders differ by what floats round, as transforms leave them.

    They are in the original, and take no more bits.
    """
    positions, triangles = grid_mesh(12, 12)
    positions = positions - positions.mean(axis=0)
    is_border = np.abs(positions[:, 1]) == np.abs(positions[:, 1]).min()
    positions[is_border, 1] = 3.97e-7
    other = positions.copy()
    other[is_border, 1] = np.nextafter(np.float32(3.97e-7), np.float32(1))
    is_low = positions[triangles][:, :, 1].min(axis=1) < 0
    both = np.concatenate([triangles[is_low], triangles[~is_low] + len(positions)])
    uv = np.concatenate([positions[:, :2], positions[:, :2] + np.float32(seam)])
    attributes = {"POSITION": np.concatenate([positions, other]), "TEXCOORD_0": uv}
    path = write(tmp_path / "in.glb", (attributes, both.astype(np.uint32), []))
    report = gltf_ext.compress(path, tmp_path / "out.glb")
    assert report["primitives"][0]["attributes"]["POSITION"]["bits_per_component"][0] <= 14
    verified = gltf_ext.verify(path, tmp_path / "out.glb")
    assert verified["ok"] and verified["topology"]["original"] == verified["topology"]["compressed"]
    (decoded,) = gltf_ext.load(tmp_path / "out.glb")
    sides = 2 * int(is_border.sum() - 1)
    assert topology(decoded.indices)[1] == topology(triangles)[1] + sides == topology(both)[1]

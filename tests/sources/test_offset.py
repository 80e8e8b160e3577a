"""Doubles of .obj and .ply far from the origin."""

import numpy as np
import pytest

import gltf_ext
from gltf_ext.sources.importers import read_meshes
from gltf_ext.sources.offset import SAMPLE, Offset
from gltf_ext.sources.row_arrays import rows_in_files
from gltf_ext.work_files import WorkFile
from tests.helpers.gltf_builder import glb_bytes, glb_json, glb_parts, grid_mesh

PLACE = np.array([456789.125, 5432109.25, 321.5])
SPACING = 0.0625  # of vertices: a float has steps of 0.5 there


def far_sheet():
    positions, triangles = grid_mesh(20, 20)
    return positions.astype(np.float64) * 20 * SPACING + PLACE, triangles


def write_obj(path, positions, triangles):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in positions.tolist()]
    lines += ["f {} {} {}".format(*(triangle + 1)) for triangle in triangles]
    path.write_text("\n".join(lines) + "\n")


def write_ply(path, positions, triangles, binary=False):
    kind = "binary_little_endian" if binary else "ascii"
    header = f"ply\nformat {kind} 1.0\nelement vertex {len(positions)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz")
    header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    if binary:
        faces = np.empty(len(triangles), [("n", "u1"), ("i", "<i4", 3)])
        faces["n"], faces["i"] = 3, triangles
        path.write_bytes(header.encode() + positions.tobytes() + faces.tobytes())
        return
    rows = ["{!r} {!r} {!r}".format(*row) for row in positions.tolist()]
    rows += ["3 {} {} {}".format(*triangle) for triangle in triangles]
    path.write_text(header + "\n".join(rows) + "\n")


def write_stl(path, positions, triangles):
    facet = "facet normal 0 0 1\nouter loop\n{}\nendloop\nendfacet"
    vertices = [f"vertex {x!r} {y!r} {z!r}" for x, y, z in positions.tolist()]
    facets = [facet.format("\n".join(vertices[i] for i in triangle)) for triangle in triangles]
    path.write_text("\n".join(["solid a", *facets, "endsolid a"]) + "\n")


def write(path, positions, triangles):
    if path.suffix == ".obj":
        write_obj(path, positions, triangles)
    elif path.suffix == ".stl":
        write_stl(path, positions, triangles)
    else:
        write_ply(path, positions, triangles, binary="binary" in path.name)
    return path


@pytest.mark.parametrize("name", ["far.obj", "far.ply", "far_binary.ply", "far.stl"])
def test_doubles_far_from_the_origin_keep_their_places(tmp_path, name):
    positions, triangles = far_sheet()
    path, output = write(tmp_path / name, positions, triangles), tmp_path / "out.glb"
    report = gltf_ext.compress(path, output)
    assert report["dropped"]["degenerate_triangles"] == 0
    (node,) = glb_json(output)["nodes"]
    (decoded,) = gltf_ext.load(output)
    world = decoded.attributes["POSITION"].astype(np.float64) + node["translation"]
    assert len(world) == len(positions)
    step = report["steps"]["POSITION"]["step"][1]
    order = [np.lexsort(np.rint(points / SPACING / 4).T) for points in (world, positions)]
    nearest = np.abs(world[:, None] - positions[None]).max(axis=2).min(axis=1)
    assert len(order[0]) and nearest.max() <= step / 2 + 1e-5
    assert np.array_equal(np.float32(node["translation"]), node["translation"])
    verified = gltf_ext.verify(path, output)
    assert verified["ok"] and 0 < verified["max_error"]["POSITION"] < step


def test_large_files_have_the_same_offset(tmp_path):
    positions, triangles = far_sheet()
    path = write(tmp_path / "far.ply", positions, triangles)
    gltf_ext.compress(path, tmp_path / "whole.glb")
    gltf_ext.compress(path, tmp_path / "parts.glb", max_memory="110M")
    whole, parts = (glb_json(tmp_path / f"{n}.glb")["nodes"] for n in ("whole", "parts"))
    assert whole == parts and "translation" in whole[0]


def beside_exact(positions, triangles, count=9000):
    """The same behind so many triangles whose positions floats hold, more than a first block."""
    places = np.rint(PLACE) + np.arange(3 * count).reshape(-1, 1) % 7 * [1.0, 2.0, 4.0]
    exact = np.arange(3 * count).reshape(-1, 3)
    assert np.array_equal(np.float32(places), places)
    return np.concatenate([places, positions]), np.concatenate([exact, triangles + 3 * count])


@pytest.mark.parametrize("name", ["late.obj", "late.ply", "late_binary.ply", "late.stl"])
def test_all_vertices_decide_the_offset(tmp_path, name):
    """Those of the first block are whole numbers, which floats hold."""
    positions, triangles = beside_exact(*far_sheet())
    path = write(tmp_path / name, positions, triangles)
    report = gltf_ext.compress(path, tmp_path / "out.glb")
    assert not [line for line in report["warnings"] if "are doubles" in line]
    (node,) = glb_json(tmp_path / "out.glb")["nodes"]
    assert np.abs(np.array(node["translation"]) - PLACE).max() < 20
    verified = gltf_ext.verify(path, tmp_path / "out.glb")
    assert verified["ok"] and verified["max_error"]["POSITION"] < SPACING / 4


def test_large_files_are_read_again_for_an_offset(tmp_path):
    positions, triangles = beside_exact(*far_sheet(), count=60000)
    path = write(tmp_path / "late.ply", positions, triangles)
    gltf_ext.compress(path, tmp_path / "whole.glb")
    gltf_ext.compress(path, tmp_path / "parts.glb", max_memory="110M")
    whole, parts = (glb_json(tmp_path / f"{n}.glb")["nodes"] for n in ("whole", "parts"))
    assert whole == parts and "translation" in whole[0]


@pytest.mark.parametrize("name", ["late.obj", "late_binary.ply", "late.stl"])
def test_a_second_reading_takes_no_more_space(tmp_path, monkeypatch, name):
    """The work file of the first one is gone, whose rows nothing has any more."""
    sizes, write_file = [], WorkFile.write

    def write_and_note(self, data, offset):
        write_file(self, data, offset)
        sizes.append(self.size)

    monkeypatch.setattr(WorkFile, "write", write_and_note)
    positions, triangles = beside_exact(*far_sheet())
    path = write(tmp_path / name, positions, triangles)
    contents = read_meshes(path, rows_in_files(str(tmp_path)))
    assert any(contents.offset)
    least = sum(
        12 * rows.count for m in contents.meshes for rows in m.primitives[0].attributes.values()
    )
    assert least <= sizes[-1] == max(sizes) and sizes[0] in sizes[1:]


def test_small_blocks_count_by_their_vertices(tmp_path):
    """As the solids of an .stl may be: 1 % of the vertices, but most of the blocks."""
    offset, random = Offset(), np.random.default_rng(1)
    large = 16 * SAMPLE
    for _ in range(16):
        offset.to_local(random.random((large // 16, 3)))
    for _ in range(large // 300):
        offset.to_local(np.full((3, 3), 9.0))
    values = offset._sample.values()
    assert SAMPLE / 2 < len(values) <= 2 * SAMPLE
    assert abs((values == 9.0).mean() - 0.01) < 0.001


def test_a_detail_that_comes_first_moves_no_model_near_the_origin(tmp_path):
    """The first block is a small part that is far from the origin, for its size."""
    place, count = np.array([1000.3, 0.1, 0.2]), 9000
    detail = place + np.random.default_rng(1).random((3 * count, 3)) / 100
    room = np.random.default_rng(2).random((9 * count, 3)) * 2000 - 1000
    triangles = np.arange(12 * count).reshape(-1, 3)
    path = write(tmp_path / "a_binary.ply", np.concatenate([detail, room]), triangles)
    gltf_ext.compress(path, tmp_path / "out.glb")
    assert "translation" not in glb_json(tmp_path / "out.glb")["nodes"][0]


@pytest.mark.parametrize("name", ["near.obj", "near.ply"])
def test_models_near_the_origin_stay(tmp_path, name):
    positions, triangles = grid_mesh(20, 20)
    path = write(tmp_path / name, positions.astype(np.float64) / 3 + 5, triangles)
    gltf_ext.compress(path, tmp_path / "out.glb")
    assert "translation" not in glb_json(tmp_path / "out.glb")["nodes"][0]


def test_exact_floats_stay_where_they_are(tmp_path):
    positions, triangles = grid_mesh(20, 20)
    positions = np.rint(positions.astype(np.float64) * 8) + 2**20
    gltf_ext.compress(write(tmp_path / "a.ply", positions, triangles), tmp_path / "out.glb")
    assert "translation" not in glb_json(tmp_path / "out.glb")["nodes"][0]


def test_objects_with_parents_move_once(tmp_path):
    positions, triangles = far_sheet()
    path = tmp_path / "groups.obj"
    write_obj(path, positions, triangles)
    lines = path.read_text().splitlines()
    at = len(positions)
    text = [*lines[:at], "o one", "g a", *lines[at : at + 300], "g b", *lines[at + 300 :]]
    path.write_text("\n".join(text))
    gltf_ext.compress(path, tmp_path / "out.glb", obj_groups=True)
    nodes = glb_json(tmp_path / "out.glb")["nodes"]
    moved = [node for node in nodes if "translation" in node]
    assert len(moved) == 1 and moved[0]["name"] == "one"
    assert gltf_ext.verify(path, tmp_path / "out.glb", obj_groups=True)["ok"]


def test_parts_that_are_too_far_apart_are_warned_of(tmp_path):
    positions, triangles = far_sheet()
    both = np.concatenate([positions / 1e6, positions])
    path = write(tmp_path / "a.ply", both, np.concatenate([triangles, triangles + len(positions)]))
    report = gltf_ext.compress(path, tmp_path / "out.glb")
    (warning,) = [w for w in report["warnings"] if "positions are doubles" in w]
    assert "split the model" in warning
    verified = gltf_ext.verify(path, tmp_path / "out.glb")
    assert not verified["ok"] and "are doubles" in verified["losses"][0]


def test_verify_sees_a_node_that_moved(tmp_path):
    positions, triangles = far_sheet()
    path, output = write(tmp_path / "far.ply", positions, triangles), tmp_path / "out.glb"
    gltf_ext.compress(path, output)
    properties, binary = glb_parts(output)
    properties["nodes"][0]["translation"][1] += 0.5
    output.write_bytes(glb_bytes(properties, bytes(binary)))
    verified = gltf_ext.verify(path, output)
    assert not verified["ok"]
    assert "shows mesh 0 elsewhere, by 0.5" in verified["problems"][0]


def test_an_offset_holds_for_floats_too(tmp_path):
    """Of two lists of vertices, one of doubles and one of floats."""
    header = "ply\nformat binary_little_endian 1.0\n"
    for kind in ("double", "float"):
        header += "element vertex 3\n" + "".join(f"property {kind} {axis}\n" for axis in "xyz")
    header += "element face 2\nproperty list uchar uchar vertex_indices\nend_header\n"
    first = np.array([[0.1, 0, 0], [1, 0, 0], [0, 1, 0]]) + 1e6
    second = (first + np.array([0, 0, 1])).astype(np.float32)
    faces = bytes([3, 0, 1, 2, 3, 3, 4, 5])
    path = tmp_path / "in.ply"
    path.write_bytes(header.encode() + first.tobytes() + second.tobytes() + faces)
    gltf_ext.compress(path, tmp_path / "out.glb")
    (node,) = glb_json(tmp_path / "out.glb")["nodes"]
    (decoded,) = gltf_ext.load(tmp_path / "out.glb")
    world = decoded.attributes["POSITION"].astype(np.float64) + node["translation"]
    assert (np.abs(world - 1e6) < 1.1).all()

"""NaN and infinity in a model: what they stand in is repaired, each with a warning."""

import struct

import numpy as np
import pytest

import gltf_ext
from gltf_ext.sources import large, repair
from gltf_ext.sources.source import ArrayRows, Source
from tests.helpers.gltf_builder import Builder, everything, glb_json, grid_mesh

LEFT_OUT = "triangles left out, as a position is not finite: "


def compressed(original, output, **options):
    """Compress and verify; return (report, primitives)."""
    report = gltf_ext.compress(original, output, **options)
    verified = gltf_ext.verify(original, output)
    assert verified["ok"], verified["problems"]
    assert gltf_ext.validate(output) == []
    return report, gltf_ext.load(output)


def sheet(tmp_path, name, row, indexed=True, value=np.nan):
    """A sheet with every kind of attribute, of which one has a value that is not finite.

    Returns (path, attributes before, triangles before).
    """
    attributes, triangles, targets = everything(columns=5, rows=4)
    attributes["NORMAL"] = np.tile(np.float32([0, 0, 1]), (20, 1))
    sets = [attributes, *targets]
    if not indexed:
        rows = triangles.reshape(-1)
        sets = [{n: values[rows] for n, values in names.items()} for names in sets]
    holder = sets[1] if name.startswith("targets") else sets[0]
    local = name.rpartition(".")[2]
    changed = holder[local].copy()
    changed[row, 1] = value
    before = dict(sets[0])
    holder[local] = changed
    builder = Builder()
    builder.mesh(sets[0], triangles if indexed else None, sets[1:])
    return builder.write(tmp_path / "in.glb"), before, triangles


@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize("value", [np.nan, -np.inf])
def test_triangles_at_positions_are_left_out(tmp_path, indexed, value):
    path, _, triangles = sheet(tmp_path, "POSITION", 7, indexed, value)
    report, (primitive,) = compressed(path, tmp_path / "out.glb")
    lost = int((triangles == 7).any(axis=1).sum()) if indexed else 1
    assert report["dropped"]["non_finite_triangles"] == lost
    assert f"{LEFT_OUT}{lost}" in report["warnings"]
    assert primitive.triangle_count == len(triangles) - lost
    assert np.isfinite(primitive.attributes["POSITION"]).all()


@pytest.mark.parametrize(
    "name, expected, text",
    [
        ("TEXCOORD_0", [0, 0], "texture coordinates that are not finite, now 0: 1"),
        ("COLOR_0", [1, 1, 1, 1], "colours that are not finite, now white: 1"),
        ("targets[0].POSITION", [0, 0, 0], "values of morph targets that are not finite, now 0: 1"),
    ],
)
def test_values_are_replaced(tmp_path, name, expected, text):
    path, before, triangles = sheet(tmp_path, name, 7)
    report, (primitive,) = compressed(path, tmp_path / "out.glb")
    assert text in report["warnings"] and report["dropped"]["non_finite_triangles"] == 0
    assert primitive.triangle_count == len(triangles)
    values = dict(primitive.arrays)
    (row,) = np.flatnonzero(values["_ID"].ravel() == before["_ID"].ravel()[7])
    assert np.allclose(values[name][row], expected, atol=1e-3)


def test_normals_are_computed_again(tmp_path):
    """Of the triangles around: here those of a sheet with waves."""
    path, before, triangles = sheet(tmp_path, "NORMAL", 7)
    report, (primitive,) = compressed(path, tmp_path / "out.glb", normal_bits=16)
    text = "normals that are not finite, computed from the triangles around them: 1"
    assert text in report["warnings"]
    corners = before["POSITION"][triangles[(triangles == 7).any(axis=1)]].astype(float)
    expected = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    (row,) = np.flatnonzero(primitive.attributes["_ID"].ravel() == before["_ID"].ravel()[7])
    found = primitive.attributes["NORMAL"][row]
    assert np.allclose(found, expected / np.linalg.norm(expected), atol=1e-3)


def test_tangents_are_at_right_angles_to_normals(tmp_path):
    path, before, _ = sheet(tmp_path, "TANGENT", 7)
    report, (primitive,) = compressed(path, tmp_path / "out.glb")
    text = "tangents that are not finite, now at right angles to the normals: 1"
    assert text in report["warnings"]
    (row,) = np.flatnonzero(primitive.attributes["_ID"].ravel() == before["_ID"].ravel()[7])
    assert abs(primitive.attributes["TANGENT"][row, 2]) < 0.05


def test_skin_weights_that_are_finite_stay(tmp_path):
    path, before, _ = sheet(tmp_path, "WEIGHTS_0", 7)
    report, (primitive,) = compressed(path, tmp_path / "out.glb")
    assert "skin weights that are not finite, now 0: 1" in report["warnings"]
    (row,) = np.flatnonzero(primitive.attributes["_ID"].ravel() == before["_ID"].ravel()[7])
    expected = before["WEIGHTS_0"][7] * [1, 0, 1, 1]
    assert np.allclose(primitive.attributes["WEIGHTS_0"][row], expected, atol=3e-2)


def test_exact_attributes_keep_nan(tmp_path):
    positions, triangles = grid_mesh(4, 4)
    heat = positions[:, 0].copy()
    heat[7] = np.nan
    builder = Builder()
    builder.mesh({"POSITION": positions, "_HEAT": heat}, triangles)
    report, (primitive,) = compressed(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb")
    assert np.isnan(primitive.attributes["_HEAT"]).sum() == 1
    assert not any("finite" in line for line in report["warnings"])


def test_a_primitive_without_finite_triangles_is_kept(tmp_path):
    """Its accessor's bounds are no numbers, which JSON cannot hold."""
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    builder.mesh({"POSITION": np.float32([[np.nan, 0, 0], [1, np.nan, 0], [2, 0, np.nan]])})
    builder.properties["accessors"][-1]["min"] = [float("nan")] * 3
    path = builder.write(tmp_path / "in.glb")
    report = gltf_ext.compress(path, tmp_path / "out.glb")
    (kept,) = report["kept"]
    assert (kept["mesh"], kept["reason"]) == (1, "no triangle has finite positions")
    assert "min" not in glb_json(tmp_path / "out.glb")["accessors"][0]
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]


def test_primitives_that_share_vertices_count_their_own(tmp_path):
    positions, triangles = grid_mesh(5, 4)
    texcoords = positions[:, :2].copy()
    texcoords[0] = np.nan
    builder = Builder()
    first = builder.mesh({"POSITION": positions, "TEXCOORD_0": texcoords}, triangles[:6])
    builder.mesh(dict(first["attributes"]), triangles[6:])
    report, _ = compressed(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb")
    assert "texture coordinates that are not finite, now 0: 1" in report["warnings"]


OBJ = """v 0 0 0
v 1 0 0
v 0 1 0
v nan 1 0
vn 0 0 1
vn nan 0 0
vt 0 0
vt nan 1
f 1/1/1 2/1/2 3/2/1
f 2/1/1 3/1/1 4/1/1
"""
PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 2
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
1 1 1e99
3 0 1 2
3 1 2 3
"""


@pytest.mark.parametrize("name, text, lines", [("in.obj", OBJ, 3), ("in.ply", PLY, 1)])
def test_other_formats(tmp_path, name, text, lines):
    path = tmp_path / name
    path.write_text(text)
    report, (primitive,) = compressed(path, tmp_path / "out.glb")
    assert primitive.triangle_count == 1 and report["warnings"][0] == f"{LEFT_OUT}1"
    assert sum("not finite" in line for line in report["warnings"]) == lines
    with pytest.raises(gltf_ext.MeshletError, match=r"POSITION of mesh 0 .* NaN or infinite"):
        gltf_ext.compress(path, tmp_path / "out.glb", non_finite="refuse")


def test_files_larger_than_memory(tmp_path):
    count = 70_000
    corners = np.zeros((count, 3, 3), "<f4")
    corners[:, :, 0] = np.arange(count)[:, None] % 300 + [0, 1, 0]
    corners[:, :, 1] = np.arange(count)[:, None] // 300 + [0, 0, 1]
    corners[7::1000, 1, 2] = np.nan
    rows = np.zeros(count, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    rows["corners"] = corners
    path = tmp_path / "in.stl"
    path.write_bytes(bytes(80) + struct.pack("<I", count) + rows.tobytes())
    report, _ = compressed(path, tmp_path / "out.glb")
    large = gltf_ext.compress(path, tmp_path / "large.glb", max_memory="130M")
    for line in (report, large):
        assert line["dropped"]["non_finite_triangles"] == 70
        assert f"{LEFT_OUT}70" in line["warnings"]
    assert gltf_ext.verify(path, tmp_path / "large.glb", max_memory="130M")["ok"]


def test_a_vertex_without_any_finite_value(tmp_path):
    """Its triangles go with its position; then nothing uses the others."""
    builder = Builder()
    attributes, triangles, _ = everything(columns=5, rows=4)
    for name in ("POSITION", "NORMAL", "TANGENT", "WEIGHTS_0"):
        attributes[name] = attributes[name].copy()
        attributes[name][7] = np.nan
    builder.mesh(attributes, triangles)
    report, _ = compressed(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb")
    assert sum("not finite" in line for line in report["warnings"]) == 1


def test_a_normal_that_positions_share_becomes_one_of_each_in_files(tmp_path, monkeypatch):
    monkeypatch.setattr(large, "MEMORY_OF_FILE", 1 << 30)
    monkeypatch.setattr(large, "INDEXED_SHARE", 1 << 30)
    path = tmp_path / "in.obj"
    path.write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn nan 0 0\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\n"
    )
    results = []
    for memory in (None, "110M"):
        report, (primitive,) = compressed(path, tmp_path / "out.glb", max_memory=memory)
        order = np.lexsort(primitive.attributes["POSITION"].T)
        results.append([values[order] for values in primitive.attributes.values()])
        text = "normals that are not finite, computed from the triangles around them: 4"
        assert text in report["warnings"]
    assert all(np.array_equal(*pair) for pair in zip(*results))
    assert len(np.unique(results[0][list(primitive.attributes).index("NORMAL")], axis=0)) == 3


def test_repairs_of_all_attributes_fit_memory():
    """Each alone would."""
    values = np.full((1500, 2), np.nan, np.float32)
    positions = np.random.default_rng(0).random((1500, 3)).astype(np.float32)
    names = [f"TEXCOORD_{i}" for i in range(20)]
    attributes = {"POSITION": ArrayRows(positions)} | dict.fromkeys(names, ArrayRows(values))
    source = Source(0, 0, attributes, [(tuple(attributes), None)], room=1_000_000)
    with pytest.raises(gltf_ext.MeshletError, match="too many of them for max_memory"):
        repair.read_finite_bounds(source)
    source.room = 1 << 30
    repair.read_finite_bounds(source)
    assert source.replaced["TEXCOORD"] == 20 * 1500

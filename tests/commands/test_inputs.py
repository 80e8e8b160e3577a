"""Inputs: primitive modes, index types, kinds of accessors, degenerate triangles, refusals."""

import base64
import json

import numpy as np
import pytest

import gltf_ext
from gltf_ext.attributes.records import RecordFormat
from gltf_ext.document.accessors import read_accessor
from gltf_ext.document.container import read_document
from tests.helpers.gltf_builder import Builder, everything, glb_json, grid_mesh


@pytest.fixture
def folder(tmp_path):
    return tmp_path


def compressed(builder, folder, **options):
    """Compresses, verifies, validates and decompresses; returns (report, output path)."""
    original, output = builder.write(folder / "in.glb"), folder / "out.glb"
    report = gltf_ext.compress(original, output, **options)
    verified = gltf_ext.verify(original, output)
    assert verified["ok"], verified["problems"]
    assert gltf_ext.validate(output) == []
    gltf_ext.decompress(output, folder / "plain.glb")
    assert gltf_ext.verify(original, folder / "out.glb")["triangles_equal"]
    return report, output


def triangle_corners(primitive):
    """Sorted corner positions of all triangles, each rotated to start with its smallest corner."""
    corners = primitive.attributes["POSITION"].round(2)[primitive.indices].tolist()
    return sorted(min(c[k:] + c[:k] for k in range(3)) for c in corners)


def only(path):
    (primitive,) = gltf_ext.load(path)
    return primitive


STRIP = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0]], np.float32)


@pytest.mark.parametrize(
    "mode, triangles",
    [(5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]), (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0]])],
)
@pytest.mark.parametrize("indexed", [False, True])
def test_strips_and_fans(folder, mode, triangles, indexed):
    builder = Builder()
    builder.mesh({"POSITION": STRIP}, np.arange(5, dtype=np.uint8) if indexed else None, mode=mode)
    _, output = compressed(builder, folder)
    expected = Builder()
    expected.mesh({"POSITION": STRIP}, np.array(triangles, np.uint32))
    assert triangle_corners(only(output)) == triangle_corners(
        only(expected.write(folder / "expected.glb"))
    )
    assert glb_json(output)["meshes"][0]["primitives"][0].get("mode", 4) == 4


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32])
def test_index_types(folder, dtype):
    positions, triangles = grid_mesh(12, 12)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles.astype(dtype))
    assert compressed(builder, folder)[0]["totals"]["triangles"] == len(triangles)


def test_soup_is_welded(folder):
    positions, triangles = grid_mesh(12, 12)
    builder = Builder()
    builder.mesh({"POSITION": positions[triangles].reshape(-1, 3)})
    report, _ = compressed(builder, folder)
    assert report["totals"]["source_vertices"] == len(positions)
    assert report["dropped"]["duplicate_vertices"] == 3 * len(triangles) - len(positions)


def test_vertices_that_are_written_alike_are_joined(folder):
    """Normals that differ by less than their bits make no seams."""
    positions, triangles = grid_mesh(12, 12)
    normals = np.tile(np.array([0, 0, 1], np.float32), (3 * len(triangles), 1))
    normals[:, :2] = np.random.default_rng(0).uniform(-1e-4, 1e-4, (len(normals), 2))
    builder = Builder()
    builder.mesh({"POSITION": positions[triangles].reshape(-1, 3), "NORMAL": normals})
    report, _ = compressed(builder, folder)
    assert report["totals"]["source_vertices"] == len(positions)
    assert report["totals"]["triangles"] == len(triangles)


def test_triangles_whose_corners_become_one_vertex_are_left_out(folder):
    """Two corners at one position, with normals that are quantised alike."""
    positions, triangles = grid_mesh(4, 4)
    normals = np.tile(np.array([0, 0, 1], np.float32), (len(positions) + 1, 1))
    normals[-1, 0] = 1e-5
    builder = Builder()
    builder.mesh(
        {"POSITION": np.concatenate([positions, positions[:1]]), "NORMAL": normals},
        np.concatenate([triangles, [[0, len(positions), 1]]]).astype(np.uint32),
    )
    report, _ = compressed(builder, folder)
    assert report["dropped"]["degenerate_triangles"] == 1
    assert report["totals"]["triangles"] == len(triangles)


def test_interleaved(folder):
    positions, triangles = grid_mesh(8, 8)
    rows = np.concatenate([positions, positions[:, [2, 0, 1]] + 1], axis=1).astype(np.float32)
    builder = Builder()
    view = builder.view(rows.tobytes(), byteStride=24)
    for offset in (0, 12):
        builder.properties["accessors"].append(
            {
                "bufferView": view,
                "byteOffset": offset,
                "componentType": 5126,
                "count": len(rows),
                "type": "VEC3",
            }
        )
    builder.mesh({"POSITION": 0, "NORMAL": 1}, triangles)
    compressed(builder, folder)


@pytest.mark.parametrize("with_base", [False, True])
def test_sparse(folder, with_base):
    positions, triangles = grid_mesh(8, 8)
    builder = Builder()
    sparse = {
        "count": len(positions),
        "indices": {
            "bufferView": builder.view(np.arange(len(positions), dtype=np.uint16).tobytes()),
            "componentType": 5123,
        },
        "values": {"bufferView": builder.view(positions.tobytes())},
    }
    if with_base:
        index = builder.accessor(np.zeros_like(positions), sparse=sparse)
    else:
        builder.properties["accessors"].append(
            {"componentType": 5126, "count": len(positions), "type": "VEC3", "sparse": sparse}
        )
        index = 0
    builder.mesh({"POSITION": index}, triangles)
    _, output = compressed(builder, folder)
    np.testing.assert_allclose(
        only(output).attributes["POSITION"].max(axis=0), positions.max(axis=0), atol=1e-3
    )


def test_degenerate_unreferenced_and_duplicate(folder):
    positions, triangles = grid_mesh(6, 6)
    extra = np.concatenate([triangles, [[3, 3, 4], [5, 6, 5]], triangles[:4], triangles[:2, ::-1]])
    builder = Builder()
    builder.mesh(
        {"POSITION": np.concatenate([positions, np.full((5, 3), np.nan, np.float32)])},
        extra.astype(np.uint32),
    )
    report, _ = compressed(builder, folder)
    assert report["totals"]["triangles"] == len(triangles) + 6
    assert report["dropped"] == {
        "degenerate_triangles": 2,
        "incomplete_triangles": 0,
        "unreferenced_vertices": 5,
        "duplicate_vertices": 0,
        "non_finite_triangles": 0,
    }


@pytest.mark.parametrize("value", [1e6, np.nan, np.inf])
def test_vertices_of_triangles_with_equal_corners_do_not_count(folder, value):
    """Their corners have different numbers, but equal bytes in all attributes."""
    positions, triangles = grid_mesh(6, 6)
    attributes = {"POSITION": positions, "NORMAL": positions, "TEXCOORD_0": positions[:, :2]}
    attributes = {
        name: np.concatenate([values, np.full((2, values.shape[1]), value, np.float32)])
        for name, values in attributes.items()
    }
    builder = Builder()
    builder.mesh(attributes, np.concatenate([triangles, np.uint32([[36, 37, 0], [3, 36, 37]])]))
    report, output = compressed(builder, folder)
    assert report["totals"]["triangles"] == len(triangles)
    assert report["dropped"]["degenerate_triangles"] == 2
    assert gltf_ext.verify(folder / "in.glb", output)["max_error"]["POSITION"] < 1e-3
    attributes["TEXCOORD_0"][36] = 0
    builder = Builder()
    builder.mesh(attributes, np.concatenate([triangles, np.uint32([[36, 37, 0]])]))
    if np.isfinite(value):
        # The grid of this extent joins all other vertices, and verify says so.
        report = gltf_ext.compress(builder.write(folder / "in.glb"), output)
        assert report["totals"]["triangles"] == len(triangles) + 1
    else:
        for file in folder.iterdir():
            file.unlink()
        refused(
            builder,
            folder,
            "POSITION of mesh 0 primitive 0 has a NaN or infinite value",
            non_finite="refuse",
        )


def test_triangles_that_the_grid_collapses_are_kept(folder):
    positions = np.array(
        [[0, 0, 0], [1e-6, 0, 0], [0, 1e-6, 0], [100, 0, 0], [0, 100, 0]], np.float32
    )
    builder = Builder()
    builder.mesh({"POSITION": positions}, np.array([[0, 1, 2], [0, 3, 4]], np.uint32))
    assert compressed(builder, folder)[0]["totals"]["triangles"] == 2


def test_non_manifold(folder):
    """Three sheets at one edge, two cones at one vertex, and a triangle of opposite winding."""
    positions = np.random.default_rng(0).random((20, 3)).astype(np.float32)
    triangles = np.array(
        [
            [0, 1, 2],
            [0, 1, 3],
            [1, 0, 4],
            [5, 6, 7],
            [5, 7, 8],
            [5, 8, 6],
            [5, 9, 10],
            [5, 10, 11],
            [5, 11, 9],
            [6, 7, 12],
            [6, 7, 12],
        ],
        np.uint32,
    )
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    compressed(builder, folder)


def test_incomplete_triangles_are_left_out(folder):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles.ravel()[:-1])
    report, _ = compressed(builder, folder)
    assert (
        report["dropped"]["incomplete_triangles"] == 1
        and report["totals"]["triangles"] == len(triangles) - 1
    )


def test_primitives_of_nothing_but_degenerates_are_kept(folder):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    builder.mesh({"POSITION": positions}, np.array([[1, 1, 2]], np.uint32))
    report, output = compressed(builder, folder)
    assert [(k["mesh"], k["primitive"]) for k in report["kept"]] == [(1, 0)]
    assert "extensions" not in glb_json(output)["meshes"][1]["primitives"][0]


def test_points_and_lines_stay(folder):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    shared = builder.accessor(positions)
    builder.mesh({"POSITION": shared}, triangles)
    builder.mesh({"POSITION": shared}, mode=0)
    _, output = compressed(builder, folder)
    properties = glb_json(output)
    points = properties["meshes"][1]["primitives"][0]
    accessor = properties["accessors"][points["attributes"]["POSITION"]]
    view = properties["bufferViews"][accessor["bufferView"]]
    binary = output.read_bytes()[-properties["buffers"][0]["byteLength"] :]
    np.testing.assert_array_equal(
        np.frombuffer(binary, np.float32, 3 * len(positions), view["byteOffset"]).reshape(-1, 3),
        positions,
    )


def test_identical_primitives_share_everything(folder):
    positions, triangles = grid_mesh(8, 8)
    builder = Builder()
    position, index = builder.accessor(positions), builder.accessor(triangles.reshape(-1, 1))
    for _ in range(3):
        builder.mesh({"POSITION": position}, index)
    report, output = compressed(builder, folder)
    primitives = [m["primitives"][0] for m in glb_json(output)["meshes"]]
    assert primitives[0] == primitives[1] == primitives[2]
    assert report["totals"]["triangles"] == len(triangles)
    gltf_ext.decompress(output, folder / "plain.glb")
    plain = [m["primitives"][0] for m in glb_json(folder / "plain.glb")["meshes"]]
    assert (
        plain[0] == plain[1] == plain[2] and len(glb_json(folder / "plain.glb")["bufferViews"]) == 2
    )


def test_primitives_that_share_vertices_get_their_own(folder):
    positions, triangles = grid_mesh(8, 8)
    builder = Builder()
    position = builder.accessor(positions)
    builder.mesh({"POSITION": position}, triangles[:50])
    builder.mesh({"POSITION": position}, triangles[50:])
    _, output = compressed(builder, folder)
    a, b = (m["primitives"][0] for m in glb_json(output)["meshes"])
    assert a["attributes"] != b["attributes"] and a["extensions"] != b["extensions"]


def test_only_used_vertices_are_quantised(folder, monkeypatch):
    """Many primitives may share the vertices of a whole scene."""
    rows, quantise_into = [], RecordFormat.quantise_into

    def counting(form, records, attributes):
        rows.append(len(records))
        quantise_into(form, records, attributes)

    monkeypatch.setattr(RecordFormat, "quantise_into", counting)
    positions, triangles = grid_mesh(40, 40)
    builder = Builder()
    attributes = {"POSITION": builder.accessor(positions), "NORMAL": builder.accessor(positions)}
    parts = np.array_split(triangles, 20)
    for part in parts:
        builder.mesh(attributes, part)
    report = gltf_ext.compress(builder.write(folder / "in.glb"), folder / "out.glb")
    used = sum(len(np.unique(part)) for part in parts)
    assert sum(rows) == used
    assert report["dropped"]["unreferenced_vertices"] == 20 * len(positions) - used
    rows.clear()
    assert gltf_ext.verify(folder / "in.glb", folder / "out.glb")["ok"]
    assert sum(rows) == used, "once for errors and for the topology"


def test_quantised_input_stays_exact(folder):
    positions, triangles = grid_mesh(10, 10)
    integers = np.rint(positions * 10000).astype(np.int16)
    normals = np.random.default_rng(0).integers(-127, 128, (len(positions), 3)).astype(np.int8)
    builder = Builder()
    builder.mesh(
        {"POSITION": integers, "NORMAL": normals, "_ID": np.arange(len(positions), dtype=np.uint8)},
        triangles,
        normalized=("NORMAL",),
    )
    builder.properties["extensionsUsed"] = builder.properties["extensionsRequired"] = [
        "KHR_mesh_quantization"
    ]
    report, output = compressed(builder, folder, position_bits=6)
    assert "already quantised" in report["warnings"][0]
    result = only(output)
    order = result.attributes["_ID"][:, 0]
    np.testing.assert_array_equal(result.attributes["POSITION"], integers[order])
    np.testing.assert_array_equal(result.attributes["NORMAL"], normals[order])
    assert "KHR_mesh_quantization" in glb_json(output)["extensionsRequired"]


def test_gltf_with_data_uri_and_images_by_path(folder):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    properties = builder.properties
    png = b"\x89PNG\r\n\x1a\n" + bytes(8)
    (folder / "a b.png").write_bytes(png)
    properties["images"] = [
        {"uri": "a%20b.png", "name": "one"},
        {"uri": "data:image/png;base64," + base64.b64encode(png).decode()},
        {"uri": "missing.png"},
    ]
    properties["buffers"] = [
        {
            "byteLength": len(builder.binary),
            "uri": "data:application/octet-stream;base64,"
            + base64.b64encode(builder.binary).decode(),
        }
    ]
    (folder / "in.gltf").write_text(json.dumps(properties))
    report = gltf_ext.compress(folder / "in.gltf", folder / "out.glb")
    assert len(report["warnings"]) == 1 and "missing.png" in report["warnings"][0]
    result = glb_json(folder / "out.glb")
    binary = (folder / "out.glb").read_bytes()[-result["buffers"][0]["byteLength"] :]
    for image in result["images"][:2]:
        view = result["bufferViews"][image["bufferView"]]
        assert (
            binary[view["byteOffset"] :][: view["byteLength"]] == png
            and image["mimeType"] == "image/png"
            and "uri" not in image
        )
    assert result["images"][0]["name"] == "one" and result["images"][2] == {"uri": "missing.png"}
    assert gltf_ext.verify(folder / "in.gltf", folder / "out.glb")["ok"]


def refused(builder, folder, message, **options):
    output = folder / "out.glb"
    with pytest.raises(gltf_ext.MeshletError, match=message) as caught:
        gltf_ext.compress(builder.write(folder / "in.glb"), output, **options)
    assert (
        caught.value.path == str(folder / "in.glb")
        and "\n" not in str(caught.value)
        and ";" in str(caught.value)
    )
    assert [p.name for p in folder.iterdir()] == ["in.glb"], "nothing half-written"


@pytest.mark.parametrize("name", ["POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0", "WEIGHTS_0"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_not_finite_is_refused_on_request(folder, name, value):
    attributes, triangles, _ = everything(columns=4, rows=4)
    attributes[name] = attributes[name].copy()
    attributes[name][5, 1] = value
    builder = Builder()
    builder.mesh(attributes, triangles)
    message = f"{name} of mesh 0 primitive 0 has a NaN or infinite value"
    refused(builder, folder, message, non_finite="refuse")


def test_index_out_of_range(folder):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles + 1)
    refused(builder, folder, "indices of mesh 0 primitive 0 reach 16, but it has 16 vertices")


def test_attributes_of_different_lengths(folder):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions, "NORMAL": positions[:-1]}, triangles)
    refused(builder, folder, "NORMAL of mesh 0 primitive 0 has 15 elements instead of 16")


def test_no_position(folder):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"NORMAL": positions}, triangles)
    refused(builder, folder, "holds no triangles with a POSITION")


@pytest.mark.parametrize("names", [[], ["NORMAL"]])
def test_no_position_beside_others(folder, names):
    """Such a primitive stays as it is, with its data."""
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    normals = builder.accessor(positions[:6])
    primitive = {"attributes": dict.fromkeys(names, normals), "material": 0}
    builder.properties["materials"] = [{"name": "bare"}]
    builder.properties["meshes"][0]["primitives"].insert(0, primitive)
    report, output = compressed(builder, folder)
    assert report["kept"] == [{"mesh": 0, "primitive": 0, "reason": "it has no POSITION"}]
    for path in (output, folder / "plain.glb"):
        document = read_document(path)
        bare = document.primitive(0, 0)
        assert list(bare["attributes"]) == names and bare["material"] == 0
        for accessor in bare["attributes"].values():
            assert np.array_equal(read_accessor(document, accessor, "it"), positions[:6])


def test_an_attribute_with_the_name_of_that_of_a_target(folder):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    attributes = {"POSITION": positions, "targets[0].POSITION": positions}
    builder.mesh(attributes, triangles, [{"POSITION": positions}])
    refused(builder, folder, r"has an attribute named targets\[0\].POSITION")


def test_no_triangles(folder):
    builder = Builder()
    builder.mesh({"POSITION": grid_mesh(4, 4)[0]}, mode=1)
    refused(builder, folder, "holds no triangles")


def test_too_many_streams_leave_the_primitive_alone(folder):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    builder.mesh({"POSITION": positions}, triangles, [{"POSITION": positions * 0.01}] * 64)
    report, _ = compressed(builder, folder)
    assert "65 streams" in report["kept"][0]["reason"]


def test_draco(folder):
    DracoPy = pytest.importorskip("DracoPy")
    positions, triangles = grid_mesh(10, 10)
    builder = Builder()
    data = DracoPy.encode(positions, triangles, quantization_bits=14)
    for accessor in (
        {"componentType": 5126, "count": len(positions), "type": "VEC3"},
        {"componentType": 5125, "count": triangles.size, "type": "SCALAR"},
    ):
        builder.properties["accessors"].append(accessor)
    identifier = DracoPy.decode(data).attributes[0]["unique_id"]
    extension = {"bufferView": builder.view(data), "attributes": {"POSITION": identifier}}
    builder.mesh({"POSITION": 0}, 1, extensions={"KHR_draco_mesh_compression": extension})
    builder.properties["extensionsUsed"] = builder.properties["extensionsRequired"] = [
        "KHR_draco_mesh_compression"
    ]
    report, output = compressed(builder, folder)
    assert (
        report["totals"]["triangles"] == len(triangles)
        and "already quantised" in report["warnings"][0]
    )
    assert glb_json(output)["extensionsUsed"] == ["EXT_meshlet_edgebreaker"]

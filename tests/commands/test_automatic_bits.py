"""Bits that compress chooses, those that a user gives, and what verify says of both."""

import io
import json
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from gltf_ext.attributes import details
from gltf_ext.errors import MeshletError
from gltf_ext.options import Options
from gltf_meshlet.cli import main
from tests.helpers.gltf_builder import (
    Builder,
    glb_bytes,
    glb_json,
    glb_parts,
    grid_mesh,
    wavy_sheet,
)


def sheet(**more):
    """(attributes, triangles) of a bumpy sheet with up to a tile of texture coordinates."""
    positions, triangles = grid_mesh(24, 17)
    normals = np.tile(np.float32([0, 0, 1]), (len(positions), 1))
    normals[:, :2] = np.random.default_rng(1).normal(scale=0.1, size=(len(positions), 2))
    texcoords = positions[:, :2] / 2
    return {"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": texcoords, **more}, triangles


def compressed(tmp_path, builder, **options):
    """(report, bits by attribute of the first primitive, original, output)"""
    original, output = builder.write(tmp_path / "in.glb"), tmp_path / "out.glb"
    report = gltf_ext.compress(original, output, **options)
    attributes = report["primitives"][0]["attributes"]
    bits = {name: values["bits_per_component"][0] for name, values in attributes.items()}
    return report, bits, original, output


def built(attributes, triangles, **more):
    builder = Builder()
    primitive = builder.mesh(attributes, triangles, **more)
    return builder, primitive


def png(size):
    data = io.BytesIO()
    Image.new("L", (size, 1)).save(data, "PNG")
    return data.getvalue()


def ktx2(size):
    return b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(8) + np.uint32([size, size, 0]).tobytes() + bytes(40)


def textured(builder, primitive, image, **info):
    """Gives a primitive a material with one texture."""
    properties = builder.properties
    properties["images"] = [{"bufferView": builder.view(image), "mimeType": "image/png"}]
    properties["textures"] = [{"source": 0}]
    properties["materials"] = [{"normalTexture": {"index": 0, **info}}]
    primitive["material"] = 0


@pytest.mark.parametrize(
    "image, bits", [(png(16), 12), (png(4096), 14), (ktx2(8192), 15)], ids=["16", "4096", "ktx2"]
)
def test_texture_coordinates_have_a_quarter_of_a_texel(tmp_path, image, bits):
    builder, primitive = built(*sheet())
    textured(builder, primitive, image)
    assert compressed(tmp_path, builder)[1]["TEXCOORD_0"] == bits


def test_a_texture_transform_scales_texels(tmp_path):
    builder, primitive = built(*sheet())
    transform = {"KHR_texture_transform": {"scale": [4, -8]}}
    textured(builder, primitive, png(1024), extensions=transform)
    assert compressed(tmp_path, builder)[1]["TEXCOORD_0"] == 15


def test_the_largest_texture_of_all_users_and_variants_counts(tmp_path):
    builder, primitive = built(*sheet())
    textured(builder, primitive, png(4096))
    mapping = {"KHR_materials_variants": {"mappings": [{"material": 0, "variants": [0]}]}}
    primitive["extensions"] = mapping
    del primitive["material"]
    assert compressed(tmp_path, builder)[1]["TEXCOORD_0"] == 14


@pytest.mark.parametrize(
    "materials",
    [
        [],
        [{"normalTexture": {"index": 9}}],
        [{"extensions": {"A": {"aTexture": {"index": "x", "texCoord": []}}, "KHR_b": 3}}],
        [{"extensions": {"A": {"aTexture": {"index": 0, "extensions": []}}}}],
    ],
)
def test_materials_that_are_not_valid_count_as_none(tmp_path, materials):
    builder, primitive = built(*sheet())
    builder.properties["materials"], primitive["material"] = materials, 0
    assert compressed(tmp_path, builder)[1]["TEXCOORD_0"] == 12


@pytest.mark.parametrize("mappings", [5, "a", {"material": 0}, [3], [{"material": [1]}]])
def test_variants_that_are_not_valid_count_as_none(tmp_path, mappings):
    builder, primitive = built(*sheet())
    primitive["extensions"] = {"KHR_materials_variants": {"mappings": mappings}}
    assert compressed(tmp_path, builder)[1]["TEXCOORD_0"] == 12


def test_attributes_of_a_sample_are_of_the_same_triangles(monkeypatch):
    """In an .obj, rows of normals may be far apart where those of positions are not."""
    positions, triangles = grid_mesh(24, 17)
    monkeypatch.setattr(details, "NEAR_ROWS", len(positions))
    shuffled = 10 * np.random.default_rng(1).permutation(len(positions))
    normals = np.zeros((10 * len(positions), 3), np.float32)
    normals[shuffled] = positions
    rows = {"POSITION": memory_rows(positions), "NORMAL": memory_rows(normals)}
    indices = {"POSITION": triangles.astype(np.int64), "NORMAL": shuffled[triangles]}
    source = SimpleNamespace(
        is_in_memory=False,
        attributes=rows,
        numbering_of=lambda name: ((name,), name),
        triangle_count=len(triangles),
        corners=lambda names, numbers, first, last: indices[numbers][first:last],
    )
    sample = details.sample_of(source)
    assert len(sample.positions) > 0
    np.testing.assert_array_equal(sample.positions, sample.normals)


def memory_rows(values):
    return SimpleNamespace(count=len(values), rows=lambda first, last: values[first:last])


def test_positions_and_normals(tmp_path):
    attributes, triangles = sheet()
    bits = compressed(tmp_path, built(attributes, triangles)[0])[1]
    assert (bits["POSITION"], bits["NORMAL"]) == (13, 11)
    del attributes["NORMAL"]
    assert compressed(tmp_path, built(attributes, triangles)[0])[1]["POSITION"] == 14


@pytest.mark.parametrize("waves, bits", [(2, 13), (10, 14)])
def test_surfaces_that_bend_much_have_a_bit_more(tmp_path, waves, bits):
    positions, triangles = grid_mesh(120, 120)
    angle = 2 * np.pi * waves * np.linspace(0, 1, len(np.unique(positions[:, 0])))
    angle = angle[np.searchsorted(np.unique(positions[:, 0]), positions[:, 0])]
    normals = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1).astype(np.float32)
    attributes = {"POSITION": positions * np.float32([1, 1, 0]), "NORMAL": normals}
    assert compressed(tmp_path, built(attributes, triangles)[0])[1]["POSITION"] == bits


def test_smooth_glossy_and_unlit_normals(tmp_path):
    attributes, triangles = sheet()
    for material, expected in (
        ({"pbrMetallicRoughness": {"roughnessFactor": 0.1}}, 12),
        ({"extensions": {"KHR_materials_unlit": {}}}, 8),
    ):
        builder, primitive = built(attributes, triangles)
        builder.properties["materials"], primitive["material"] = [material], 0
        assert compressed(tmp_path, builder)[1]["NORMAL"] == expected
    x = attributes["POSITION"][:, :1] * 0.1  # 0.5 degrees a triangle
    attributes["NORMAL"] = np.concatenate([np.sin(x), 0 * x, np.cos(x)], axis=1)
    assert compressed(tmp_path, built(attributes, triangles)[0])[1]["NORMAL"] == 12


def test_colours_and_weights(tmp_path):
    count = len(sheet()[0]["POSITION"])
    random = np.random.default_rng(2)
    attributes, triangles = sheet(
        COLOR_0=random.random((count, 3)).astype(np.float32),
        COLOR_1=random.integers(0, 65536, (count, 4)).astype(np.uint16),
        COLOR_2=(random.random((count, 3)) * 50).astype(np.float32),
        COLOR_3=(random.random((count, 3)) * 1e6).astype(np.float32),
    )
    builder, _ = built(attributes, triangles, normalized=("COLOR_1",))
    _, bits, original, output = compressed(tmp_path, builder)
    assert [bits[f"COLOR_{n}"] for n in range(4)] == [12, 12, 18, 32]
    verified = gltf_ext.verify(original, output)
    assert verified["ok"] and verified["max_error"]["COLOR_3"] == 0
    assert verified["seen_error"]["COLOR_1"]["unit"] == "8-bit steps"
    assert verified["seen_error"]["COLOR_1"]["max"] < 0.1  # of 255, so 2 components of 16 bits


def with_outlier(value):
    attributes, triangles = sheet()
    attributes["TEXCOORD_0"] = attributes["TEXCOORD_0"].copy()
    attributes["TEXCOORD_0"][7] = value
    return built(attributes, triangles)[0]


@pytest.mark.parametrize("value, bits", [(200, 20), (1e5, 32)])
def test_outliers_take_bits_or_exact_floats(tmp_path, value, bits):
    _, chosen, original, output = compressed(tmp_path, with_outlier(value))
    assert chosen["TEXCOORD_0"] == bits
    verified = gltf_ext.verify(original, output)
    assert verified["ok"], verified["losses"]
    assert verified["max_error"]["TEXCOORD_0"] <= 1 / 8192 * 2**0.5


def test_bits_that_are_given_stay_and_are_warned_of(tmp_path, capsys):
    report, bits, original, output = compressed(tmp_path, with_outlier(200), texcoord_bits=12)
    assert bits["TEXCOORD_0"] == 12
    (warning,) = report["warnings"]
    assert "TEXCOORD_0 of mesh 0 primitive 0 reaches from 0 to 200" in warning
    assert "12 bits leave steps of 50 texels" in warning
    assert main(["verify", str(original), str(output)]) == 1
    printed = capsys.readouterr().out
    assert "BEYOND WHAT IS PROMISED" in printed and " texels (0.0" in printed


def test_few_bits_of_one_tile_are_as_promised(tmp_path):
    builder = built(*sheet())[0]
    report, _, original, output = compressed(tmp_path, builder, texcoord_bits=6)
    assert not report["warnings"]
    assert gltf_ext.verify(original, output)["ok"]


def long_object():
    """Small bumps beside a triangle that is 20,000 long."""
    positions, triangles = wavy_sheet(30)
    positions = np.concatenate([positions, np.float32([[0, 0, 0], [20000, 0, 0], [0, 0, 1e-3]])])
    extra = np.uint32([[len(positions) - 3, len(positions) - 2, len(positions) - 1]])
    return built({"POSITION": positions * np.float32(0.01)}, np.concatenate([triangles, extra]))[0]


def test_details_of_a_long_object_do_not_collapse(tmp_path, capsys):
    builder = long_object()
    report, bits, original, output = compressed(tmp_path, builder)
    assert bits["POSITION"] > 14 and report["collapsed"]["area_percent"] < 0.01
    assert gltf_ext.verify(original, output)["ok"]
    report, bits, original, output = compressed(tmp_path, builder, position_bits=12)
    assert bits["POSITION"] == 12 and report["collapsed"]["area_percent"] > 50
    assert "the position grid collapses" in report["warnings"][0]
    assert "triangles of mesh 0" in report["warnings"][0]
    main(["verify", str(original), str(output)])
    printed = capsys.readouterr()
    assert "collapsed by the grid" in printed.out and "the grid collapses" in printed.err


@pytest.mark.parametrize("options", [{}, {"lod": True}, {"position_bits": 16}], ids=str)
@pytest.mark.parametrize("reach", [1e4, 1e7, 1e12])
def test_displacements_far_larger_than_the_mesh_keep_their_floats(tmp_path, reach, options):
    """The mesh has the steps that it has without them."""
    attributes, triangles = sheet()
    far = {"POSITION": attributes["POSITION"] * np.float32(reach)}
    alone = compressed(tmp_path, built(attributes, triangles)[0], **options)[1]
    builder = built(attributes, triangles, targets=[far])[0]
    _, bits, original, output = compressed(tmp_path, builder, **options)
    assert bits["POSITION"] == alone["POSITION"] and bits["targets[0].POSITION"] == 32
    assert gltf_ext.verify(original, output)["max_error"]["targets[0].POSITION"] == 0
    assert gltf_ext.verify(original, output)["ok"] and gltf_ext.validate(output) == []


def displaced_texcoords(reach):
    """A sheet with a target that moves texture coordinates by up to `reach`."""
    attributes, triangles = sheet()
    deltas = attributes["TEXCOORD_0"] * np.float32(reach)
    return built(attributes, triangles, targets=[{"TEXCOORD_0": deltas}])[0]


@pytest.mark.parametrize("reach, bits", [(1, 12), (200, 20), (1e5, 32)])
def test_displaced_texture_coordinates_have_a_quarter_of_a_texel(tmp_path, reach, bits):
    """Exact floats where a grid has too few bits for their range."""
    report, chosen, original, output = compressed(tmp_path, displaced_texcoords(reach))
    assert chosen["targets[0].TEXCOORD_0"] == bits
    assert not report["warnings"] and gltf_ext.verify(original, output)["ok"]


def test_displacements_in_few_bits_are_warned_of(tmp_path):
    builder = displaced_texcoords(1e4)
    report, _, original, output = compressed(tmp_path, builder, texcoord_bits=12)
    (warning,) = report["warnings"]
    assert warning.startswith("targets[0].TEXCOORD_0 of mesh 0 primitive 0 reaches from")
    assert "so 12 bits leave steps of" in warning
    (loss,) = gltf_ext.verify(original, output)["losses"]
    assert "targets[0].TEXCOORD_0 is off by" in loss


def layers(gap, displacement):
    """Two sheets that lie so close that no grid of 16 bits tells them apart."""
    positions, triangles = grid_mesh(60, 60)
    count = len(positions)
    positions = np.concatenate([positions, positions + np.float32([0, 0, gap])])
    targets = [{"POSITION": np.zeros_like(positions)}]
    targets[0]["POSITION"][:, 2] = np.tile(np.linspace(-displacement, displacement, count), 2)
    return built(
        {"POSITION": positions},
        np.concatenate([triangles, triangles[:, ::-1] + count]).astype(np.uint32),
        targets=targets,
    )[0]


def test_a_mesh_that_no_grid_mends_is_apart_by_its_table(tmp_path):
    report, bits, original, output = compressed(tmp_path, layers(1e-6, 300), page_bytes=4096)
    assert bits["POSITION"] == 14 and not report["warnings"]
    verified = gltf_ext.verify(original, output)
    assert verified["ok"] and verified["topology"]["compressed"]["islands"] == 2


def test_huge_extents_do_not_overflow(tmp_path):
    attributes, triangles = sheet()
    positions = attributes["POSITION"]
    positions = (positions - positions.mean(axis=0)) / np.ptp(positions, axis=0).max()
    builder = built(
        {"POSITION": (positions.astype(np.float64) * 6e38).astype(np.float32)}, triangles
    )[0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compressed(tmp_path, builder)


def test_small_primitives_of_a_large_mesh_do_not_collapse(tmp_path):
    """Of the mesh's area a small primitive is next to nothing."""
    positions, triangles = grid_mesh(40, 40)
    normals = np.tile(np.float32([0, 0, 1]), (len(positions), 1))
    builder, _ = built({"POSITION": positions, "NORMAL": normals}, triangles)
    small, small_triangles = grid_mesh(12, 12)
    span = np.ptp(positions, axis=0).max() / np.ptp(small, axis=0).max()
    small = small * np.float32(span / 3000)
    primitive = builder.mesh({"POSITION": small, "NORMAL": normals[: len(small)]}, small_triangles)
    builder.properties["meshes"].pop()
    builder.properties["nodes"] = [{"mesh": 0}]
    builder.properties["meshes"][0]["primitives"].append(primitive)
    report, bits, original, output = compressed(tmp_path, builder)
    assert bits["POSITION"] == 16 and not report["warnings"]
    assert not gltf_ext.verify(original, output)["warnings"]
    report = gltf_ext.compress(original, output, position_bits=12)
    assert "of mesh 0 primitive 1 (99.2 % of its area); use auto, more" in report["warnings"][0]


def test_steps_are_in_units_of_the_scene(tmp_path, capsys):
    builder = built(*sheet())[0]
    builder.properties["nodes"] = [
        {"children": [1], "scale": [1, 5, 1]},
        {"mesh": 0, "scale": [2] * 3},
    ]
    report, _, original, output = compressed(tmp_path, builder, position_bits=8)
    assert report["steps"]["POSITION"]["step"] == pytest.approx([2 / 255 * 10] * 2)
    assert report["steps"]["NORMAL"]["bits"] == [11, 11]
    assert main(["compress", str(original), str(output), "-vp", "8", "-vn", "auto"]) == 0
    printed = capsys.readouterr().out
    assert "steps: positions 0.078 scene units (8 bits), normals 0.12 degrees (11 bits)" in printed


def test_max_memory_chooses_the_same_bits(tmp_path):
    positions, triangles = wavy_sheet(400)
    normals = np.tile(np.float32([0, 0, 1]), (len(positions), 1))
    builder, _ = built({"POSITION": positions, "NORMAL": normals}, triangles)
    _, bits, original, output = compressed(tmp_path, builder)
    large = gltf_ext.compress(original, output, max_memory="95M")
    attributes = large["primitives"][0]["attributes"]
    assert bits == {n: v["bits_per_component"][0] for n, v in attributes.items()}


def test_auto_is_the_default_and_a_value():
    assert Options() == Options(position_bits="auto", weight_bits="auto")
    assert Options(position_bits=None, step=0.1).position_bits == "auto"
    for value in ("automatic", "12", 3, 2.5):
        with pytest.raises(MeshletError, match="use 4 to 16 or auto"):
            Options(normal_bits=value)


def test_a_bad_number_of_bits_is_one_line(capsys):
    with pytest.raises(SystemExit):
        main(["compress", "a.glb", "b.glb", "-vp", "much"])
    assert "argument -vp: invalid int or auto value: 'much'" in capsys.readouterr().err


def test_steps_of_shared_primitives_and_integers(tmp_path):
    """Two meshes show the same data, one 1,000 times as large; colours are shares of white."""
    attributes, triangles = sheet()
    colors = np.random.default_rng(1).integers(0, 65536, (len(attributes["POSITION"]), 4))
    attributes["COLOR_0"] = colors.astype(np.uint16)
    builder, primitive = built(attributes, triangles, normalized=("COLOR_0",))
    builder.properties["meshes"].append({"primitives": [dict(primitive)]})
    builder.properties["nodes"] = [{"mesh": 0}, {"mesh": 1, "scale": [1000] * 3}]
    builder.properties["scenes"] = [{"nodes": [0, 1]}]
    report, _, _, _ = compressed(tmp_path, builder, position_bits=8, color_bits=8)
    assert report["steps"]["POSITION"]["step"] == pytest.approx([2 / 255, 2000 / 255])
    assert report["steps"]["COLOR"]["step"] == pytest.approx([1 / 255] * 2)


def test_dropped_vertices_count_once_for_each_grid(tmp_path):
    """Two meshes share a primitive, which is encoded on the grid of each."""
    attributes, triangles = sheet()
    attributes = {name: np.concatenate([rows, rows[:1] + 9]) for name, rows in attributes.items()}
    builder, primitive = built(attributes, triangles)
    positions, more = grid_mesh(8, 8)
    builder.mesh({"POSITION": positions * np.float32(10)}, more)
    builder.properties["meshes"][1]["primitives"].append(dict(primitive))
    report, _, _, _ = compressed(tmp_path, builder)
    assert len(report["primitives"]) == 3
    assert report["dropped"]["unreferenced_vertices"] == 2


# --- verify ---


@pytest.mark.parametrize("bits", [4, 5, 6, 7])
def test_few_bits_of_colours_and_weights_are_as_promised(tmp_path, bits):
    random = np.random.default_rng(2)
    attributes, triangles = sheet()
    count = len(attributes["POSITION"])
    weights = random.random((count, 4))
    builder, _ = built(
        {
            **attributes,
            "COLOR_0": random.random((count, 4)).astype(np.float32),
            "WEIGHTS_0": (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32),
            "JOINTS_0": np.zeros((count, 4), np.uint8),
        },
        triangles,
    )
    report, _, original, output = compressed(tmp_path, builder, color_bits=bits, weight_bits=bits)
    verified = gltf_ext.verify(original, output)
    assert verified["ok"], verified["losses"]
    assert not report["warnings"]


def test_verify_sees_nodes_that_are_not_valid(tmp_path, capsys):
    builder, _ = built(*sheet())
    builder.properties["nodes"] = [{"mesh": 0}]
    _, _, original, output = compressed(tmp_path, builder)
    changed(output, lambda properties: properties["nodes"][0].update(children=[0]))
    assert main(["verify", str(original), str(output)]) == 1
    printed = capsys.readouterr().out
    assert "within the bits, WITH OTHER DIFFERENCES" in printed
    assert "nodes are not valid, those of the original are" in printed


def test_percentages_are_of_each_mesh(tmp_path):
    """Of the smaller mesh an error is as many percent as a larger one of the larger mesh."""
    positions, triangles = grid_mesh(24, 17)
    builder, _ = built({"POSITION": positions}, triangles)
    builder.mesh({"POSITION": positions * np.float32(1000)}, triangles)
    _, _, original, output = compressed(tmp_path, builder, step=0.1)
    verified = gltf_ext.verify(original, output)
    diagonal = np.linalg.norm(np.ptp(positions, axis=0))
    percent = verified["area_error_percent"]["POSITION"]
    assert 100 * 0.05 / diagonal < percent <= 1.001 * verified["max_error_percent"]["POSITION"]


def changed(output, change):
    """Changes the JSON of a compressed file."""
    properties, binary = glb_parts(output)
    change(properties)
    output.write_bytes(glb_bytes(properties, bytes(binary)))


def of_positions(properties):
    primitive = properties["meshes"][0]["primitives"][0]
    return properties["accessors"][primitive["attributes"]["POSITION"]]


def test_verify_sees_a_wrong_box(tmp_path):
    _, _, original, output = compressed(tmp_path, built(*sheet())[0])
    assert gltf_ext.verify(original, output)["ok"]
    changed(output, lambda properties: of_positions(properties)["max"].__setitem__(1, 7.0))
    verified = gltf_ext.verify(original, output)
    assert not verified["ok"]
    assert "max of POSITION is not that of its vertices" in verified["problems"][0]


def test_verify_sees_a_changed_normalized_flag(tmp_path):
    count = len(sheet()[0]["POSITION"])
    attributes, triangles = sheet(COLOR_0=np.full((count, 4), 9, np.uint8))
    _, _, original, output = compressed(
        tmp_path, built(attributes, triangles, normalized=("COLOR_0",))[0]
    )

    def change(properties):
        primitive = properties["meshes"][0]["primitives"][0]
        del properties["accessors"][primitive["attributes"]["COLOR_0"]]["normalized"]

    changed(output, change)
    verified = gltf_ext.verify(original, output)
    assert not verified["ok"]
    assert "COLOR_0 is VEC4 of 5121, it was VEC4 of 5121, normalized" in verified["problems"][0]


def test_verify_measures_most_of_the_area(tmp_path):
    """A small triangle with wrong normals is not most of the area, but the largest error."""
    _, _, original, output = compressed(tmp_path, built(*sheet())[0])
    verified = gltf_ext.verify(original, output)
    for name in ("POSITION", "NORMAL", "TEXCOORD_0"):
        assert 0 < verified["area_error"][name] <= verified["max_error"][name] * 1.0001
    assert json.loads(json.dumps(verified))["seen_error"]["TEXCOORD_0"]["unit"] == "texels"


def test_verify_tells_the_grid_from_a_torn_mesh(tmp_path):
    builder = built(*wavy_and_normals())[0]
    _, _, original, output = compressed(tmp_path, builder, position_bits=14, page_bytes=4096)
    assert gltf_ext.verify(original, output)["ok"]

    def tear(properties):
        extension = properties["meshes"][0]["primitives"][0]["extensions"]
        del extension["EXT_meshlet_edgebreaker"]["sourceVertices"]

    changed(output, tear)
    verified = gltf_ext.verify(original, output)
    assert verified["is_torn"] and not verified["ok"]
    assert "no vertices are equal on the grid" in verified["problems"][0]


def wavy_and_normals():
    positions, triangles = wavy_sheet(60)
    normals = np.tile(np.float32([0, 0, 1]), (len(positions), 1))
    return {"POSITION": positions, "NORMAL": normals}, triangles


def test_names_of_unknown_meshes(tmp_path):
    """A node cycle leaves the steps in units of the mesh."""
    builder = built(*sheet())[0]
    builder.properties["nodes"] = [{"mesh": 0, "children": [0]}]
    report, _, _, output = compressed(tmp_path, builder, position_bits=8)
    assert report["steps"]["POSITION"]["step"] == pytest.approx([2 / 255] * 2)
    assert glb_json(output)["nodes"]

"""compress, then load: the same triangles, and attributes within bounds. _ID matches vertices."""

import json

import numpy as np
import pytest

import gltf_ext
from tests.helpers.gltf_builder import NORMALIZED, Builder, everything, glb_json, grid_mesh


def rotated_multiset(triangles):
    return sorted(tuple(np.roll(t, -int(np.argmin(t)))) for t in np.asarray(triangles).tolist())


def angle(a, b):
    a, b = (
        v.astype(np.float64) / np.linalg.norm(v.astype(np.float64), axis=1, keepdims=True)
        for v in (a, b)
    )
    return 2 * np.arcsin(np.minimum(np.linalg.norm(a - b, axis=1) / 2, 1)).max()


BITS = {"position_bits": 12, "normal_bits": 8, "texcoord_bits": 12, "color_bits": 8}


@pytest.fixture(scope="module")
def source():
    return everything()


@pytest.fixture(scope="module")
def files(source, tmp_path_factory):
    folder = tmp_path_factory.mktemp("everything")
    attributes, triangles, targets = source
    builder = Builder()
    builder.mesh(attributes, triangles, targets, NORMALIZED)
    original = builder.write(folder / "in.glb")
    report = gltf_ext.compress(original, folder / "out.glb", **BITS)
    return original, folder / "out.glb", report


@pytest.fixture(scope="module")
def decoded(files):
    (primitive,) = gltf_ext.load(files[1])
    return primitive


@pytest.fixture(scope="module")
def ids(decoded):
    return decoded.attributes["_ID"][:, 0]


def test_triangles_are_the_same(source, decoded, ids):
    assert rotated_multiset(ids[decoded.indices]) == rotated_multiset(source[1])


def test_component_types_stay(source, decoded):
    assert {n: (v.dtype, v.shape[1]) for n, v in decoded.attributes.items()} == {
        n: (v.dtype, v.shape[1]) for n, v in source[0].items()
    }


@pytest.mark.parametrize(
    "name", ["JOINTS_0", "JOINTS_1", "COLOR_1", "TEXCOORD_1", "_HEAT", "_FRAME", "_SIGNED"]
)
def test_exact_attributes(source, decoded, ids, name):
    np.testing.assert_array_equal(
        decoded.attributes[name].view(np.uint8), source[0][name][ids].view(np.uint8)
    )


@pytest.mark.parametrize("name, levels", [("POSITION", 2**12 - 1), ("TEXCOORD_0", 2**12 - 1)])
def test_gridded_attributes_are_off_by_half_a_step(source, decoded, ids, name, levels):
    values = source[0][name].astype(np.float64)
    step = (values.max(axis=0) - values.min(axis=0)).max() / levels
    assert np.abs(decoded.attributes[name] - values[ids]).max() <= 0.5 * step + 1e-6


def test_colors_are_off_by_half_a_level(source, decoded, ids):
    assert (
        np.abs(decoded.attributes["COLOR_0"] - source[0]["COLOR_0"][ids]).max() <= 0.5 / 255 + 1e-6
    )
    assert (
        np.abs(decoded.attributes["COLOR_2"].astype(int) - source[0]["COLOR_2"][ids]).max()
        <= 0.5 * 65535 / 255 + 1
    )


@pytest.mark.parametrize("name", ["NORMAL", "TANGENT"])
def test_directions(source, decoded, ids, name):
    result = decoded.attributes[name]
    assert angle(result[:, :3], source[0][name][ids, :3]) <= np.radians(1.0)
    np.testing.assert_allclose(np.linalg.norm(result[:, :3], axis=1), 1, atol=1e-6)
    np.testing.assert_array_equal(result[:, 3:], source[0][name][ids, 3:])


def test_weights_sum_to_one_over_all_sets(source, decoded, ids):
    weights = np.concatenate(
        [decoded.attributes["WEIGHTS_0"], decoded.attributes["WEIGHTS_1"]], axis=1
    )
    np.testing.assert_array_equal(np.rint(weights * 255).sum(axis=1), 255)
    assert np.abs(weights[:, :4] - source[0]["WEIGHTS_0"][ids]).max() <= 1 / 255 + 1e-6


def test_morph_targets(source, decoded, ids):
    step = 2.0 / (2**12 - 1)
    for target, result in zip(source[2], decoded.targets):
        for name, allowed in (
            ("POSITION", 0.5 * step),
            ("NORMAL", 0.5 * np.ptp(target["NORMAL"], axis=0).max() / 255),
        ):
            difference = np.abs(result[name] - target[name][ids])
            assert difference.max() <= allowed + 1e-6
            assert (result[name][target[name][ids] == 0] == 0).all(), (
                "a zero delta stays exactly zero"
            )


def test_morphed_positions_stay_on_the_grid(decoded):
    step = np.float64(np.float32(2.0 / (2**12 - 1)))
    cells = decoded.targets[0]["POSITION"].astype(np.float64) / step
    assert np.abs(cells - np.rint(cells)).max() < 1e-3


def test_verify_agrees(files):
    report = gltf_ext.verify(files[0], files[1])
    assert report["ok"] and report["triangles_equal"] and report["errors_within_bits"], report[
        "problems"
    ]
    assert report["max_error"]["_HEAT"] == 0 and report["max_error"]["POSITION"] > 0
    assert set(report["max_error_degrees"]) == {"NORMAL", "TANGENT"}
    assert json.loads(json.dumps(report)) == report


def test_decompress_gives_what_load_gives(files, decoded, tmp_path):
    report = gltf_ext.decompress(files[1], tmp_path / "plain.glb")
    assert report["triangles"] == len(decoded.indices)
    (plain,) = gltf_ext.load(tmp_path / "plain.glb")
    np.testing.assert_array_equal(plain.indices, decoded.indices)
    for (name, values), (other, expected) in zip(
        sorted(plain.arrays), sorted(decoded.arrays), strict=True
    ):
        assert name == other
        np.testing.assert_array_equal(values, expected)
    assert "extensionsUsed" not in glb_json(tmp_path / "plain.glb")


def test_accessors_describe_the_decoded_data(files, decoded):
    properties = glb_json(files[1])
    (primitive,) = properties["meshes"][0]["primitives"]
    for name, index in primitive["attributes"].items():
        accessor = properties["accessors"][index]
        assert accessor["count"] == decoded.vertex_count and "bufferView" not in accessor
        assert accessor.get("normalized", False) == (name in NORMALIZED)
    position = properties["accessors"][primitive["attributes"]["POSITION"]]
    assert position["min"] == decoded.attributes["POSITION"].min(axis=0).tolist()
    assert position["max"] == decoded.attributes["POSITION"].max(axis=0).tolist()
    assert properties["accessors"][primitive["indices"]]["count"] == decoded.indices.size
    assert (
        properties["extensionsRequired"]
        == properties["extensionsUsed"]
        == ["EXT_meshlet_edgebreaker"]
    )


def test_single_meshlets_hold_the_same_corners(files, decoded):
    (decoder,) = gltf_ext.decoders(files[1])
    whole, single = [], []
    for number in range(decoder.meshlet_count):
        triangles, attributes = decoder.decode_meshlet(number)
        single += rotated_multiset(attributes["_ID"][:, 0][triangles])
        for name, values in decoded.attributes.items():
            assert attributes[name].dtype == values.dtype
    whole = rotated_multiset(decoded.attributes["_ID"][:, 0][decoded.indices])
    assert sorted(single) == whole
    with pytest.raises(IndexError):
        decoder.decode_meshlet(decoder.meshlet_count)


def test_same_bytes_for_any_thread_count(files, tmp_path):
    for threads in (1, 3):
        gltf_ext.compress(files[0], tmp_path / "again.glb", threads=threads, **BITS)
        assert (tmp_path / "again.glb").read_bytes() == files[1].read_bytes()


def test_compressing_a_compressed_file_warns(files, tmp_path):
    report = gltf_ext.compress(files[1], tmp_path / "twice.glb")
    assert "already quantised" in report["warnings"][0]
    assert gltf_ext.verify(files[1], tmp_path / "twice.glb")["ok"]


@pytest.mark.parametrize("bits", [4, 9, 16, 24])
def test_position_bits(tmp_path, bits):
    positions, triangles = grid_mesh(9, 9)
    builder = Builder()
    builder.mesh({"POSITION": positions * 1e3 + 1e3}, triangles)
    original = builder.write(tmp_path / "in.glb")
    gltf_ext.compress(original, tmp_path / "out.glb", position_bits=bits)
    report = gltf_ext.verify(original, tmp_path / "out.glb")
    assert report["ok"], report["problems"]
    assert report["max_error"]["POSITION"] <= np.sqrt(3) * (1e3 / (2**bits - 1) + 2e-4)


def test_step_in_model_units(tmp_path):
    positions, triangles = grid_mesh(9, 9)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    original = builder.write(tmp_path / "in.glb")
    gltf_ext.compress(original, tmp_path / "out.glb", step=0.01)
    attributes = gltf_ext.inspect(tmp_path / "out.glb")["primitives"][0]["attributes"]
    assert attributes["POSITION"]["step"] == [pytest.approx(0.01)] and attributes["POSITION"][
        "bits_per_component"
    ] == [8]
    assert gltf_ext.verify(original, tmp_path / "out.glb")["ok"]
    with pytest.raises(gltf_ext.MeshletError, match="needs more than 24 bits"):
        gltf_ext.compress(original, tmp_path / "out.glb", step=1e-8)


def two_meshes(path):
    """A small and a large mesh, both with a corner at the origin."""
    positions, triangles = grid_mesh(9, 9)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    builder.mesh({"POSITION": positions * 8}, triangles)
    return builder.write(path)


def test_scene_grid_is_one_step_for_all(tmp_path):
    original = two_meshes(tmp_path / "in.glb")
    steps = {}
    for grid in ("mesh", "scene"):
        gltf_ext.compress(original, tmp_path / "out.glb", grid=grid)
        assert gltf_ext.verify(original, tmp_path / "out.glb")["ok"]
        steps[grid] = {
            p["attributes"]["POSITION"]["step"][0]
            for p in gltf_ext.inspect(tmp_path / "out.glb")["primitives"]
        }
    assert len(steps["mesh"]) == 2 and steps["scene"] == {max(steps["mesh"])}


def test_fallback_is_the_decoded_data_in_its_own_buffer(files, decoded, tmp_path):
    report = gltf_ext.compress(files[0], tmp_path / "out.glb", fallback=True, **BITS)
    properties = glb_json(tmp_path / "out.glb")
    assert "extensionsRequired" not in properties and properties["extensionsUsed"] == [
        "EXT_meshlet_edgebreaker"
    ]
    assert properties["buffers"][1] == {
        "uri": "out.fallback.bin",
        "byteLength": report["fallback_bytes"],
    }
    (primitive,) = properties["meshes"][0]["primitives"]
    blob_view = primitive["extensions"].pop("EXT_meshlet_edgebreaker")["bufferView"]
    assert properties["bufferViews"][blob_view]["buffer"] == 0
    for accessor in (*primitive["attributes"].values(), primitive["indices"]):
        assert (
            properties["bufferViews"][properties["accessors"][accessor]["bufferView"]]["buffer"]
            == 1
        )
    plain = tmp_path / "plain.gltf"
    binary = (tmp_path / "out.glb").read_bytes()[-properties["buffers"][0]["byteLength"] :]
    (tmp_path / "blob.bin").write_bytes(binary)
    properties["buffers"][0]["uri"] = "blob.bin"
    plain.write_text(json.dumps(properties))
    (read,) = gltf_ext.load(plain)
    np.testing.assert_array_equal(read.indices, decoded.indices)
    for name, values in decoded.attributes.items():
        np.testing.assert_array_equal(read.attributes[name], values)


def test_fallback_of_a_compressed_file_with_a_difficult_name(files, decoded, tmp_path):
    output = tmp_path / "a b%c.glb"
    gltf_ext.compress(files[1], output, fallback=True)
    properties = glb_json(output)
    assert (
        "extensionsRequired" not in properties
        and properties["buffers"][1]["uri"] == "a%20b%25c.fallback.bin"
    )
    assert gltf_ext.validate(output) == []
    gltf_ext.compress(output, tmp_path / "again.glb")
    assert gltf_ext.verify(files[1], tmp_path / "again.glb")["ok"]
    assert len(glb_json(tmp_path / "again.glb")["buffers"]) == 1


def test_inspect_adds_up(files, source):
    report = gltf_ext.inspect(files[1])
    totals = report["totals"]
    properties = glb_json(files[1])
    extension = properties["meshes"][0]["primitives"][0]["extensions"]["EXT_meshlet_edgebreaker"]
    blob = properties["bufferViews"][extension["bufferView"]]["byteLength"]
    assert totals["compressed_bytes"] == blob + len(json.dumps(extension, separators=(",", ":")))
    vertex_bytes = sum(
        v.itemsize * v.shape[1] for arrays in (source[0], *source[2]) for v in arrays.values()
    )
    assert totals["raw_bytes"] == vertex_bytes * len(source[0]["POSITION"]) + 12 * len(source[1])
    assert totals["ratio"] == totals["raw_bytes"] / totals["compressed_bytes"]
    bits = dict(totals["bits_per_triangle"])
    total = bits.pop("total")
    assert list(bits) == [
        "connectivity",
        "references_and_headers",
        "positions",
        "normals",
        "texcoords",
        "other",
    ]
    assert (
        sum(bits.values()) == pytest.approx(total, rel=1e-12)
        and total == 8 * totals["compressed_bytes"] / totals["triangles"]
    )
    assert list(totals["symbols"]) == ["C", "L", "E", "R", "S"] and sum(
        totals["symbols"].values()
    ) == pytest.approx(1)
    assert totals["mean_triangles_per_meshlet"] == totals["triangles"] / totals["meshlets"]
    assert {k: files[2]["totals"][k] for k in totals} == totals


def test_custom_floats_keep_every_bit(tmp_path):
    positions, triangles = grid_mesh(6, 6)
    values = np.random.default_rng(0).integers(0, 2**32, (36, 2), dtype=np.uint32).view(np.float32)
    values[:4, 0] = np.nan, np.inf, -np.inf, -0.0
    builder = Builder()
    builder.properties["accessors"].append(
        {
            "bufferView": builder.view(values.tobytes()),
            "componentType": 5126,
            "count": 36,
            "type": "VEC2",
        }
    )
    builder.mesh(
        {"POSITION": positions, "_RAW": 0, "_ID": np.arange(36, dtype=np.uint8)}, triangles
    )
    original = builder.write(tmp_path / "in.glb")
    gltf_ext.compress(original, tmp_path / "out.glb")
    (primitive,) = gltf_ext.load(tmp_path / "out.glb")
    assert (
        primitive.attributes["_RAW"].tobytes()
        == values[primitive.attributes["_ID"][:, 0]].tobytes()
    )
    assert gltf_ext.verify(original, tmp_path / "out.glb")["ok"]
    assert gltf_ext.validate(tmp_path / "out.glb") == []


def test_lone_surrogates_survive(tmp_path):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions, "_\ud800": np.arange(16, dtype=np.uint8)}, triangles)
    builder.properties["nodes"][0]["name"] = "\ud801"
    original = builder.write(tmp_path / "in.glb")
    report = gltf_ext.compress(original, tmp_path / "out.glb")
    assert glb_json(tmp_path / "out.glb")["nodes"][0]["name"] == "\ud801"
    assert gltf_ext.inspect(tmp_path / "out.glb")["totals"] == report["totals"]

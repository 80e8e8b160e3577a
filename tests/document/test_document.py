"""Documents: unrelated properties are kept, references follow, containers are checked."""

import json
import struct

import numpy as np
import pytest

import gltf_ext
from gltf_ext.document.container import parse_glb, read_document, referenced_files
from tests.helpers.gltf_builder import Builder, glb_bytes, glb_json, grid_mesh

UNTOUCHED = (
    "asset",
    "scene",
    "scenes",
    "nodes",
    "materials",
    "textures",
    "images",
    "samplers",
    "cameras",
    "skins",
    "extensions",
    "extras",
)


@pytest.fixture
def rich(tmp_path):
    """A file that uses most of glTF, and the index of an unused accessor."""
    positions, triangles = grid_mesh(12, 12)
    builder = Builder()
    unused = builder.accessor(np.zeros((50, 3), np.float32))
    times, turns = (
        builder.accessor(np.arange(3, dtype=np.float32)),
        builder.accessor(np.eye(4, dtype=np.float32)[:3]),
    )
    bind = builder.accessor(np.tile(np.eye(4, dtype=np.float32).reshape(1, 16), (2, 1)))
    offsets = builder.accessor(np.arange(9, dtype=np.float32).reshape(3, 3))
    picture = builder.view(b"\x89PNG picture")
    primitive = builder.mesh(
        {"POSITION": positions}, triangles, material=0, extras={"kept": [1, {}, []]}
    )
    primitive["extensions"] = {
        "KHR_materials_variants": {"mappings": [{"material": 0, "variants": [0]}]}
    }
    builder.properties.update(
        asset={"version": "2.0", "generator": "by hand", "copyright": "", "extras": {"a": {}}},
        nodes=[
            {
                "mesh": 0,
                "skin": 0,
                "name": "",
                "extras": 5,
                "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": offsets}}},
            },
            {"name": "joint", "matrix": np.eye(4).ravel().tolist()},
            {"camera": 0, "translation": [0, 0, 1.5], "unknownProperty": {"x": [None]}},
        ],
        scenes=[{"nodes": [0, 1, 2], "name": "all"}],
        materials=[
            {
                "pbrMetallicRoughness": {"metallicFactor": 0.0},
                "alphaMode": "OPAQUE",
                "extensions": {"KHR_materials_unlit": {}},
            }
        ],
        textures=[{"source": 0}],
        images=[{"bufferView": picture, "mimeType": "image/png"}],
        samplers=[{"wrapS": 10497}],
        cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        skins=[{"joints": [1, 2], "inverseBindMatrices": bind}],
        animations=[
            {
                "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}],
                "samplers": [{"input": times, "output": turns}],
            }
        ],
        extensions={"KHR_materials_variants": {"variants": [{"name": "v"}]}},
        extras=["anything"],
        extensionsUsed=["KHR_materials_unlit", "KHR_materials_variants", "EXT_mesh_gpu_instancing"],
    )
    return builder.write(tmp_path / "in.glb"), unused


def values_of(path, index):
    """The bytes of an accessor, read without the package."""
    properties, data = glb_json(path), path.read_bytes()
    binary = data[
        len(data)
        - properties["buffers"][0]["byteLength"]
        - -properties["buffers"][0]["byteLength"] % 4 :
    ]
    accessor = properties["accessors"][index]
    view = properties["bufferViews"][accessor["bufferView"]]
    size = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[accessor["type"]] * 4 * accessor["count"]
    return binary[view["byteOffset"] + accessor.get("byteOffset", 0) :][:size]


@pytest.mark.parametrize("plain", [False, True])
def test_everything_else_is_kept(rich, tmp_path, plain):
    original, _ = rich
    output = tmp_path / "out.glb"
    gltf_ext.compress(original, output)
    if plain:
        gltf_ext.decompress(output, tmp_path / "plain.glb")
        output = tmp_path / "plain.glb"
    before, after = glb_json(original), glb_json(output)
    moved = {"skins": ("inverseBindMatrices",), "images": ("bufferView",)}
    for name in UNTOUCHED:
        expected, found = json.loads(json.dumps(before[name])), after[name]
        for key in moved.get(name, ()):
            for item in (*expected, *found):
                item.pop(key)
        if name == "nodes":
            for item in (expected[0], found[0]):
                item["extensions"]["EXT_mesh_gpu_instancing"]["attributes"].pop("TRANSLATION")
        assert found == expected, name
    primitive = after["meshes"][0]["primitives"][0]
    assert primitive["extras"] == {"kept": [1, {}, []]} and primitive["material"] == 0
    assert (
        primitive["extensions"]["KHR_materials_variants"]
        == before["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]
    )


def test_references_follow_their_data(rich, tmp_path):
    original, _ = rich
    output = tmp_path / "out.glb"
    gltf_ext.compress(original, output)
    before, after = glb_json(original), glb_json(output)
    places = [
        lambda p: p["skins"][0]["inverseBindMatrices"],
        lambda p: p["animations"][0]["samplers"][0]["input"],
        lambda p: p["animations"][0]["samplers"][0]["output"],
        lambda p: p["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"][
            "TRANSLATION"
        ],
    ]
    for place in places:
        assert values_of(output, place(after)) == values_of(original, place(before))
    assert len(after["accessors"]) == 4 + 2, "the unused accessor and the old geometry are gone"


def test_leftovers_of_shared_buffer_views_are_cut_out(tmp_path):
    positions, triangles = grid_mesh(40, 40)
    times = np.arange(4, dtype=np.float32)
    builder = Builder()
    view = builder.view(positions.tobytes() + times.tobytes())
    builder.properties["accessors"] += [
        {"bufferView": view, "componentType": 5126, "count": len(positions), "type": "VEC3"},
        {
            "bufferView": view,
            "byteOffset": positions.nbytes,
            "componentType": 5126,
            "count": 4,
            "type": "SCALAR",
        },
    ]
    builder.mesh({"POSITION": 0}, triangles)
    builder.properties["animations"] = [{"channels": [], "samplers": [{"input": 1, "output": 1}]}]
    gltf_ext.compress(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb")
    after = glb_json(tmp_path / "out.glb")
    assert (
        values_of(tmp_path / "out.glb", after["animations"][0]["samplers"][0]["input"])
        == times.tobytes()
    )
    assert (tmp_path / "out.glb").stat().st_size < positions.nbytes


@pytest.mark.parametrize("key", ["accessor", "indices"])
def test_unknown_extensions_keep_the_data_that_they_refer_to(tmp_path, key):
    """By a key that says so, or one that may refer to accessors, with a warning."""
    positions, triangles = grid_mesh(8, 8)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    builder.properties["nodes"][0]["extensions"] = {"ACME_thing": {key: 0}}
    builder.properties["extensionsUsed"] = ["ACME_thing"]
    original = builder.write(tmp_path / "in.glb")
    report = gltf_ext.compress(original, tmp_path / "out.glb")
    assert any("ACME_thing" in line for line in report["warnings"]) == (key == "indices")
    assert glb_json(tmp_path / "out.glb")["nodes"][0]["extensions"] == {"ACME_thing": {key: 0}}
    assert values_of(tmp_path / "out.glb", 0) == values_of(original, 0)
    assert gltf_ext.verify(original, tmp_path / "out.glb")["ok"]


@pytest.fixture
def small(tmp_path):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    return builder.write(tmp_path / "in.glb").read_bytes()


@pytest.mark.parametrize(
    "damage, message",
    [
        (lambda d: d[:8], "shorter than a .glb header"),
        (lambda d: d[:-4], "its header says"),
        (lambda d: d[:4] + struct.pack("<I", 1) + d[8:], "version 1"),
        (lambda d: d[:12] + struct.pack("<I", 2**31) + d[16:], "beyond the end of the file"),
        (lambda d: d[:16] + b"BIN\0" + d[20:], "first chunk is not JSON"),
        (lambda d: d[:20] + b"x" + d[21:], "JSON cannot be read"),
    ],
)
def test_damaged_containers(small, damage, message):
    with pytest.raises(gltf_ext.MeshletError, match=message):
        parse_glb(damage(small))


@pytest.mark.parametrize(
    "change, message",
    [
        ({"accessors": {}}, "accessors is not an array"),
        ({"accessors": [{"count": "5"}]}, r"accessors\[0\].count is not an integer"),
        ({"nodes": [{"matrix": ["a"] * 16}]}, r"nodes\[0\].matrix\[0\] is not a finite number"),
        *(
            ({"nodes": [{name: [1.0] * 5}]}, rf"nodes\[0\].{name} has 5 numbers instead of")
            for name in ("translation", "rotation", "scale", "matrix")
        ),
        ({"nodes": [{"translation": [0, 10**400, 0]}]}, r"translation\[1\] is not a finite number"),
        (
            {"cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 10**400}}]},
            "znear is not a finite number",
        ),
        ({"accessors": [{"count": 10**400}]}, r"accessors\[0\].count is not an integer"),
        ({"accessors": [{"count": 2**53}]}, r"accessors\[0\].count is too large"),
        ({"accessors": [{"count": True}]}, r"accessors\[0\].count is not an integer"),
        ({"accessors": [{"max": [10**400]}]}, r"accessors\[0\].max\[0\] is not a finite number"),
        ({"nodes": [{"translation": [0, float("nan"), 0]}]}, r"translation\[1\] is not a finite"),
        (
            {"meshes": [{"primitives": [{"attributes": {"POSITION": []}}]}]},
            "POSITION is not an integer",
        ),
        ({"asset": {"version": "1.0"}}, "not glTF 2.0"),
        ({"asset": {"version": "20"}}, "is glTF 20, not glTF 2.0"),
        ({"asset": {"version": None}, "meshes": {}, "accessors": {"a": {}}}, "is glTF 1.0"),
        ({"extensions": 3}, "extensions is not an object"),
    ],
)
def test_wrong_types_are_named(change, message):
    with pytest.raises(gltf_ext.MeshletError, match=message):
        parse_glb(glb_bytes({"asset": {"version": "2.0"}, **change}, b""))


def test_deep_json_is_refused():
    text = b'{"asset":{"version":"2.0"},"extras":' + b"[" * 100000 + b"]" * 100000 + b"}"
    with pytest.raises(gltf_ext.MeshletError):
        parse_glb(
            struct.pack("<4sII", b"glTF", 2, 20 + len(text))
            + struct.pack("<I4s", len(text), b"JSON")
            + text
        )


@pytest.mark.parametrize(
    "uri", ["/etc/hostname", "http://example.com/a.bin", "file:///etc/hostname", "missing.bin"]
)
def test_foreign_uris_are_refused(tmp_path, uri):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    builder.properties["buffers"] = [{"byteLength": len(builder.binary), "uri": uri}]
    (tmp_path / "in.gltf").write_text(json.dumps(builder.properties))
    with pytest.raises(gltf_ext.MeshletError, match="refers to"):
        gltf_ext.compress(tmp_path / "in.gltf", tmp_path / "out.glb")


@pytest.mark.parametrize("name", ["self", "__class__", "__dict__", "args", "kwargs", "__init__"])
def test_attributes_may_have_any_name(tmp_path, name):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh({"POSITION": positions, name: positions}, triangles)
    original = builder.write(tmp_path / "in.glb")
    gltf_ext.compress(original, tmp_path / "out.glb")
    assert gltf_ext.verify(original, tmp_path / "out.glb")["ok"]
    assert gltf_ext.validate(tmp_path / "out.glb") == []
    assert name in gltf_ext.load(tmp_path / "out.glb")[0].attributes
    gltf_ext.decompress(tmp_path / "out.glb", tmp_path / "plain.glb")
    assert glb_json(tmp_path / "plain.glb")["meshes"][0]["primitives"][0]["attributes"].keys() == {
        "POSITION",
        name,
    }


def test_only_the_first_buffer_is_the_binary_chunk():
    properties = {"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4}] * 2}
    document = parse_glb(glb_bytes(properties, b"abcd"))
    assert bytes(document.bytes_of_buffer(0)) == b"abcd"
    with pytest.raises(
        gltf_ext.MeshletError, match="buffer 1 has neither a uri nor a binary chunk"
    ):
        document.bytes_of_buffer(1)


@pytest.mark.parametrize("buffers", [None, {}, 5, [5], ["a.bin"], [{"uri": 5}], [{}, None]])
def test_files_that_a_malformed_document_names(tmp_path, buffers):
    """They are told before the document is read, which then says what is wrong."""
    path = tmp_path / "a.gltf"
    images = [{"uri": "a%20b.png"}, {"uri": "data:,"}]
    path.write_text(json.dumps({"buffers": buffers, "images": images}))
    assert referenced_files(path) == [tmp_path / "a b.png"]
    path.write_text(json.dumps([buffers]))
    assert referenced_files(path) == []
    path.write_text(json.dumps({"images": images}))
    assert referenced_files(path) == read_document(path).files()

"""Extensions: those that number what moves, and those that refer to accessors and buffer views."""

import json

import numpy as np
import pytest

import gltf_ext
from gltf_ext.commands.order import NUMBERED
from gltf_ext.document.accessors import read_accessor
from gltf_ext.document.container import read_document
from gltf_ext.document.gltf2 import read_gltf2, to_gltf2
from tests.helpers.gltf_builder import Builder, glb_json, grid_mesh

SOUND = b"a sound of 17 B.."


def model(*, degenerate=False):
    """A sheet; on request a second mesh that is not compressed."""
    builder = Builder()
    positions, triangles = grid_mesh(30, 30)
    primitive = builder.mesh({"POSITION": positions, "NORMAL": positions}, triangles)
    if degenerate:
        builder.mesh({"POSITION": positions}, np.zeros(3, np.uint32))
    return builder, primitive


def compressed(builder, folder, **options):
    path = builder.write(folder / "in.glb")
    report = gltf_ext.compress(path, folder / "out.glb", **options)
    assert gltf_ext.verify(path, folder / "out.glb")["ok"]
    assert gltf_ext.validate(folder / "out.glb") == []
    return report, glb_json(folder / "out.glb")


# --- extensions that number vertices, corners or triangles ---


@pytest.mark.parametrize("place", ["primitive", "mesh"])
@pytest.mark.parametrize("name", NUMBERED)
def test_what_numbers_the_moved_is_dropped(tmp_path, name, place):
    builder, primitive = model()
    data = builder.accessor(np.zeros(96, np.uint8))
    value = {"visibility": data, "lineStrings": [{"indices": data}], "mapIndices": data}
    value["manifoldPrimitive"] = {"indices": data, "attributes": {"POSITION": data}}
    holder = primitive if place == "primitive" else builder.properties["meshes"][0]
    holder["extensions"] = {name: value}
    builder.properties["extensionsUsed"] = builder.properties["extensionsRequired"] = [name]
    report, properties = compressed(builder, tmp_path)
    assert report["warnings"] == [f"{name} numbers {NUMBERED[name]}, whose order changes; dropped"]
    assert name not in json.dumps(properties)
    assert len(properties["accessors"]) == 3


def test_what_is_not_compressed_keeps_its_extensions(tmp_path):
    builder, primitive = model(degenerate=True)
    name = "EXT_mesh_primitive_edge_visibility"
    data = np.arange(96, dtype=np.uint8)
    builder.properties["extensionsUsed"] = [name]
    other = builder.properties["meshes"][1]["primitives"][0]
    for holder in (primitive, other):
        holder["extensions"] = {name: {"visibility": builder.accessor(data)}}
    _, properties = compressed(builder, tmp_path)
    assert name in properties["extensionsUsed"]
    first, second = (mesh["primitives"][0]["extensions"] for mesh in properties["meshes"])
    assert name not in first
    document = read_document(tmp_path / "out.glb")
    values = read_accessor(document, second[name]["visibility"], "it")
    assert np.array_equal(values.ravel(), data)


@pytest.mark.parametrize("count", ["vertices", "triangles", "corners"])
def test_unknown_extensions_with_a_value_for_each_are_dropped(tmp_path, count):
    builder, primitive = model()
    counts = {"vertices": 900, "triangles": 29 * 29 * 2, "corners": 29 * 29 * 6}
    data = builder.accessor(np.zeros(counts[count], np.uint8))
    primitive["extensions"] = {"ACME_creases": {"edgeAccessor": data}}
    builder.properties["extensionsUsed"] = ["ACME_creases"]
    report, properties = compressed(builder, tmp_path)
    text = "ACME_creases numbers vertices or triangles, whose order changes; dropped"
    assert report["warnings"] == [text] and "ACME" not in json.dumps(properties)


def test_other_unknown_extensions_of_primitives_are_kept_with_a_warning(tmp_path):
    builder, primitive = model()
    extensions = {"ACME_seams": {"loops": [[0, 1, 2]]}, "ACME_kind": {"type": "volume"}}
    primitive["extensions"] = dict(extensions)
    report, properties = compressed(builder, tmp_path)
    (warning,) = report["warnings"]
    assert warning.startswith("ACME_seams is kept, but wrong if it numbers vertices or triangles")
    result = properties["meshes"][0]["primitives"][0]["extensions"]
    assert extensions.items() <= result.items()


# --- feature ids ---

FEATURES, METADATA = "EXT_mesh_features", "EXT_feature_metadata"
IMPLICIT = [
    (FEATURES, "featureIds", {"featureCount": 900, "propertyTable": 0}, lambda i: i),
    (FEATURES, "featureIds", {"offset": 3, "repeat": 4}, lambda i: 3 + i // 4),
    (
        METADATA,
        "featureIdAttributes",
        {"featureTable": "t", "featureIds": {"constant": 2, "divisor": 3}},
        lambda i: 2 + i // 3,
    ),
]


@pytest.mark.parametrize("name, key, entry, rule", IMPLICIT, ids=["final", "draft", "metadata"])
def test_implicit_feature_ids_become_an_attribute(tmp_path, name, key, entry, rule):
    builder, primitive = model()
    numbers = np.arange(900, dtype=np.float32)
    primitive["attributes"]["_ID"] = builder.accessor(numbers)
    primitive["attributes"]["_FEATURE_ID_0"] = builder.accessor(np.zeros(900, np.uint16))
    primitive["extensions"] = {name: {key: [{"attribute": 0, "featureIds": {"attribute": "x"}},
                                            dict(entry)]}}  # fmt: skip
    report, properties = compressed(builder, tmp_path)
    assert not any(name in line for line in report["warnings"])
    attributes = gltf_ext.load(tmp_path / "out.glb")[0].attributes
    expected = rule(attributes["_ID"].ravel().astype(int))
    assert np.array_equal(attributes["_FEATURE_ID_1"].ravel(), expected)
    first, second = properties["meshes"][0]["primitives"][0]["extensions"][name][key]
    assert first == {"attribute": 0, "featureIds": {"attribute": "x"}}
    if name == METADATA:
        assert second == {"featureTable": "t", "featureIds": {"attribute": "_FEATURE_ID_1"}}
    else:
        assert second["attribute"] == 1 and "repeat" not in second


@pytest.mark.parametrize(
    "entry",
    [{"attribute": 0}, {"texture": {"index": 0}}, {"index": 0, "texCoord": 0}, {"offset": 5}],
)
def test_other_feature_ids_stay(tmp_path, entry):
    builder, primitive = model()
    primitive["extensions"] = {FEATURES: {"featureIds": [entry]}}
    report, properties = compressed(builder, tmp_path)
    result = properties["meshes"][0]["primitives"][0]
    assert result["extensions"][FEATURES] == {"featureIds": [entry]} and not report["warnings"]
    assert sorted(result["attributes"]) == ["NORMAL", "POSITION"]


def test_shared_vertices_share_feature_ids(tmp_path):
    """Two equal primitives are still one blob."""
    builder, primitive = model()
    primitive["extensions"] = {FEATURES: {"featureIds": [{"featureCount": 900}]}}
    builder.properties["meshes"].append(json.loads(json.dumps(builder.properties["meshes"][0])))
    report, _ = compressed(builder, tmp_path)
    assert report["primitives"][1]["shares_buffer_view_of"] == [0, 0]


def test_feature_ids_of_what_is_compressed_already_are_dropped(tmp_path):
    compressed(model()[0], tmp_path)
    document = read_document(tmp_path / "out.glb")
    extensions = document.primitive(0, 0)["extensions"]
    extensions[FEATURES] = {"featureIds": [{"featureCount": 900}]}
    report = gltf_ext.compress(to_gltf2(document)[0])
    assert any("feature ids follow from the order" in line for line in report["warnings"])
    assert FEATURES not in json.dumps(read_gltf2(report["gltf"]).json)


def test_feature_ids_of_a_primitive_larger_than_memory(tmp_path):
    builder = Builder()
    positions, triangles = grid_mesh(260, 260)
    primitive = builder.mesh({"POSITION": positions}, triangles)
    primitive["extensions"] = {FEATURES: {"featureIds": [{"featureCount": len(positions)}]}}
    path = builder.write(tmp_path / "in.glb")
    for memory in (None, "110M"):
        gltf_ext.compress(path, tmp_path / "out.glb", max_memory=memory)
        assert gltf_ext.verify(path, tmp_path / "out.glb", max_memory=memory)["ok"]
        ids = gltf_ext.load(tmp_path / "out.glb")[0].attributes["_FEATURE_ID_0"]
        assert ids.dtype == np.float32 and len(np.unique(ids)) == len(positions)


@pytest.mark.parametrize("entry", [{"repeat": 10**30}, {"offset": 1, "repeat": 900}])
def test_one_feature_of_all_vertices(tmp_path, entry):
    builder, primitive = model()
    primitive["extensions"] = {FEATURES: {"featureIds": [entry]}}
    offset = entry.get("offset", 0)
    compressed(builder, tmp_path)
    ids = gltf_ext.load(tmp_path / "out.glb")[0].attributes["_FEATURE_ID_0"]
    assert (ids == offset).all()


def test_feature_ids_of_more_vertices_than_there_are(tmp_path):
    builder, primitive = model()
    primitive["extensions"] = {FEATURES: {"featureIds": [{"repeat": 2**40}]}}
    position = primitive["attributes"]["POSITION"]
    builder.properties["accessors"][position]["count"] = 2**45
    with pytest.raises(gltf_ext.MeshletError, match="reaches beyond bufferView"):
        gltf_ext.compress(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb")


def test_more_feature_ids_than_streams_are_dropped(tmp_path):
    builder, primitive = model()
    entries = [{"featureCount": 900} for _ in range(100_000)]
    primitive["extensions"] = {FEATURES: {"featureIds": entries}}
    report, properties = compressed(builder, tmp_path)
    assert [line for line in report["warnings"] if "feature ids follow" in line] == [
        f"{FEATURES} of mesh 0 primitive 0: feature ids follow from the order of vertices, which "
        "changes; dropped"
    ]
    (result,) = properties["meshes"][0]["primitives"]
    assert [entry["attribute"] for entry in result["extensions"][FEATURES]["featureIds"]] == list(
        range(62)
    )
    assert len(result["attributes"]) == 64 and not report["kept"]


def test_degenerate_triangles_with_feature_ids_in_files(tmp_path):
    builder = Builder()
    triangles = np.zeros((100_000, 3), np.uint32)
    primitive = builder.mesh({"POSITION": np.eye(3, dtype=np.float32)}, triangles)
    primitive["extensions"] = {FEATURES: {"featureIds": [{"featureCount": 3}]}}
    path = builder.write(tmp_path / "in.glb")
    with pytest.raises(gltf_ext.MeshletError, match="degenerate"):
        gltf_ext.compress(path, tmp_path / "out.glb", max_memory="96M")


# --- references ---

# Extension -> its JSON: with `view`, a buffer view, and `data`, an accessor.
KEPT = {
    "KHR_audio_emitter": lambda view, data: {"audio": [{"bufferView": view, "mimeType": "a/b"}]},
    "MSFT_audio_emitter": lambda view, data: {"clips": [{"bufferView": view}], "emitters": [0]},
    "EXT_structural_metadata": lambda view, data: {
        "propertyTables": [{"properties": {"a": {"values": view, "stringOffsets": view}}}]
    },
    "EXT_feature_metadata": lambda view, data: {
        "featureTables": {"t": {"properties": {"a": {"arrayOffsetBufferView": view}}}}
    },
    "ULTRA_RigidBodyColliders": lambda view, data: {"colliders": [{"faces": view}]},
    "BENTLEY_primitive_restart": lambda view, data: {"primitiveGroups": [{"indices": data}]},
    "EXT_mesh_primitive_edge_visibility": lambda view, data: {
        "primitives": [{"attributes": {"POSITION": data}}]
    },
    "MPEG_audio_spatial": lambda view, data: {"sources": [{"pointers": [data]}]},
    "ACME_curves": lambda view, data: {
        "curveAccessors": [data],
        "more": {"data_accessor_id": data},
    },
    "ACME_blobs": lambda view, data: {"blobs": {"a": {"BUFFER_VIEW": view}}},
}


def test_an_extension_that_is_named_extensions(tmp_path):
    builder, _ = model()
    view = builder.view(SOUND)
    value = {"extensions": {"ACME_blobs": {"bufferView": view}}}
    builder.properties["nodes"][0]["extensions"] = value
    _, properties = compressed(builder, tmp_path)
    kept = properties["nodes"][0]["extensions"]["extensions"]["ACME_blobs"]["bufferView"]
    assert bytes(read_document(tmp_path / "out.glb").bytes_of_view(kept)) == SOUND


@pytest.mark.parametrize("lod", [False, True])
@pytest.mark.parametrize("name", KEPT)
def test_references_of_extensions_follow_their_data(tmp_path, name, lod):
    if lod:
        pytest.importorskip("meshoptimizer")
    builder, _ = model()
    numbers = np.arange(17, dtype=np.uint8)
    data, view = builder.accessor(numbers), builder.view(SOUND)
    builder.properties["extensions"] = {name: KEPT[name](view, data)}
    report, properties = compressed(builder, tmp_path, lod=lod)
    assert not any(name in line for line in report["warnings"])
    document = read_document(tmp_path / "out.glb")
    kept = (-1, -1)
    for i in range(len(properties["bufferViews"])):
        if bytes(document.bytes_of_view(i)) == SOUND:
            kept = (i, kept[1])
    for i, accessor in enumerate(properties["accessors"]):
        if accessor["count"] == 17:
            kept = (kept[0], i)
            assert np.array_equal(read_accessor(document, i, "it").ravel(), numbers)
    assert properties["extensions"][name] == KEPT[name](*kept)
    assert (tmp_path / "out.glb").stat().st_size < (tmp_path / "in.glb").stat().st_size


NO_REFERENCES = {
    "CESIUM_RTC": {"center": [1, 2, 3]},
    "KHR_interactivity": {
        "graphs": [{"types": [{"signature": "int"}], "variables": [{"type": 0, "value": [1]}],
                    "nodes": [{"declaration": 0, "values": {"a": {"node": 1, "value": [2]}},
                               "flows": {"out": {"node": 1, "socket": "in"}},
                               "input": 0, "output": 1, "indices": [0, 1, 2]}]}],
        "graph": 0,
    },
    "KHR_implicit_shapes": {"shapes": [{"type": "box", "box": {"size": [1, 2, 1]}}]},
    "KHR_physics_rigid_bodies": {"collider": {"geometry": {"shape": 0, "node": 0}, "mass": 2}},
    "EXT_instance_features": {"featureIds": [{"featureCount": 3, "attribute": 0}]},
    "OMI_physics_shape": {"shapes": [{"type": "trimesh", "mesh": 0}]},
    "OMI_seat": {"back": [0, 0, 1], "angle": 1},
    "MOZ_lightmap": {"index": 0, "texCoord": 1, "intensity": 1},
    "MOZ_hubs_components": {"loop-animation": {"activeClipIndices": [0, 1]}, "uv": {"indices": 2}},
    "VRMC_springBone": {"springs": [{"joints": [{"node": 0}], "center": 1}]},
    "ACME_anything": {"count": 2, "level": 1, "list": [0, 1, 2], "accessorCount": 3, "index": 0},
    "ACME_far": {"indices": [100, 7000], "dataAccessor": 99},
}  # fmt: skip


@pytest.mark.parametrize("name", NO_REFERENCES)
def test_other_integers_keep_no_data(tmp_path, name):
    builder, _ = model()
    builder.properties["nodes"][0]["extensions"] = {name: NO_REFERENCES[name]}
    report, properties = compressed(builder, tmp_path)
    assert not report["warnings"]
    assert properties["nodes"][0]["extensions"] == {name: NO_REFERENCES[name]}
    assert len(properties["accessors"]) == 3 and len(properties["bufferViews"]) == 1


@pytest.mark.parametrize("lod", [False, True])
def test_integers_that_may_be_references_stay_and_keep_what_they_name(tmp_path, lod):
    if lod:
        pytest.importorskip("meshoptimizer")
    builder, _ = model()
    numbers = np.arange(17, dtype=np.uint8)
    data = builder.accessor(numbers)
    unused = builder.accessor(np.zeros((9000, 4), np.float32))
    value = {"curves": [{"input": data, "indices": [data], "attributes": {"A": data}}]}
    builder.properties["extensions"] = {"ACME_curves": value}
    report, properties = compressed(builder, tmp_path, lod=lod)
    (warning,) = [line for line in report["warnings"] if "ACME" in line]
    assert warning.startswith("ACME_curves may refer to original accessors")
    assert properties["extensions"] == {"ACME_curves": value} and unused == data + 1
    document = read_document(tmp_path / "out.glb")
    assert np.array_equal(read_accessor(document, data, "it").ravel(), numbers)
    sizes = [view["byteLength"] for view in properties["bufferViews"]]
    assert max(sizes) < 30_000, "the original geometry is gone"
    again = gltf_ext.decompress(tmp_path / "out.glb", tmp_path / "plain.glb")
    assert again["triangles"] == 29 * 29 * 2
    plain = read_document(tmp_path / "plain.glb")
    assert np.array_equal(read_accessor(plain, data, "it").ravel(), numbers)


def test_numbers_of_what_accessors_hold_may_be_references(tmp_path):
    builder, _ = model()
    numbers = np.arange(17, dtype=np.uint8)
    data = builder.accessor(numbers)
    value = {"positions": data}
    builder.properties["nodes"][0]["extensions"] = {"FOO_points": value}
    report, properties = compressed(builder, tmp_path)
    assert properties["nodes"][0]["extensions"] == {"FOO_points": value}
    assert report["warnings"][0].startswith("FOO_points may refer to original accessors")
    document = read_document(tmp_path / "out.glb")
    assert np.array_equal(read_accessor(document, data, "it").ravel(), numbers)


def test_what_only_an_unknown_extension_can_need_stays(tmp_path):
    """Whatever its keys are: nothing else refers to an accessor and a view of these numbers."""
    builder, _ = model()
    numbers = np.arange(17, dtype=np.uint8)
    builder.accessor(np.zeros(9000, np.float32))  # that nobody has a number of
    data, view = builder.accessor(numbers), builder.view(SOUND)
    value = {"curve": data, "more": [{"sound": view, "count": 0}]}
    builder.properties["nodes"][0]["extensions"] = {"ACME_thing": value}
    report, _ = compressed(builder, tmp_path)
    (warning,) = [line for line in report["warnings"] if "ACME" in line]
    assert warning.startswith("ACME_thing may refer to original accessors or buffer views")
    gltf_ext.decompress(tmp_path / "out.glb", tmp_path / "plain.glb")
    gltf_ext.transcode(tmp_path / "out.glb", tmp_path / "packed.glb")
    for name in ("out.glb", "plain.glb", "packed.glb"):
        document = read_document(tmp_path / name)
        assert document.json["nodes"][0]["extensions"] == {"ACME_thing": value}
        assert np.array_equal(read_accessor(document, data, "it").ravel(), numbers)
        assert bytes(document.bytes_of_view(view)) == SOUND
        assert max(v["byteLength"] for v in document.bufferViews) < 30_000


def test_data_that_nothing_can_need_goes(tmp_path):
    builder, _ = model()
    builder.accessor(np.zeros(9000, np.float32))
    builder.properties["nodes"][0]["extensions"] = {"ACME_thing": {"index": 0, "size": 1.5}}
    report, properties = compressed(builder, tmp_path)
    assert not report["warnings"] and len(properties["accessors"]) == 3

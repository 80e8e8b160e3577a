"""pygltflib's GLTF2 objects in and out: nothing is lost, and the input stays as it is."""

import base64
import json

import numpy as np
import pygltflib
import pytest

import gltf_ext
from gltf_ext.document.container import read_document
from gltf_ext.document.gltf2 import read_gltf2, to_gltf2
from gltf_ext.lod import LodPrimitive, open_lod
from tests.helpers.gltf_builder import Builder, glb_json, grid_mesh

INDEX = {"index": 0}
MATERIALS = {
    "anisotropy": {"anisotropyStrength": 0.5, "anisotropyTexture": INDEX},
    "clearcoat": {"clearcoatFactor": 1.0, "clearcoatNormalTexture": {"index": 0, "scale": 0.5}},
    "diffuse_transmission": {"diffuseTransmissionColorFactor": [1, 0.5, 0]},
    "dispersion": {"dispersion": 0.1},
    "emissive_strength": {"emissiveStrength": 4.0},
    "ior": {"ior": 1.4},
    "iridescence": {"iridescenceFactor": 1.0, "iridescenceThicknessTexture": INDEX},
    "pbrSpecularGlossiness": {"diffuseFactor": [1, 1, 1, 1], "glossinessFactor": 0.0},
    "sheen": {"sheenColorFactor": [0.1, 0.2, 0.3], "sheenRoughnessTexture": INDEX},
    "specular": {"specularColorFactor": [1.0, 1.0, 1.0]},
    "transmission": {"transmissionFactor": 1.0},
    "unlit": {},
    "volume": {"thicknessFactor": 0.0, "attenuationColor": [1, 1, 1]},
    "volume_scatter": {"multiscatterColor": [0, 0, 0]},
}
TRANSFORM = {"offset": [0, 0.5], "rotation": 0.0, "texCoord": 1, "extensions": {}, "extras": {}}
INFO = ("materials", 0, "pbrMetallicRoughness", "baseColorTexture")
PRIMITIVE = ("meshes", 0, "primitives", 0)
# Extension -> (its holder's place, its JSON): those of Khronos' sample assets, and of public files.
EXTENSIONS = {
    **{f"KHR_materials_{name}": (("materials", 0), v) for name, v in MATERIALS.items()},
    "KHR_materials_variants": (PRIMITIVE, {"mappings": [{"material": 0, "variants": [0]}]}),
    "KHR_animation_pointer": (
        ("animations", 0, "channels", 0, "target"),
        {"pointer": "/nodes/0/translation"},
    ),
    "KHR_draco_mesh_compression": (PRIMITIVE, {"bufferView": 0, "attributes": {"POSITION": 0}}),
    "KHR_gaussian_splatting": (PRIMITIVE, {"kernel": "ellipse", "extensions": {"X_y": {}}}),
    "KHR_lights_punctual": (("nodes", 0), {"light": 0}),
    "KHR_mesh_quantization": ((), {}),
    "KHR_node_hoverability": (("nodes", 0), {"hoverable": False}),
    "KHR_node_selectability": (("nodes", 0), {"selectable": False}),
    "KHR_node_visibility": (("nodes", 0), {"visible": True}),
    "KHR_texture_basisu": (("textures", 0), {"source": 0}),
    "KHR_texture_transform": (INFO, TRANSFORM),
    "KHR_xmp_json_ld": ((), {"packets": [{"@context": {}, "dc:title": ""}]}),
    "KHR_audio_emitter": (("scenes", 0), {"emitters": []}),
    "KHR_interactivity": ((), {"graphs": [{"nodes": []}], "graph": 0}),
    "AGI_articulations": (("nodes", 0), {"isAttachPoint": True}),
    "CESIUM_RTC": ((), {"center": [1e6, 2.5, 0.0]}),
    "CESIUM_primitive_outline": (PRIMITIVE, {"indices": 1}),
    "EXT_lights_image_based": (("scenes", 0), {"light": 0}),
    "EXT_mesh_features": (PRIMITIVE, {"featureIds": [{"featureCount": 4, "attribute": 0}]}),
    "EXT_mesh_gpu_instancing": (("nodes", 0), {"attributes": {"TRANSLATION": 0}}),
    "EXT_structural_metadata": ((), {"schema": {"id": "x", "classes": {}}}),
    "EXT_texture_avif": (("textures", 0), {"source": 0}),
    "EXT_texture_webp": (("textures", 0), {"source": 0}),
    "FB_ngon_encoding": (PRIMITIVE, {}),
    "MOZ_lightmap": (("materials", 0), {"index": 0, "intensity": 0}),
    "MSFT_lod": (("nodes", 0), {"ids": [0]}),
    "MSFT_texture_dds": (("textures", 0), {"source": 0}),
    "VRM": ((), {"exporterVersion": "", "humanoid": {"humanBones": []}}),
}
GEOMETRY = {"KHR_draco_mesh_compression"}  # would have to be decoded
# The order of triangles changes, and these tell of it.
DROPPED = {"FB_ngon_encoding", "CESIUM_primitive_outline"}


def holder_of(properties, place):
    for key in place:
        properties = properties[key]
    return properties


def builder():
    """A model with an object of each kind, and properties that pygltflib does not know."""
    positions, triangles = grid_mesh(8, 8)
    result = Builder()
    result.mesh({"_FIRST": positions, "POSITION": positions}, triangles, material=0)
    times, turns = np.arange(2, dtype=np.float32), np.eye(4, dtype=np.float32)[:2]
    sampler = {"input": result.accessor(times), "output": result.accessor(turns)}
    result.properties.update(
        nodes=[{"mesh": 0, "weights": [0.5], "extras": {}, "name": "", "x": {"y": [None, {}]}}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": INDEX}, "alphaMode": "OPAQUE"}],
        textures=[{"source": 0, "sampler": 0}],
        samplers=[{"name": "known to glTF, but not to pygltflib", "wrapS": 10497}],
        images=[{"bufferView": result.view(b"\x89PNG"), "mimeType": "image/png"}],
        animations=[
            {
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
                "samplers": [sampler],
            }
        ],
        unknown=[{}, [], 0, None],
    )
    return result


@pytest.fixture
def model(tmp_path):
    return builder().write(tmp_path / "in.glb")


def with_extension(name, path):
    place, value = EXTENSIONS[name]
    result = builder()
    holder_of(result.properties, place).setdefault("extensions", {})[name] = value
    result.properties["extensionsUsed"] = [name]
    return result.write(path)


def state(model):
    """All that a GLTF2 consists of."""
    return json.dumps(pygltflib.gltf_asdict(model)), model.binary_blob(), sorted(vars(model))


@pytest.mark.parametrize("name", EXTENSIONS)
def test_every_extension_of_public_assets_survives(name, tmp_path):
    place, value = EXTENSIONS[name]
    path = with_extension(name, tmp_path / "in.glb")
    loaded = pygltflib.GLTF2().load(path)
    before = state(loaded)
    read = read_gltf2(loaded)
    assert holder_of(read.json, place)["extensions"] == {name: value}
    if name not in GEOMETRY:
        there, _, _ = to_gltf2(read_document(path))
        back = read_gltf2(there)
        assert back.json["meshes"] == read_document(path).json["meshes"]
        assert holder_of(back.json, place)["extensions"] == {name: value}
        compressed = gltf_ext.compress(loaded)["gltf"]
        plain = gltf_ext.decompress(compressed)["gltf"]
        for result in (compressed, plain):
            found = holder_of(read_gltf2(result).json, place).get("extensions", {})
            assert name in DROPPED or list(found[name]) == list(value)
    assert state(loaded) == before


def test_a_gltf2_has_the_same_json_and_bytes_as_a_file(model, tmp_path):
    """Also properties that pygltflib does not know, empty ones, and the order of all."""
    gltf_ext.compress(model, tmp_path / "out.glb", transport=True)
    report = gltf_ext.compress(to_gltf2(read_document(model))[0], transport=True)
    file, memory = read_document(tmp_path / "out.glb"), read_gltf2(report["gltf"])
    assert memory.to_json() == file.to_json()
    properties = glb_json(tmp_path / "out.glb")
    assert properties["unknown"] == [{}, [], 0, None]
    assert properties["nodes"][0]["weights"] == [0.5] and "extras" in properties["nodes"][0]
    assert list(properties["meshes"][0]["primitives"][0]["attributes"]) == ["_FIRST", "POSITION"]
    size = properties["buffers"][0]["byteLength"]
    assert (
        report["gltf"].binary_blob()
        == (tmp_path / "out.glb").read_bytes()[-size - -size % 4 :][:size]
    )
    assert report["output"] is None and report["output_bytes"] > size
    gltf_ext.transcode(tmp_path / "out.glb", tmp_path / "resident.glb")
    resident = gltf_ext.transcode(report["gltf"])["gltf"]
    assert read_gltf2(resident).to_json() == read_document(tmp_path / "resident.glb").to_json()


def test_every_public_function_takes_a_gltf2(model):
    original = pygltflib.GLTF2().load(model)
    report = gltf_ext.compress(original)
    compressed = report["gltf"]
    assert report["input"] == str(model) and isinstance(compressed, pygltflib.GLTF2)
    assert gltf_ext.verify(original, compressed)["ok"]
    assert gltf_ext.validate(compressed) == []
    assert gltf_ext.inspect(compressed)["totals"]["triangles"] == 98
    assert len(gltf_ext.load(compressed)[0].indices) == 98
    assert gltf_ext.decoders(compressed)[0].triangle_count == 98
    assert len(open_lod(compressed)) == 1 and not isinstance(open_lod(compressed)[0], LodPrimitive)
    packed = gltf_ext.transcode(compressed)
    assert packed["packed"] and gltf_ext.validate(packed["gltf"]) == []
    assert gltf_ext.decompress(packed["gltf"])["triangles"] == 98


def test_pygltflib_saves_what_is_returned(model, tmp_path):
    for number, path in enumerate((tmp_path / "a.glb", tmp_path / "a.gltf")):
        compressed = gltf_ext.compress(model, fallback=bool(number))["gltf"]
        compressed.save(path, asset=compressed.asset)
        assert gltf_ext.validate(path) == []
        assert gltf_ext.verify(model, path)["ok"]


def test_changes_of_a_gltf2_are_taken_over(model):
    changed = gltf_ext.compress(model)["gltf"]
    node = changed.nodes[0]
    node.children, node.name, node.translation = [], None, (1, 0, 0)
    node.other_properties["weights"] = [0.25]
    changed.extensionsUsed.append("X_y")
    changed.materials[0].alphaMode = "MASK"
    properties = read_gltf2(gltf_ext.decompress(changed)["gltf"]).json
    expected = {"mesh": 0, "weights": [0.25], "extras": {}, "x": {"y": [None, {}]}}
    assert properties["nodes"] == [{**expected, "translation": [1, 0, 0]}]
    assert properties["extensionsUsed"] == ["X_y"]
    assert properties["materials"][0]["alphaMode"] == "MASK"


def test_a_file_is_written_for_a_gltf2(model, tmp_path):
    original = pygltflib.GLTF2().load(model)
    report = gltf_ext.compress(original, tmp_path / "out.glb")
    assert "gltf" not in report and report["output"] == str(tmp_path / "out.glb")
    assert gltf_ext.verify(original, tmp_path / "out.glb")["ok"]


def test_uris_of_a_gltf2(tmp_path, monkeypatch):
    """data: uris, and paths beside the file that it was loaded from."""
    parts = builder()
    binary = bytes(parts.binary)
    parts.properties["buffers"] = [{"byteLength": len(binary), "uri": "data.bin"}]
    (tmp_path / "data.bin").write_bytes(binary)
    (tmp_path / "in.gltf").write_text(json.dumps(parts.properties))
    monkeypatch.chdir("/")
    loaded = pygltflib.GLTF2().load(tmp_path / "in.gltf")
    compressed = gltf_ext.compress(loaded)["gltf"]
    assert [buffer.uri for buffer in compressed.buffers] == [None]
    loaded.buffers[0].uri = (
        "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    )
    again = gltf_ext.compress(loaded)["gltf"]
    assert again.binary_blob() == compressed.binary_blob()


def test_what_a_gltf2_cannot_be(model):
    with pytest.raises(TypeError, match=r"a model is a path or a pygltflib\.GLTF2, not int"):
        gltf_ext.load(5)
    original = pygltflib.GLTF2().load(model)
    for input in (original, model):
        with pytest.raises(gltf_ext.MeshletError, match="max_memory is for files"):
            gltf_ext.compress(input, max_memory="2G")
    with pytest.raises(gltf_ext.MeshletError, match="max_memory is for files"):
        gltf_ext.verify(original, original, max_memory="2G")
    original.nodes[0].extras = {"array": np.zeros(3)}
    with pytest.raises(gltf_ext.MeshletError, match="holds values that JSON cannot"):
        gltf_ext.compress(original)
    original.nodes[0].extras = {}
    original.accessors[0].count = "many"
    with pytest.raises(gltf_ext.MeshletError, match=r"accessors\[0\]\.count is not an integer"):
        gltf_ext.compress(original)
    with pytest.raises(gltf_ext.MeshletError, match="neither a uri nor a binary chunk"):
        gltf_ext.compress(pygltflib.GLTF2.from_json(json.dumps(builder_without_bytes())))


def builder_without_bytes():
    parts = builder()
    return {**parts.properties, "buffers": [{"byteLength": len(parts.binary)}]}

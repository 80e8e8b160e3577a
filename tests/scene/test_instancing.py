"""EXT_mesh_gpu_instancing: what nodes become, what compress keeps, what hostile files get."""

from __future__ import annotations

import numpy as np
import pytest

import gltf_ext
from gltf_ext.document.nodes import local_matrix
from gltf_ext.errors import MeshletError
from gltf_ext.sources.importers import open_model
from gltf_scene import instancing
from gltf_scene.scene import read_scene
from tests.helpers.gltf_builder import Builder, glb_json, glb_parts, grid_mesh
from tests.helpers.instances import EXTENSION, OUTER, nodes_of, scattered, write_instanced
from tests.helpers.mitsuba_reference import require


def one_mesh() -> Builder:
    builder = Builder()
    positions, triangles = grid_mesh(5, 4)
    builder.mesh({"POSITION": positions}, triangles)
    builder.properties["extensionsUsed"] = [EXTENSION]
    return builder


def placed_of(builder: Builder, folder, attributes: dict[str, int], node: dict | None = None):
    """float64[n, 4, 4]: the places of the mesh. attributes: of the extension."""
    builder.properties["nodes"][0] |= {**(node or {}), **nodes_of(attributes)}
    (primitive,) = read_scene(open_model(builder.write(folder / "model.glb"))).primitives
    return primitive.matrices


# --- places ---


def test_places_are_the_node_times_each_instance(tmp_path):
    builder, places = one_mesh(), scattered(9)
    found = placed_of(builder, tmp_path, {n: builder.accessor(v) for n, v in places.items()}, OUTER)
    document = open_model(tmp_path / "model.glb")
    outer = local_matrix(document.nodes[0])
    for k, matrix in enumerate(found):
        translation, rotation, scale = (places[n][k].astype(np.float64) for n in places)
        point = np.array([0.3, -1.2, 0.7])
        x, w = rotation[:3], rotation[3]
        turned = scale * point
        turned = turned + 2 * np.cross(x, np.cross(x, turned) + w * turned)
        expected = outer @ [*(turned + translation), 1]
        np.testing.assert_allclose(matrix @ [*point, 1], expected, atol=1e-6)


@pytest.mark.parametrize("dtype", [np.int8, np.int16])
@pytest.mark.parametrize("flagged", [True, False])
def test_rotations_of_integers_are_fractions(tmp_path, dtype, flagged):
    builder = one_mesh()
    most = np.iinfo(dtype).max
    half = round(most * 0.5**0.5)
    rotation = np.array([[0, 0, 0, most], [0, half, 0, half]], dtype)
    more = {"normalized": True} if flagged else {}
    found = placed_of(builder, tmp_path, {"ROTATION": builder.accessor(rotation, **more)})
    np.testing.assert_allclose(found[0], np.eye(4), atol=1e-12)
    quarter = np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
    np.testing.assert_allclose(found[1], quarter, atol=1e-12)


def test_an_attribute_of_the_application_counts_instances(tmp_path):
    builder = one_mesh()
    number = builder.accessor(np.arange(3, dtype=np.uint16)[:, None])
    found = placed_of(builder, tmp_path, {"_ID": number}, {"translation": [1, 2, 3]})
    assert found.shape == (3, 4, 4) and (found[:, :3, 3] == [1, 2, 3]).all()


def test_the_extension_on_a_node_without_a_mesh_is_nothing(tmp_path):
    builder = one_mesh()
    moves = builder.accessor(np.zeros((4, 3), np.float32))
    builder.properties["nodes"] = [{"mesh": 0}, nodes_of({"TRANSLATION": moves})]
    builder.properties["scenes"] = [{"nodes": [0, 1]}]
    (primitive,) = read_scene(open_model(builder.write(tmp_path / "a.glb"))).primitives
    assert len(primitive.matrices) == 1


# --- compress ---


@pytest.mark.parametrize("options", [{}, {"lod": True}, {"transport": True}])
def test_compress_keeps_the_extension_and_its_numbers(tmp_path, options):
    places = scattered(11)
    compressed = write_instanced(tmp_path / "a.glb", places, **options)
    gltf_ext.decompress(compressed, tmp_path / "plain.glb")
    assert gltf_ext.verify(tmp_path / "raw_a.glb", compressed)["ok"]
    source = read_scene(open_model(tmp_path / "raw_a.glb")).primitives
    for file in (compressed, tmp_path / "plain.glb"):
        assert EXTENSION in glb_json(file)["extensionsUsed"]
        for ours, theirs in zip(read_scene(open_model(file)).primitives, source, strict=True):
            assert len(ours.matrices) == 11 and (ours.matrices == theirs.matrices).all()
    # The bytes, too: nothing quantises them.
    _, data = glb_parts(compressed)
    for values in places.values():
        assert values.tobytes() in bytes(data)


def test_the_mesh_is_compressed_as_without_instances(tmp_path):
    from gltf_ext.attributes.extension import read_compressed

    one = write_instanced(tmp_path / "one.glb", scattered(3))
    nodes = write_instanced(tmp_path / "nodes.glb", scattered(3), explicit=True)
    blobs = [bytes(read_compressed(open_model(file), 0, 0).blob) for file in (one, nodes)]
    assert blobs[0] == blobs[1]


# --- hostile files ---


def refused(builder: Builder, folder, attributes, message: str) -> None:
    """Both back ends and read_scene give one line."""
    from vk_backend.scene.scene import load_scene

    _, plugin = require("scalar_rgb")
    builder.properties["nodes"][0] |= {"extensions": {EXTENSION: {"attributes": attributes}}}
    raw, path = builder.write(folder / "raw.glb"), folder / "a.glb"
    with pytest.raises(MeshletError, match=message):
        read_scene(open_model(raw))
    gltf_ext.compress(raw, path)
    for load in (load_scene, plugin.scene_dict):
        with pytest.raises(MeshletError, match=message) as caught:
            load(path)
        assert "\n" not in str(caught.value)


def vectors(count: int, columns: int = 3, dtype=np.float32) -> np.ndarray:
    return np.ones((count, columns), dtype)


def test_different_numbers_of_instances(tmp_path):
    builder = one_mesh()
    attributes = {
        "TRANSLATION": builder.accessor(vectors(3)),
        "SCALE": builder.accessor(vectors(4)),
    }
    refused(builder, tmp_path, attributes, "TRANSLATION has 3, SCALE has 4; ")


def test_no_attributes(tmp_path):
    refused(one_mesh(), tmp_path, {}, "differ in number: none")


@pytest.mark.parametrize("index", [99, -1])
def test_no_such_accessor(tmp_path, index):
    builder = one_mesh()
    builder.properties["nodes"][0] |= {"extensions": {EXTENSION: {"attributes": {"SCALE": index}}}}
    with pytest.raises(MeshletError, match="the accessor of SCALE"):
        read_scene(open_model(builder.write(tmp_path / "a.glb")))


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("TRANSLATION", vectors(2, 4)),
        ("TRANSLATION", vectors(2, 3, np.int16)),
        ("SCALE", vectors(2, 3, np.uint8)),
        ("ROTATION", vectors(2, 3)),
        ("ROTATION", vectors(2, 4, np.uint16)),
    ],
)
def test_wrong_types(tmp_path, name, values):
    builder = one_mesh()
    message = rf"{name} of {EXTENSION} has \d components of type"
    refused(builder, tmp_path, {name: builder.accessor(values)}, message)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
@pytest.mark.parametrize("name", ["TRANSLATION", "ROTATION", "SCALE"])
def test_numbers_that_are_not_finite(tmp_path, name, value):
    if name == "ROTATION" and value == 1e30:
        return  # quaternions have any length
    builder = one_mesh()
    values = vectors(3, 4 if name == "ROTATION" else 3)
    values[1, 0] = value
    message = "transform is not finite, or larger than"
    refused(builder, tmp_path, {name: builder.accessor(values)}, message)


def test_many_nodes_with_one_accessor(tmp_path, monkeypatch):
    """A small file asks for billions of instances: refused before any are read."""
    builder = one_mesh()
    builder.properties["accessors"].append(
        {"componentType": 5126, "type": "VEC3", "count": 1 << 40}
    )
    number = len(builder.properties["accessors"]) - 1
    refused(builder, tmp_path, {"TRANSLATION": number}, "show more than 4,194,304 primitives")
    monkeypatch.setattr(instancing, "MAX_PLACES", 100)
    monkeypatch.setattr("gltf_scene.scene.MAX_PLACES", 100)
    builder = one_mesh()
    moves = builder.accessor(vectors(30))
    builder.properties["nodes"] = [{"mesh": 0, **nodes_of({"TRANSLATION": moves})}] * 4
    builder.properties["scenes"] = [{"nodes": [0, 1, 2, 3]}]
    with pytest.raises(MeshletError, match="show more than 100 primitives; split the scene"):
        read_scene(open_model(builder.write(tmp_path / "b.glb")))


def test_instances_without_bytes(tmp_path):
    builder = one_mesh()
    builder.properties["accessors"].append({"componentType": 5126, "type": "VEC3", "count": 5})
    number = len(builder.properties["accessors"]) - 1
    found = placed_of(builder, tmp_path, {"TRANSLATION": number})
    assert (found == np.eye(4)).all() and len(found) == 5


@pytest.mark.parametrize("value", [[], "x", {"attributes": []}, {"attributes": {"SCALE": "0"}}])
def test_json_that_is_not_valid(tmp_path, value):
    builder = one_mesh()
    builder.properties["nodes"][0] |= {"extensions": {EXTENSION: value}}
    with pytest.raises(MeshletError):
        read_scene(open_model(builder.write(tmp_path / "a.glb")))


def test_more_instances_than_mitsuba_takes(tmp_path, monkeypatch):
    _, plugin = require("scalar_rgb")
    monkeypatch.setattr("mitsuba_plugin.reader.MAX_INSTANCES", 10)
    path = write_instanced(tmp_path / "a.glb", scattered(6))
    with pytest.raises(MeshletError, match="12 instances are too many for Mitsuba, which takes 10"):
        plugin.scene_dict(path)


def test_more_meshlets_than_shaders_number(tmp_path, monkeypatch):
    from vk_backend.scene.scene import load_scene

    monkeypatch.setattr("vk_backend.scene.scene.MAX_MESHLETS", 10)
    path = write_instanced(tmp_path / "a.glb", scattered(6))
    with pytest.raises(MeshletError, match=r"its instances have \d+ meshlets, more than 10; split"):
        load_scene(path)


# --- both back ends ---


def test_back_ends_place_the_same_instances(tmp_path):
    from vk_backend.scene.scene import load_scene

    _, plugin = require("scalar_rgb")
    path = write_instanced(tmp_path / "a.glb", scattered(8))
    ours = load_scene(path).instances
    entries = plugin.scene_dict(path)
    shown = [e for e in entries.values() if isinstance(e, dict) and e.get("type") == "instance"]
    theirs = np.array([np.array(e["to_world"].matrix) for e in shown])
    assert len(ours) == 16 and len(theirs) == 8  # a shape group holds both primitives
    np.testing.assert_allclose(ours.matrix[:8], theirs, atol=1e-5)
    np.testing.assert_allclose(ours.matrix[8:], theirs, atol=1e-5)
    assert ours.mirrored.sum() == 4  # two of each primitive
    groups = [e for e in entries.values() if isinstance(e, dict) and e.get("type") == "shapegroup"]
    assert len(groups) == 1


def test_mitsuba_shows_what_explicit_nodes_show(tmp_path):
    mi, plugin = require("scalar_rgb")
    pictures = []
    for explicit in (False, True):
        path = write_instanced(tmp_path / f"{explicit}.glb", scattered(8), explicit=explicit)
        options = {"width": 48, "height": 36, "spp": 4}
        pictures.append(np.array(mi.render(plugin.load_scene(path, **options), seed=1)))
    assert pictures[0].std() > 0.03
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1e-3)


def test_instances_of_a_mesh_without_primitives_count(tmp_path, monkeypatch):
    monkeypatch.setattr("gltf_scene.scene.MAX_PLACES", 100)
    builder = one_mesh()
    moves = builder.accessor(np.zeros((101, 3), np.float32))
    builder.properties["meshes"][0]["primitives"] = []
    builder.properties["nodes"][0] |= nodes_of({"TRANSLATION": moves})
    with pytest.raises(MeshletError, match="show more than"):
        read_scene(open_model(builder.write(tmp_path / "model.glb")))

"""The scene on the host: its facts, its cameras, and the structures that the shaders read."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gltf_ext
from gltf_ext.errors import MeshletError
from tests.helpers.gltf_builder import Builder, everything, glb_bytes, glb_json
from tests.helpers.vulkan_scenes import zoo
from vk_backend.command import _turn
from vk_backend.scene import scene as scenes
from vk_backend.scene.camera import Camera
from vk_backend.scene.scene import load_scene


@pytest.fixture(scope="module")
def zoo_path(tmp_path_factory):
    return zoo(tmp_path_factory.mktemp("zoo") / "zoo.glb")


def world_positions(scene) -> np.ndarray:
    """float64[n, 3]: the vertices of all instances."""
    points = []
    for instance in scene.instances:
        positions = scene.primitives[instance.primitive].decoded().positions.astype(np.float64)
        points.append(positions @ instance.matrix[:3, :3].T + instance.matrix[:3, 3])
    return np.concatenate(points)


def test_packed_file_has_the_same_scene(zoo_path, tmp_path):
    gltf_ext.transcode(zoo_path, tmp_path / "packed.glb")
    packed, scene = load_scene(tmp_path / "packed.glb"), load_scene(zoo_path)
    for a, b in zip(packed.primitives, scene.primitives, strict=True):
        assert bytes(a.blob) == bytes(b.blob)
    assert np.array_equal(world_positions(packed), world_positions(scene))


def test_scene_is_the_file_s(zoo_path):
    scene = load_scene(zoo_path)
    assert (
        len(scene.primitives),
        len(scene.instances),
        len(scene.cameras),
        len(scene.textures),
    ) == (2, 4, 2, 1)
    assert [i.mirrored for i in scene.instances] == [False, True, False, False]
    assert [scene.materials[i.material].double_sided for i in scene.instances] == [
        False,
        False,
        False,
        True,
    ]
    assert (
        scene.attributes == scenes.HAS_NORMAL | scenes.HAS_TEXCOORD | scenes.HAS_COLOR
        and scene.vertex_floats == 12
    )
    assert scene.triangles == 3 * scene.primitives[0].triangles + scene.primitives[1].triangles
    assert scene.warnings == []
    shown = world_positions(scene)
    assert (scene.low <= shown.min(axis=0) + 1e-5).all() and (
        scene.high >= shown.max(axis=0) - 1e-5
    ).all()


def test_decoded_values_are_the_package_s(zoo_path):
    for primitive, loaded in zip(load_scene(zoo_path).primitives, gltf_ext.load(zoo_path)):
        decoded = primitive.decoded()
        assert (decoded.triangles == loaded.indices).all()
        np.testing.assert_allclose(decoded.positions, loaded.attributes["POSITION"], atol=1e-6)
        np.testing.assert_allclose(decoded.normals, loaded.attributes["NORMAL"], atol=1e-6)
        for values, name in ((decoded.texcoords, "TEXCOORD_0"), (decoded.colors, "COLOR_0")):
            assert (values is None) == (name not in loaded.attributes)
            if values is not None:
                np.testing.assert_allclose(values, loaded.attributes[name], atol=1e-6)


def test_integer_accessors_are_normalised(tmp_path):
    values, triangles, _ = everything()
    colors = (values["COLOR_0"] * 255).astype(np.uint8)
    places = (values["TEXCOORD_0"] * 0 + 0.5) * 65535
    builder = Builder()
    attributes = {"COLOR_0": colors, "TEXCOORD_0": places.astype(np.uint16)}
    builder.mesh(
        {"POSITION": values["POSITION"], **attributes}, triangles, normalized=tuple(attributes)
    )
    gltf_ext.compress(builder.write(tmp_path / "raw.glb"), tmp_path / "out.glb")
    decoded = load_scene(tmp_path / "out.glb").primitives[0].decoded()
    known = {tuple(row) for row in colors.tolist()}
    assert {tuple(row) for row in np.rint(decoded.colors * 255).astype(int).tolist()} == known
    np.testing.assert_allclose(decoded.texcoords, 0.5, atol=1e-4)


# --- cameras ---


@settings(max_examples=60)
@given(
    st.tuples(*[st.floats(-50, 50)] * 3),
    st.floats(0.1, 2.8),
    st.floats(0.01, 1.0),
    st.floats(2.0, 1e4) | st.just(float("inf")),
    st.booleans(),
    st.floats(0.05, 0.95),
)
def test_depth_and_distance_are_inverse(origin, yfov, near, far, orthographic, share):
    target = np.add(origin, (1.0, -2.0, 0.5))
    if orthographic:
        far = min(far, 1e3)
    camera = Camera.look_at(origin, target, yfov=None if orthographic else yfov, near=near, far=far)
    distance = near + share * (min(far, 100.0) - near)
    point = np.array([*(camera.to_world @ [0.0, 0.0, -distance, 1.0])[:3], 1.0])
    clip = camera.world_to_clip(160, 90) @ point
    np.testing.assert_allclose(clip[:2], 0, atol=1e-6 * abs(clip[3]))
    depth = clip[2] / clip[3]
    assert -1e-6 <= depth <= 1 + 1e-6
    np.testing.assert_allclose(camera.distance(depth), distance, rtol=1e-3)


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("shape", [(64, 48), (48, 64), (320, 20)])
def test_fit_fills_the_tighter_side(zoo_path, shape, orthographic):
    scene = load_scene(zoo_path)
    camera = Camera.fit(scene, *shape, orthographic=orthographic)
    points = world_positions(scene)
    clip = np.column_stack([points, np.ones(len(points))]) @ camera.world_to_clip(*shape).T
    ndc = clip[:, :3] / clip[:, 3:]
    low, high = ndc.min(axis=0), ndc.max(axis=0)
    assert max(high[:2]) == pytest.approx(0.85, abs=1e-3)
    np.testing.assert_allclose(low[:2], -high[:2], atol=1e-3)  # centred
    assert low[2] >= 0 and high[2] <= 1


@pytest.mark.parametrize("shape", [(64, 48), (48, 64)])
def test_a_turn_keeps_everything_in_view(zoo_path, shape):
    scene = load_scene(zoo_path)
    camera = Camera.fit_box(scene.low, scene.high, *shape)
    for turned in _turn(scene, camera, 5):
        points = world_positions(scene)
        clip = np.column_stack([points, np.ones(len(points))]) @ turned.world_to_clip(*shape).T
        ndc = clip[:, :3] / clip[:, 3:]
        assert (np.abs(ndc[:, :2]) <= 1).all() and (ndc[:, 2] >= 0).all() and (ndc[:, 2] <= 1).all()


# --- what is not valid ---


def changed(path, target, change):
    """A copy of a .glb with changed JSON."""
    data = path.read_bytes()
    properties = glb_json(path)
    change(properties)
    length = int.from_bytes(data[12:16], "little")
    target.write_bytes(glb_bytes(properties, data[28 + length :]))
    return target


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: p["nodes"][4].update(camera=9), "camera 9 does not exist"),
        (lambda p: p["cameras"][0].pop("perspective"), "neither perspective nor orthographic"),
        (lambda p: p["cameras"][0]["perspective"].update(yfov=0), "make no picture"),
        (lambda p: p["cameras"][1]["orthographic"].update(xmag=0.0, zfar=0.5), "make no picture"),
        (
            lambda p: p["scenes"][0].update(nodes=[4, 5]),
            "no node of its scene shows a compressed primitive",
        ),
        (lambda p: p["meshes"][0]["primitives"][0].update(material=5), "material 5 does not exist"),
        (lambda p: p["textures"][0].update(sampler=3), "sampler 3 does not exist"),
        (
            lambda p: p["nodes"][0].update(translation=[1e30, 0, 0]),
            "transform is not finite, or larger than",
        ),
    ],
)
def test_invalid_scenes_give_one_line(zoo_path, tmp_path, change, message):
    path = changed(zoo_path, tmp_path / "changed.glb", change)
    with pytest.raises(MeshletError, match=message) as error:
        load_scene(path)
    assert "\n" not in str(error.value) and str(path) in str(error.value)


def test_positions_beyond_binary32_give_one_line(zoo_path, tmp_path):
    """A finite step with infinite positions, of which no boxes or cameras can be made."""
    primitive = load_scene(zoo_path).primitives[0]
    data = zoo_path.read_bytes()
    at = data.index(primitive.blob) + 32 + 28 * primitive.attributes["POSITION"].index + 8
    path = tmp_path / "vast.glb"
    path.write_bytes(data[:at] + np.float32(3e38).tobytes() + data[at + 4 :])
    with pytest.raises(MeshletError, match=r"positions .* not finite, or larger than") as error:
        load_scene(path)
    assert "\n" not in str(error.value)


def test_unreadable_images_are_left_out_with_a_warning(zoo_path, tmp_path):
    def change(properties):
        blob = properties["meshes"][0]["primitives"][0]["extensions"]["EXT_meshlet_edgebreaker"][
            "bufferView"
        ]
        properties["images"][0]["bufferView"] = blob

    path = changed(zoo_path, tmp_path / "changed.glb", change)
    scene = load_scene(path)
    assert scene.textures == [] and scene.materials[1].base_texture == -1
    assert [w for w in scene.warnings if w.startswith("image 0 is left out")]


def test_uncompressed_files_are_refused(tmp_path):
    values, triangles, _ = everything()
    builder = Builder()
    builder.mesh({"POSITION": values["POSITION"]}, triangles)
    with pytest.raises(
        MeshletError, match="has no primitive with EXT_meshlet_edgebreaker; compress it first"
    ):
        load_scene(builder.write(tmp_path / "raw.glb"))


def test_texture_transform_and_place(zoo_path, tmp_path):
    transform = {"offset": [0.25, 0.5], "rotation": np.pi / 2, "scale": [2.0, 3.0]}

    def change(properties):
        info = properties["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"]
        info["extensions"] = {"KHR_texture_transform": json.loads(json.dumps(transform))}

    material = load_scene(changed(zoo_path, tmp_path / "changed.glb", change)).materials[1]
    a, b, c, d = material.texcoord_matrix
    place = np.array([[a, c], [b, d]]) @ [0.1, 0.2] + material.texcoord_offset
    # The extension's text: translation * rotation * scale, where the rotation turns u towards -v.
    np.testing.assert_allclose(place, [0.25 + 3 * 0.2, 0.5 - 2 * 0.1], atol=1e-9)

"""Both back ends read the same facts from a file: placement, values, cameras, materials."""

from __future__ import annotations

import base64
import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from tests.helpers.gltf_builder import Builder, grid_mesh
from tests.helpers.mitsuba_reference import require

QUANTIZED = {"extensionsUsed": ["KHR_mesh_quantization"]}
FLIP = np.diag([-1.0, 1.0, -1.0, 1.0])  # Mitsuba's cameras look along +z with x to the left


class Reading:
    """One file as both back ends read it."""

    def __init__(self, path: Path):
        from vk_backend.scene.scene import load_scene

        self.mi, self.plugin = require("scalar_rgb")
        self.path = path
        self.vulkan = load_scene(path)
        self.mitsuba = self.plugin.scene_dict(path, width=64, height=48)

    def parameters(self) -> dict:
        """Vertices of the only mesh as Mitsuba shows them, decoded."""
        (shape,) = self.plugin.load_scene(self.path, decoded=True).shapes()
        return {key: np.array(value) for key, value in dict(self.mi.traverse(shape)).items()}

    def shapes(self) -> list[dict]:
        entries = [v for v in self.mitsuba.values() if isinstance(v, dict)]
        return [v for v in entries if v.get("type") in ("meshlet_edgebreaker", "instance")]


@pytest.fixture
def read(tmp_path):
    def make(builder: Builder, **properties) -> Reading:
        builder.properties.update(properties)
        source = builder.write(tmp_path / "source.glb")
        gltf_ext.compress(source, tmp_path / "compressed.glb")
        return Reading(tmp_path / "compressed.glb")

    return make


def sheet(normalized=(), **attributes) -> Builder:
    """A bumpy sheet of 12 x 8 vertices; attributes: name -> an array, or a function of (V, 2)
    coordinates in [0, 1]."""
    builder = Builder()
    positions, triangles = grid_mesh(12, 8)
    place = positions[:, :2] / positions[:, :2].max(axis=0)
    given = {n: v(place) if callable(v) else v for n, v in attributes.items()}
    builder.mesh({"POSITION": positions, **given}, triangles, normalized=normalized)
    return builder


def spread(dtype, columns: int):
    """A function that fills the whole range of an integer type."""
    limits = np.iinfo(dtype)

    def fill(place: np.ndarray) -> np.ndarray:
        share = np.column_stack([place, place.mean(axis=1), 1 - place[:, 0]])[:, :columns]
        return np.rint(limits.min + share * (float(limits.max) - limits.min)).astype(dtype)

    return fill


def as_text(pixels: np.ndarray) -> str:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()


# --- values ---


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int8, np.int16])
@pytest.mark.parametrize("flagged", [True, False])
@pytest.mark.parametrize("quantized", [True, False])
def test_texture_coordinates(read, dtype, flagged, quantized):
    """Integers are fractions, unless KHR_mesh_quantization allows others and the file does not
    say `normalized`."""
    normalized = ("TEXCOORD_0",) if flagged else ()
    builder = sheet(normalized, TEXCOORD_0=spread(dtype, 2))
    reading = read(builder, **(QUANTIZED if quantized else {}))
    ours = reading.vulkan.primitives[0].decoded().texcoords
    theirs = reading.parameters()["vertex_texcoords"].reshape(-1, 2)
    np.testing.assert_array_equal(ours, theirs)
    limits = np.iinfo(dtype)
    fractions = flagged or not quantized
    low = max(limits.min / limits.max, -1.0) if fractions else float(limits.min)
    assert ours.min() == pytest.approx(low, abs=1e-7)
    assert ours.max() == pytest.approx(1.0 if fractions else float(limits.max), abs=1e-6)


@pytest.mark.parametrize("dtype", [np.int8, np.int16])
def test_normals_end_at_minus_one(read, dtype):
    """max(c / 127, -1): two integers stand for -1."""
    reading = read(sheet(("NORMAL",), NORMAL=spread(dtype, 3)), **QUANTIZED)
    ours = reading.vulkan.primitives[0].decoded().normals
    assert ours.min() == -1.0
    theirs = reading.parameters()["vertex_normals"].reshape(-1, 3)
    lengths = np.linalg.norm(ours, axis=1, keepdims=True)
    np.testing.assert_allclose(ours / lengths, theirs, atol=2e-6)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int8, np.int16])
@pytest.mark.parametrize("flagged", [True, False])
def test_positions(read, dtype, flagged):
    builder = Builder()
    places, triangles = grid_mesh(12, 8)
    scaled = places - places.min(axis=0)
    limits = np.iinfo(dtype)
    share = scaled / scaled.max(axis=0)
    positions = np.rint(limits.min + share * (float(limits.max) - limits.min)).astype(dtype)
    builder.mesh({"POSITION": positions}, triangles, normalized=("POSITION",) * flagged)
    reading = read(builder, **QUANTIZED)
    primitive = reading.vulkan.primitives[0]
    ours = primitive.decoded().positions
    np.testing.assert_array_equal(ours, reading.parameters()["vertex_positions"].reshape(-1, 3))
    assert ours.min() == pytest.approx(max(limits.min / limits.max, -1) if flagged else limits.min)
    np.testing.assert_allclose(
        [primitive.low, primitive.high], [ours.min(axis=0), ours.max(axis=0)], rtol=1e-6
    )


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("flagged", [True, False])
def test_colors_are_always_fractions(read, dtype, flagged):
    builder = sheet(("COLOR_0",) * flagged, COLOR_0=spread(dtype, 4))
    reading = read(builder)
    ours = reading.vulkan.primitives[0].decoded().colors
    parameters = reading.parameters()
    np.testing.assert_array_equal(ours[:, :3], parameters["vertex_color"].reshape(-1, 3))
    np.testing.assert_array_equal(ours[:, 3], parameters["vertex_alpha"])
    assert ours.max() == pytest.approx(1.0, abs=1e-6)


# --- placement ---


def test_instances(read):
    """Matrices, winding, and the scene that the file names as its default."""
    builder = sheet()
    positions, triangles = grid_mesh(9, 7)
    builder.mesh({"POSITION": positions}, triangles)
    nodes = [
        {"mesh": 0},
        {"children": [2, 3], "rotation": [0, 0.6, 0, 0.8], "translation": [3, 0, 0]},
        {"mesh": 1, "scale": [1, -2, 1]},
        {"mesh": 0, "matrix": [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 5, 6, 7, 1]},
    ]
    reading = read(builder, nodes=nodes, scenes=[{"nodes": [0]}, {"nodes": [1]}], scene=1)
    matrices = [i.matrix for i in reading.vulkan.instances]
    assert [i.mirrored for i in reading.vulkan.instances] == [True, True]
    shown = [np.array(shape["to_world"].matrix) for shape in reading.shapes()]
    assert len(matrices) == len(shown) == 2
    for ours, theirs in zip(matrices, shown):
        np.testing.assert_allclose(ours, theirs, atol=1e-6)


def test_transforms_that_are_not_finite_are_refused_by_both(tmp_path):
    builder = sheet()
    builder.properties["nodes"] = [{"mesh": 0, "translation": [1e30, 0, 0]}]
    refused_by_both(builder, tmp_path, "transform is not finite, or larger than")


def refused_by_both(builder: Builder, folder: Path, message: str) -> None:
    from vk_backend.scene.scene import load_scene

    _, plugin = require("scalar_rgb")
    gltf_ext.compress(builder.write(folder / "source.glb"), folder / "compressed.glb")
    for load in (load_scene, plugin.scene_dict):
        with pytest.raises(gltf_ext.MeshletError, match=message):
            load(folder / "compressed.glb")


def test_vast_positions_are_refused_by_both(read):
    """A finite step with infinite positions."""
    from vk_backend.scene.scene import load_scene

    reading = read(sheet())
    primitive = reading.vulkan.primitives[0]
    data = reading.path.read_bytes()
    step = data.index(primitive.blob) + 32 + 28 * primitive.attributes["POSITION"].index + 8
    reading.path.write_bytes(data[:step] + np.float32(3e38).tobytes() + data[step + 4 :])
    for load in (load_scene, reading.plugin.scene_dict):
        with pytest.raises(gltf_ext.MeshletError, match="not finite, or larger than"):
            load(reading.path)


# --- cameras ---


def test_cameras(read):
    nodes = [
        {"mesh": 0},
        {"camera": 0, "translation": [1, 2, 9], "scale": [3, 3, 3], "rotation": [0, 0.28, 0, 0.96]},
        {"camera": 1, "translation": [0, 0, 4]},
    ]
    cameras = [
        {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.5, "zfar": 40.0}},
        {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "znear": 1, "zfar": 9}},
    ]
    reading = read(sheet(), nodes=nodes, cameras=cameras, scenes=[{"nodes": [0, 1, 2]}])
    ours, sensor = reading.vulkan.cameras[0], reading.mitsuba["sensor"]
    same_view(ours, sensor)
    assert np.radians(sensor["fov"]) == pytest.approx(ours.yfov) and sensor["fov_axis"] == "y"
    ours = reading.vulkan.cameras[1]
    sensor = reading.plugin.scene_dict(reading.path, camera=1)["sensor"]
    same_view(ours, sensor, [ours.xmag, ours.xmag, 1, 1])


def same_view(camera, sensor: dict, size=(1, 1, 1, 1)) -> None:
    expected = camera.to_world @ FLIP @ np.diag(size)
    np.testing.assert_allclose(np.array(sensor["to_world"].matrix), expected, atol=1e-5)
    assert (sensor["near_clip"], sensor["far_clip"]) == pytest.approx((camera.near, camera.far))


@pytest.mark.parametrize("shape", [(64, 48), (48, 64)])
def test_default_view(read, shape):
    from vk_backend.scene.camera import Camera

    reading = read(sheet(), nodes=[{"mesh": 0, "translation": [4, 5, 6], "scale": [1, 3, 1]}])
    ours = Camera.fit(reading.vulkan, *shape)
    sensor = reading.plugin.scene_dict(reading.path, width=shape[0], height=shape[1])["sensor"]
    place = np.array(sensor["to_world"].matrix)
    np.testing.assert_allclose(place, ours.to_world @ FLIP, rtol=1e-4, atol=1e-5)
    smaller = shape if sensor["fov_axis"] == "smaller" else (1, 1)
    share = np.tan(np.radians(sensor["fov"]) / 2) * smaller[1] / min(smaller)
    assert share == pytest.approx(np.tan(ours.yfov / 2))


@pytest.mark.parametrize(
    "camera",
    [
        {"type": "perspective", "perspective": {"yfov": 0.0, "znear": 1.0}},
        {"type": "orthographic", "orthographic": {"xmag": 0, "ymag": 2, "znear": 1, "zfar": 9}},
    ],
)
def test_cameras_that_make_no_picture_are_refused_by_both(tmp_path, camera):
    builder = sheet()
    builder.properties.update(
        cameras=[camera], nodes=[{"mesh": 0}, {"camera": 0}], scenes=[{"nodes": [0, 1]}]
    )
    refused_by_both(builder, tmp_path, "make no picture")


# --- materials ---


def with_material(material: dict, **attributes) -> Builder:
    builder = sheet(**attributes)
    pixels = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    builder.properties.update(
        images=[{"uri": as_text(pixels)}], textures=[{"source": 0}], materials=[material]
    )
    builder.properties["meshes"][0]["primitives"][0]["material"] = 0
    return builder


def inner(bsdf: dict) -> dict:
    """The principled BSDF within adapters."""
    return inner(bsdf["bsdf"]) if "bsdf" in bsdf else bsdf


def test_factors(read):
    pbr = {"baseColorFactor": [0.2, 0.4, 0.6, 0.5], "metallicFactor": 0.25, "roughnessFactor": 0.75}
    material = {
        "pbrMetallicRoughness": pbr,
        "emissiveFactor": [0.5, 0.25, 1.0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3.0}},
    }
    reading = read(with_material(material))
    (shape,) = reading.shapes()
    ours, bsdf = reading.vulkan.materials[0], inner(shape["bsdf"])
    assert list(ours.base_color[:3]) == bsdf["base_color"]["value"] == [0.2, 0.4, 0.6]
    assert (ours.metallic, ours.roughness) == (0.25, 0.75)
    assert bsdf["roughness"] == 0.75
    assert bsdf["metallic"] == pytest.approx(0.25 * (1 - 0.75**4))  # see mirror_share
    assert list(ours.emissive[:3]) == shape["emitter"]["radiance"]["value"] == [1.5, 0.75, 3.0]


def test_texture_transform(read):
    transform = {"offset": [0.25, 0.5], "rotation": 0.3, "scale": [2.0, 3.0], "texCoord": 1}
    info = {"index": 0, "extensions": {"KHR_texture_transform": transform}}
    corners = lambda place: (place * 0.5).astype(np.float32)  # noqa: E731
    builder = with_material(
        {"pbrMetallicRoughness": {"baseColorTexture": info}},
        TEXCOORD_0=lambda place: place.astype(np.float32),
        TEXCOORD_1=corners,
    )
    reading = read(builder)
    (shape,) = reading.shapes()
    theirs = np.array(inner(shape["bsdf"])["base_color"]["to_uv"].matrix)
    ours = reading.vulkan.materials[0]
    a, b, c, d = ours.texcoord_matrix
    np.testing.assert_allclose(theirs[:2, :2], [[a, c], [b, d]], atol=1e-6)
    np.testing.assert_allclose(theirs[:2, 2], ours.texcoord_offset, atol=1e-6)
    np.testing.assert_array_equal(
        reading.vulkan.primitives[0].decoded().texcoords,
        reading.parameters()["vertex_texcoords"].reshape(-1, 2),
    )


def test_the_set_of_texture_coordinates(read):
    """Textures that show most decide: a normal map does not outvote the emissive texture."""
    builder = with_material(
        {
            "normalTexture": {"index": 0},
            "emissiveTexture": {"index": 0, "texCoord": 1},
            "emissiveFactor": [1, 1, 1],
        },
        TEXCOORD_0=lambda place: place.astype(np.float32),
        TEXCOORD_1=lambda place: (place * 0.5).astype(np.float32),
    )
    reading = read(builder)
    ours = reading.vulkan.primitives[0].decoded().texcoords
    theirs = reading.parameters()["vertex_texcoords"].reshape(-1, 2)
    np.testing.assert_array_equal(ours, theirs)
    assert ours.max() == pytest.approx(0.5, abs=1e-3)

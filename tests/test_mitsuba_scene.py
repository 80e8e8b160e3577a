"""Whole glTF scenes, and the command that renders them."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from gltf_builder import Builder, everything
from mitsuba_reference import VARIANTS, compressed, picture, require

import gltf_ext
from gltf_ext.attributes import MAX_STREAMS

WHITE_PIXEL = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010806000000"
    "1f15c4890000000d49444154789c63f8ffff3f000005fe02fea7359e710000000049454e44ae426082"
)


def scene_file(folder, change=lambda properties: None, compress=True):
    """Two nodes that show one sheet, one of them mirrored, below a rotated parent."""
    values, triangles, _ = everything(columns=30, rows=20)
    builder = Builder()
    builder.mesh({name: values[name] for name in ("POSITION", "NORMAL", "TEXCOORD_0")}, triangles)
    builder.properties["nodes"] = [
        {"children": [1, 2], "rotation": [0, 0.3826834, 0, 0.9238795]},
        {"mesh": 0, "translation": [0, 1, 0]},
        {"mesh": 0, "scale": [1, -1, 1]},
    ]
    change(builder.properties)
    path = builder.write(folder / "scene.glb")
    if not compress:
        return path
    gltf_ext.compress(path, folder / "scene.compressed.glb")
    return folder / "scene.compressed.glb"


@pytest.mark.parametrize("variant", VARIANTS)
def test01_load(variant, tmp_path):
    _, plugin = require(variant)
    s = plugin.load_scene(scene_file(tmp_path), width=32, height=24, spp=4)
    image = picture(s)
    assert image.shape == (24, 32, 3) and np.isfinite(image).all() and image.std() > 0
    assert plugin.statistics(s)["misses"] > 0


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test02_like_decoded(variant, tmp_path):
    """Compressed shapes and ordinary meshes give the same picture."""
    _, plugin = require(variant)
    path = scene_file(tmp_path)
    a, b = (picture(plugin.load_scene(path, width=64, height=48, decoded=decoded), spp=32) for decoded in (True, False))
    assert np.mean(a) == pytest.approx(np.mean(b), rel=1e-2)
    assert np.mean(np.abs(a - b).max(axis=2) < 0.05) > 0.98


@pytest.mark.parametrize("variant", VARIANTS[:1])
def test03_camera_and_lights(variant, tmp_path):
    mi, plugin = require(variant)

    def change(properties):
        properties["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.01}}]
        properties["extensionsUsed"] = ["KHR_lights_punctual"]
        properties["extensions"] = {
            "KHR_lights_punctual": {
                "lights": [
                    {"type": "directional", "intensity": 3.0},
                    {"type": "point"},
                    {"type": "spot", "spot": {"outerConeAngle": 0.5}},
                ]
            }
        }
        properties["nodes"] += [
            {"camera": 0, "translation": [1, 0.5, 4]},
            *({"translation": [1, 0.5, 3], "extensions": {"KHR_lights_punctual": {"light": i}}} for i in range(3)),
        ]
        properties["scenes"] = [{"nodes": [0, 3, 4, 5, 6]}]

    path = scene_file(tmp_path, change)
    s = plugin.load_scene(path, width=32, height=32)
    assert sorted(e.class_name() for e in s.emitters()) == ["DirectionalEmitter", "PointLight", "SpotLight"]
    matrix = np.array(s.sensors()[0].world_transform().matrix).reshape(4, 4)
    assert (
        np.allclose(matrix[:3, 3], [1, 0.5, 4])
        and np.allclose(matrix[:3, 2], [0, 0, -1])
        and np.allclose(matrix[:3, 1], [0, 1, 0])
    )
    assert picture(s, spp=4).mean() > 0
    with pytest.raises(gltf_ext.MeshletError, match="camera 3"):
        plugin.load_scene(path, camera=3)


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test04_materials(variant, tmp_path):
    mi, plugin = require(variant)

    def change(properties):
        properties["images"] = [
            {"uri": "data:image/png;base64," + __import__("base64").b64encode(WHITE_PIXEL).decode()}
        ]
        properties["textures"] = [{"source": 0}]
        texture = {"index": 0}
        properties["materials"] = [
            {
                "pbrMetallicRoughness": {
                    "baseColorTexture": texture,
                    "baseColorFactor": [1, 0.2, 0.1, 0.5],
                    "metallicRoughnessTexture": texture,
                    "metallicFactor": 0.5,
                },
                "normalTexture": texture,
                "doubleSided": True,
                "alphaMode": "BLEND",
                "emissiveFactor": [0, 0, 0.1],
                "emissiveTexture": texture,
            }
        ]
        properties["meshes"][0]["primitives"][0]["material"] = 0

    image = picture(plugin.load_scene(scene_file(tmp_path, change), width=32, height=24), spp=16)
    assert np.isfinite(image).all() and image.mean() > 0


def test05_cache_bytes(tmp_path):
    mi, plugin = require("scalar_rgb")
    s = plugin.load_scene(scene_file(tmp_path), width=32, height=24, cache_bytes=30_001)
    assert plugin.statistics(s)["limit_bytes"] == 30_001


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test09_uncompressed_primitives(variant, tmp_path):
    """A primitive that the encoder left as it was is an ordinary mesh."""
    mi, plugin = require(variant)
    values, triangles, _ = everything(columns=10, rows=8)
    builder = Builder()
    shown = {name: values[name] for name in ("POSITION", "NORMAL", "TEXCOORD_0")}
    builder.mesh(shown, triangles)
    too_many = {f"_A{i}": values["_ID"].astype(np.float32) for i in range(MAX_STREAMS)}
    builder.mesh({**shown, **too_many}, triangles)
    builder.properties["nodes"] = [{"mesh": 0}, {"mesh": 1, "translation": [0, 1, 0]}]
    builder.properties["scenes"] = [{"nodes": [0, 1]}]
    path, _ = compressed(builder.write(tmp_path / "mixed.glb"), tmp_path)
    s = plugin.load_scene(path, width=32, height=24)
    assert sorted(shape.is_mesh() for shape in s.shapes()) == [False, True]
    image = picture(s, spp=4)
    assert np.isfinite(image).all() and image.std() > 0


def test06_errors(tmp_path):
    _, plugin = require("scalar_rgb")
    with pytest.raises(OSError):
        plugin.load_scene(tmp_path / "nowhere.glb")
    with pytest.raises(gltf_ext.MeshletError, match="ancestor"):
        plugin.load_scene(scene_file(tmp_path, lambda p: p["nodes"][2].update(children=[0])))


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test07_render(suffix, tmp_path):
    require("scalar_rgb")
    path = scene_file(tmp_path)
    command = [
        sys.executable,
        "-m",
        "mitsuba_plugin",
        path,
        "-o",
        tmp_path / f"out{suffix}",
        "--width",
        "40",
        "--height",
        "30",
        "--spp",
        "4",
    ]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert (tmp_path / f"out{suffix}").stat().st_size > 0 and "40 x 30" in result.stdout
    assert not list(tmp_path.glob(".*part*"))


@pytest.mark.parametrize(
    "name",
    [
        "nasty/ShapeCollection_instances.glb",
        "nasty/CubeScaledInstances.glb",
        "nasty/AlphaBlendModeTest.glb",
        "nasty/Lantern.glb",
        "nasty/TextureTransformTest.glb",
        "nasty/VertexColorTest.glb",
        "nasty/WaterBottle_SpecGlossVsMetalRough.glb",
        "nasty/TestScene_7prims.glb",
        "nasty/three_meshes_one_no_material.glb",
    ],
)
def test08_files(name, model, tmp_path):
    _, plugin = require("llvm_ad_rgb")
    path, _ = compressed(model(name), tmp_path)
    image = picture(plugin.load_scene(path, width=48, height=36), spp=4)
    assert np.isfinite(image).all() and image.std() > 0

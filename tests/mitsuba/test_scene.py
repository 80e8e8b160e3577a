"""Whole glTF scenes, and the command that renders them."""

from __future__ import annotations

import base64
import io
import json
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from gltf_ext._codec import BLOB_MAX_STREAMS
from gltf_ext.sources.importers import open_model
from gltf_meshlet.cli import main
from tests.helpers.gltf_builder import Builder, everything
from tests.helpers.mitsuba_reference import VARIANTS, compressed, picture, require

MORE_VARIANTS = (
    "scalar_spectral_polarized",
    "llvm_ad_mono",
    "llvm_ad_mono_polarized",
    "llvm_ad_spectral_polarized",
)


def image_uri(*colors) -> str:
    """A data: uri of a PNG, one pixel high, with these 8-bit colours from left to right."""
    content = io.BytesIO()
    Image.fromarray(np.array([colors], np.uint8)).save(content, "png")
    return "data:image/png;base64," + base64.b64encode(content.getvalue()).decode()


def square_file(folder, material, image=None, attributes=None, reverse=False):
    """A compressed square with one material, whose textures show `image`.

    It faces the default camera, or with `reverse` turns its back to it.
    """
    builder = Builder()
    positions, triangles = (
        np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]),
        np.uint32([[0, 1, 2], [0, 2, 3]]),
    )
    triangles = triangles[:, ::-1] if reverse else triangles
    builder.mesh({"POSITION": positions, **(attributes or {})}, triangles)
    properties = builder.properties
    properties["materials"], properties["meshes"][0]["primitives"][0]["material"] = [material], 0
    if image:
        properties.update(
            images=[{"uri": image}],
            samplers=[{"magFilter": 9728}],
            textures=[{"source": 0, "sampler": 0}],
        )
    gltf_ext.compress(builder.write(folder / "square.glb"), folder / "square.compressed.glb")
    return folder / "square.compressed.glb"


def center_color(scene) -> np.ndarray:
    image = picture(scene, spp=64)
    height, width = image.shape[:2]
    return image[height // 2 - 2 : height // 2 + 2, width // 2 - 2 : width // 2 + 2].mean(
        axis=(0, 1)
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
    path = scene_file(tmp_path)
    for accel, sign in (("auto", "block_bytes"), ("cache", "misses")):
        s = plugin.load_scene(path, width=32, height=24, spp=4, accel=accel)
        image = picture(s)
        assert image.shape == (24, 32, 3) and np.isfinite(image).all() and image.std() > 0
        assert plugin.statistics(s)[sign] > 0


def test01a_auto_adds_up_the_shapes(tmp_path, monkeypatch):
    """Each fits the memory alone, but not all together."""
    _, plugin = require("scalar_rgb")
    path = scene_file(tmp_path)
    triangles = plugin.statistics(plugin.load_scene(path))["triangles"]
    asked = []
    monkeypatch.setattr("mitsuba_plugin.scene.fits_memory", lambda n: asked.append(n))
    loaded = plugin.load_scene(path)
    assert asked == [triangles]
    assert plugin.statistics(loaded)["limit_bytes"] > 0
    assert plugin.statistics(loaded)["block_bytes"] == 0


@pytest.mark.parametrize("variant", VARIANTS[:1])
def test01b_packed(variant, tmp_path):
    """A file packed for download gives the same picture."""
    _, plugin = require(variant)
    path = scene_file(tmp_path)
    gltf_ext.transcode(path, tmp_path / "packed.glb")
    a, b = (
        picture(plugin.load_scene(p, width=32, height=24, spp=4))
        for p in (path, tmp_path / "packed.glb")
    )
    assert np.allclose(a, b, atol=1e-4)


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test02_like_decoded(variant, tmp_path):
    """Compressed shapes and ordinary meshes give the same picture."""
    _, plugin = require(variant)
    path = scene_file(tmp_path)
    a, b = (
        picture(plugin.load_scene(path, width=64, height=48, decoded=decoded), spp=32)
        for decoded in (True, False)
    )
    assert np.mean(a) == pytest.approx(np.mean(b), rel=1e-2)
    assert np.mean(np.abs(a - b).max(axis=2) < 0.05) > 0.98


@pytest.mark.parametrize("variant", VARIANTS[:1])
def test03_camera_and_lights(variant, tmp_path):
    _mi, plugin = require(variant)

    def change(properties):
        properties["cameras"] = [
            {"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.01}}
        ]
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
            *(
                {"translation": [1, 0.5, 3], "extensions": {"KHR_lights_punctual": {"light": i}}}
                for i in range(3)
            ),
        ]
        properties["scenes"] = [{"nodes": [0, 3, 4, 5, 6]}]

    path = scene_file(tmp_path, change)
    s = plugin.load_scene(path, width=32, height=32)
    assert sorted(e.class_name() for e in s.emitters()) == [
        "DirectionalEmitter",
        "PointLight",
        "SpotLight",
    ]
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
    _mi, plugin = require(variant)

    def change(properties):
        properties["images"] = [{"uri": image_uri((255, 255, 255, 255))}]
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


def test04b_a_file_mended_after_an_error(tmp_path):
    """An exception that is still alive, as in a notebook, does not keep the old file alive."""
    mi, plugin = require("scalar_rgb")
    path = scene_file(tmp_path)
    good = path.read_bytes()
    path.write_bytes(good[:-200] + b"\xff" * 200)
    with pytest.raises(gltf_ext.MeshletError) as caught:
        plugin.load_scene(path, width=8, height=8)
    assert caught.tb is not None
    path.write_bytes(good)
    shape = mi.load_dict({"type": "meshlet_edgebreaker", "filename": str(path)})
    assert shape.primitive_count() > 0


def test05_cache_bytes(tmp_path):
    _mi, plugin = require("scalar_rgb")
    s = plugin.load_scene(scene_file(tmp_path), width=32, height=24, cache_bytes=30_001)
    assert plugin.statistics(s)["limit_bytes"] == 30_001


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test09_uncompressed_primitives(variant, tmp_path):
    """A primitive that the encoder left as it was is an ordinary mesh."""
    _mi, plugin = require(variant)
    values, triangles, _ = everything(columns=10, rows=8)
    builder = Builder()
    shown = {name: values[name] for name in ("POSITION", "NORMAL", "TEXCOORD_0")}
    builder.mesh(shown, triangles)
    too_many = {f"_A{i}": values["_ID"].astype(np.float32) for i in range(BLOB_MAX_STREAMS)}
    builder.mesh({**shown, **too_many}, triangles)
    builder.properties["nodes"] = [{"mesh": 0}, {"mesh": 1, "translation": [0, 1, 0]}]
    builder.properties["scenes"] = [{"nodes": [0, 1]}]
    path, _ = compressed(builder.write(tmp_path / "mixed.glb"), tmp_path)
    s = plugin.load_scene(path, width=32, height=24)
    assert sorted(shape.is_mesh() for shape in s.shapes()) == [False, True]
    image = picture(s, spp=4)
    assert np.isfinite(image).all() and image.std() > 0


def test20_ordinary_meshes_keep_all_attributes(tmp_path):
    mi, plugin = require("scalar_rgb")
    values, triangles, _ = everything(columns=10, rows=8)
    builder = Builder()
    builder.mesh({n: values[n] for n in ("POSITION", "NORMAL", "COLOR_0", "_HEAT")}, triangles)
    path, _ = compressed(builder.write(tmp_path / "heat.glb"), tmp_path)
    (mesh,) = plugin.load_scene(path, decoded=True).shapes()
    assert mesh.is_mesh()
    heat = np.array(mi.traverse(mesh)["vertex_heat"])
    assert np.ptp(heat) == pytest.approx(np.ptp(values["_HEAT"]), rel=1e-2)
    assert all(mesh.has_attribute(name) for name in ("vertex_color", "vertex_alpha"))


def test06_errors(tmp_path):
    _, plugin = require("scalar_rgb")
    with pytest.raises(OSError):
        plugin.load_scene(tmp_path / "nowhere.glb")
    with pytest.raises(gltf_ext.MeshletError, match="ancestor"):
        plugin.load_scene(scene_file(tmp_path, lambda p: p["nodes"][2].update(children=[0])))


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test10_second_texture_coordinates(variant, tmp_path):
    """The material's textures use TEXCOORD_1, which points at the green half of the image."""
    _, plugin = require(variant)
    texture = {"index": 0, "texCoord": 1}
    path = square_file(
        tmp_path,
        {"pbrMetallicRoughness": {"baseColorTexture": texture, "metallicFactor": 0}},
        image_uri((255, 0, 0), (0, 255, 0)),
        {
            "TEXCOORD_0": np.full((4, 2), 0.2, np.float32),
            "TEXCOORD_1": np.full((4, 2), 0.8, np.float32) + np.float32(np.eye(4)[:, :2] * 0.1),
        },
    )
    red, green, _ = center_color(plugin.load_scene(path, width=24, height=24))
    assert green > 3 * red


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test11_vertex_colors_times_base_color(variant, tmp_path):
    """Vertex colours under a texture and a factor look as their product does."""
    _, plugin = require(variant)
    corners = np.float32([[0, 0], [1, 0], [1, 1], [0, 1]])
    several = square_file(
        tmp_path,
        {
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 0},
                "baseColorFactor": [1, 1, 0.5, 1],
                "metallicFactor": 0,
            }
        },
        image_uri((255, 188, 255)),  # 188 of 255 in sRGB is half the light
        {"TEXCOORD_0": corners, "COLOR_0": np.full((4, 3), [0.4, 0.8, 0.8], np.float32)},
    )
    found = center_color(plugin.load_scene(several, width=24, height=24))
    product = square_file(
        tmp_path,
        {"pbrMetallicRoughness": {"baseColorFactor": [0.4, 0.4, 0.4, 1], "metallicFactor": 0}},
    )
    expected = center_color(plugin.load_scene(product, width=24, height=24))
    assert np.allclose(found, expected, rtol=0.03)


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test12_unlit(variant, tmp_path):
    """Its own colour, in the dark."""
    _, plugin = require(variant)
    material = {
        "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.5, 0.9, 1]},
        "extensions": {"KHR_materials_unlit": {}},
    }
    path = square_file(tmp_path, material)
    assert np.allclose(
        center_color(plugin.load_scene(path, width=24, height=24, default_light=0)),
        [0.2, 0.5, 0.9],
        rtol=1e-3,
    )


@pytest.mark.parametrize("variant", MORE_VARIANTS)
def test13_more_variants(variant, tmp_path):
    _, plugin = require(variant)
    path = scene_file(tmp_path)
    a, b = (
        picture(plugin.load_scene(path, width=32, height=24, decoded=decoded), spp=32)
        for decoded in (True, False)
    )
    assert np.isfinite(b).all() and b.std() > 0
    assert np.mean(a) == pytest.approx(np.mean(b), rel=2e-2)


@pytest.mark.parametrize("suffix", [".png", ".exr", ".jpg"])
def test07_render(suffix, tmp_path, capsys):
    require("scalar_rgb")
    output = tmp_path / f"out{suffix}"
    arguments = [
        "render",
        str(scene_file(tmp_path)),
        "-o",
        str(output),
        "--width",
        "40",
        "--height",
        "30",
        "--spp",
        "4",
    ]
    assert main(arguments) == 0
    assert output.stat().st_size > 0 and "40 x 30" in capsys.readouterr().out
    assert main([*arguments, "--json", "--cache", "5000"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["width"] == 40 and report["statistics"]["limit_bytes"] == 5000
    assert report["accel"] == "cache"
    assert not list(tmp_path.glob(".*part*"))


def test14_render_what_is_not_compressed(tmp_path, capsys):
    require("scalar_rgb")
    path, output = scene_file(tmp_path, compress=False), tmp_path / "out.png"
    assert (
        main(
            ["render", str(path), "-o", str(output), "--width", "8", "--height", "8", "--spp", "1"]
        )
        == 0
    )
    assert "is not compressed; rendering a copy" in capsys.readouterr().err and output.exists()


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["--camera", "1"], "camera 1 does not exist; there are none"),
        (["--variant", "scalar_double"], "there is no variant scalar_double; use one of "),
        (["--accel", "bvh"], "there is no accel bvh; use one of auto, triangles, cache"),
        (["--accel", "triangles", "--cache", "9"], "is not for --accel triangles"),
        (["--variant", "cuda_ad_rgb", "--cache", "9"], "--variant cuda_ad_rgb has no cache"),
        (["--variant", "cuda_ad_rgb", "--accel", "cache"], "--variant cuda_ad_rgb has no cache"),
        (["-o", "out.gif"], "out.gif: the output has an unknown format; use one of .png"),
    ],
)
def test15_render_errors(arguments, message, tmp_path, capsys):
    require("scalar_rgb")
    assert (
        main(["render", str(scene_file(tmp_path)), "-o", str(tmp_path / "out.png"), *arguments])
        == 2
    )
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("gltf-meshlet: ") and message in line
    assert not (tmp_path / "out.png").exists()


def test15b_without_a_gpu(tmp_path, capsys, monkeypatch):
    mi, _ = require("scalar_rgb")
    arguments = ["render", str(scene_file(tmp_path)), "-o", str(tmp_path / "out.png")]

    def refuse(_variant):
        raise ImportError(
            "the CUDA backend hasn't been initialized. Make sure to call it.\nMore lines"
        )

    monkeypatch.setattr(mi, "set_variant", refuse)
    assert main([*arguments, "--variant", "cuda_ad_rgb"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "cuda_ad_rgb needs an NVIDIA GPU and its driver: the CUDA backend" in line
    assert "Make sure" not in line and ".;" not in line
    assert "use --variant scalar_rgb or llvm_ad_rgb" in line


def test16_without_llvm(tmp_path, capsys, monkeypatch):
    require("scalar_rgb")
    from mitsuba_plugin import llvm

    monkeypatch.setattr(llvm, "choose", lambda: False)
    output = tmp_path / "out.png"
    assert (
        main(["render", str(scene_file(tmp_path)), "-o", str(output), "--variant", "llvm_ad_rgb"])
        == 2
    )
    assert (
        "llvm_ad_rgb needs LLVM 17 or newer; Debian: apt install libllvm19"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize(
    "name, version",
    [
        ("libLLVM-17.so.1", 17),
        ("libLLVM.so.19.1", 19),
        ("libLLVM-15.so", 15),
        ("libLLVMCore.so", 0),
        ("libLLVM.so", 0),
    ],
)
def test17_llvm_versions(name, version):
    require("scalar_rgb")
    from mitsuba_plugin import llvm

    assert llvm._version(name) == version


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


# --- first pictures ---


def edge_color(scene) -> np.ndarray:
    """The background at the middle of the left edge."""
    image = picture(scene, spp=16)
    height = image.shape[0]
    return image[height // 2 - 2 : height // 2 + 2, :2].mean(axis=(0, 1))


WHITE = {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0}}


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test18_white_model_before_quiet_background(variant, tmp_path):
    """The default light leaves a white model brighter than the background, and not burnt out."""
    _, plugin = require(variant)
    s = plugin.load_scene(square_file(tmp_path, WHITE), width=48, height=24)
    shown, background = center_color(s), edge_color(s)
    assert (shown > 2 * background).all() and (shown < 1).all()
    assert (background > 0.05).all() and (background < 0.35).all()
    assert np.ptp(background) < 0.1  # grey


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test19_backs_of_single_sided_surfaces(variant, tmp_path):
    """They look as double-sided ones do, unless the caller wants them black."""
    _, plugin = require(variant)

    def back(material, **options):
        path = square_file(tmp_path, material, reverse=True)
        return center_color(plugin.load_scene(path, width=24, height=24, **options))

    single, double = back(WHITE), back({**WHITE, "doubleSided": True})
    assert np.allclose(single, double, rtol=1e-2) and (single > 0.2).all()
    assert np.allclose(back(WHITE, two_sided=False), 0, atol=1e-4)


@pytest.mark.parametrize("variant", VARIANTS[:1])
@pytest.mark.parametrize("size", [(64, 48), (40, 60)])
def test20_default_view_fills_the_picture(variant, size, tmp_path):
    """85 % of the tighter side, in the middle; the background is the same everywhere."""
    _, plugin = require(variant)
    path = square_file(tmp_path, {**WHITE, "emissiveFactor": [1, 1, 1]})
    s = plugin.load_scene(path, width=size[0], height=size[1], default_light=0)
    lit = picture(s, spp=16).max(axis=2) > 0.5
    rows, columns = np.flatnonzero(lit.any(axis=1)), np.flatnonzero(lit.any(axis=0))
    shares = (np.ptp(columns) + 1) / size[0], (np.ptp(rows) + 1) / size[1]
    assert max(shares) == pytest.approx(0.85, abs=0.05)
    assert rows[0] + rows[-1] == pytest.approx(size[1] - 1, abs=2)
    assert columns[0] + columns[-1] == pytest.approx(size[0] - 1, abs=2)


@pytest.mark.parametrize("variant", VARIANTS[:1])
def test21_default_material_is_not_dark(variant, tmp_path):
    """glTF's default, a white metal of roughness 1, is nearly as bright as a white dielectric."""
    _, plugin = require(variant)
    metal, dielectric = (
        center_color(plugin.load_scene(square_file(tmp_path, material), width=24, height=24))
        for material in ({}, WHITE)
    )
    assert np.allclose(metal, dielectric, rtol=0.15)


def test22_threads_load_one_path_together(tmp_path):
    _, plugin = require("scalar_rgb")
    path = scene_file(tmp_path)
    with ThreadPoolExecutor(4) as threads:
        scenes = list(threads.map(lambda _: plugin.load_scene(path, width=8, height=8), range(12)))
    assert len({len(scene.shapes()) for scene in scenes}) == 1


def test23_a_document_is_kept_until_its_own_load_ends(tmp_path):
    _, plugin = require("scalar_rgb")
    path, reader = str(scene_file(tmp_path)), plugin.native.reader
    first, second = open_model(path), open_model(path)
    with ExitStack() as inner:
        with reader.holding(path, first):
            inner.enter_context(reader.holding(path, second))
            (tmp_path / "scene.compressed.glb").unlink()
        assert reader.read_blobs(path, None, None)
    with pytest.raises(OSError):
        reader.read_blobs(path, None, None)

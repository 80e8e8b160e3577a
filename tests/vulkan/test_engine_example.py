"""examples/engine: streams levels within a budget, decodes and draws them as the product does."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from tests.helpers.environment import ROOT, missing, need_package
from tests.helpers.gltf_builder import Builder, glb_bytes, glb_parts
from tests.helpers.native import folder_of
from tests.helpers.vulkan_scenes import UNLIT, ball, require_vulkan
from tools import build_shader_package
from tools.native_build import build_folder, find_cmake

WIDTH, HEIGHT = 320, 240
EVERYTHING = ("--error", "0", "--loads", "100", "--frames", "2")


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Built as an engine would: with the installed package and the unpacked shaders."""
    require_vulkan()
    headers = {"vulkan/vulkan.h": "libvulkan-dev", "nlohmann/json.hpp": "nlohmann-json3-dev"}
    lacking = [p for header, p in headers.items() if not Path("/usr/include", header).exists()]
    if lacking:
        missing(f"headers are not installed (Debian: apt install {' '.join(lacking)})")
    folder = tmp_path_factory.mktemp("engine")
    build_shader_package.main([str(folder)])
    (package,) = folder.glob("*.zip")
    zipfile.ZipFile(package).extractall(folder / "shaders")
    install = [find_cmake(), "--install", folder_of("MESHLET_NATIVE_TESTS"), "--prefix", folder]
    subprocess.run(install, check=True, stdout=subprocess.DEVNULL)
    options = (f"-DCMAKE_PREFIX_PATH={folder}", f"-DGLTF_MESHLET_SHADERS={folder / 'shaders'}")
    return build_folder(ROOT / "examples" / "engine", folder / "build", *options) / "engine"


def write_model(folder, name, attributes, triangles):
    """A compressed model, turned and stretched, before a camera that stands askew; unlit: black."""
    builder = Builder()
    builder.mesh(attributes, triangles, material=0)
    builder.properties.update(
        extensionsUsed=["KHR_materials_unlit"],
        materials=[
            {"extensions": UNLIT, "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}}
        ],
        cameras=[{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}],
        nodes=[
            {"translation": [0.5, 0, -1], "rotation": [0, 0.6, 0, 0.8], "children": [1, 2]},
            {"mesh": 0, "scale": [1, 1.3, 1], "rotation": [0.6, 0, 0, 0.8]},
            {"camera": 0, "translation": [0.3, 0.2, 4]},
        ],
        scenes=[{"nodes": [0]}],
    )
    source = builder.write(folder / f"{name}_in.glb")
    gltf_ext.compress(source, folder / f"{name}.glb", lod=True, page_bytes=8192)
    return folder / f"{name}.glb"


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    """A ball with bumps, with the normals of its surface and without."""
    need_package("meshoptimizer")
    positions, triangles = ball(160, 90)
    bumps = 1 + 0.03 * np.sin(9 * positions[:, :1]) * np.cos(8 * positions[:, 1:2])
    positions = np.float32(positions * bumps)
    corners = positions[triangles].astype(float)
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros(positions.shape)
    np.add.at(normals, triangles, faces[:, None])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    folder = tmp_path_factory.mktemp("models")
    plain = {"POSITION": positions}
    return (
        write_model(folder, "normals", {**plain, "NORMAL": np.float32(normals)}, triangles),
        write_model(folder, "plain", plain, triangles),
    )


def run(program, model, picture, *options):
    """What it prints. The validation layer must be silent."""
    size = ("--width", str(WIDTH), "--height", str(HEIGHT))
    command = [program, model, picture, *size, "--validate", *options]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    return result.stdout


def shades(picture) -> np.ndarray:
    """int[height, width]; 0 where nothing is drawn."""
    return np.asarray(Image.open(picture).convert("L")).astype(int)


def frames(printed):
    pattern = r"^frame \d+: (\d+) meshlets, error (\S+) pixels, (\d+) pages to load$"
    return [
        (int(m), float(e), int(p)) for m, e, p in re.findall(pattern, printed, flags=re.MULTILINE)
    ]


def test_picture_is_the_products(program, models, tmp_path):
    """All triangles, on the pixels that the product's renderer covers."""
    printed = run(program, models[0], tmp_path / "a.ppm", *EVERYTHING)
    assert frames(printed)[-1][1:] == (0, 0)
    command = [sys.executable, "-m", "gltf_meshlet", "render", models[0], "-o", tmp_path / "b.png"]
    options = ["--backend", "vulkan", "--width", str(WIDTH), "--height", str(HEIGHT)]
    subprocess.run([*command, *options], check=True, capture_output=True)
    ours, product = shades(tmp_path / "a.ppm") > 0, shades(tmp_path / "b.png") < 20
    assert 0.2 < ours.mean() < 0.8
    assert (ours != product).mean() < 1e-3


def test_normals_are_those_of_the_surface(program, models, tmp_path):
    """Shaded by the decoded normals, and by the triangles of the model without normals."""
    for model in models:
        run(program, model, tmp_path / f"{model.stem}.ppm", *EVERYTHING)
    ours, surface = shades(tmp_path / "normals.ppm"), shades(tmp_path / "plain.ppm")
    assert np.abs(ours - surface).mean() < 1.5
    assert ours.max() > 220


def test_streams_within_a_budget(program, models, tmp_path):
    """Levels of up to a pixel, page by page; then what four pages hold, without holes."""
    pictures = [tmp_path / name for name in ("all.ppm", "level.ppm", "budget.ppm")]
    printed = [
        run(program, models[0], picture, *options)
        for picture, options in zip(
            pictures, (EVERYTHING, ("--error", "1"), ("--error", "1", "--budget", "32768"))
        )
    ]
    whole, level, budget = (frames(text)[-1] for text in printed)
    assert max(pages for _, _, pages in frames(printed[1])) <= 4  # in a frame
    assert level[0] < whole[0] / 2 and 0 < level[1] <= 1 and level[2] == 0
    assert " 4 slots of " in printed[2]
    assert budget[0] < level[0] and budget[1] > 1 and budget[2] == 0
    full, *others = (shades(picture) > 0 for picture in pictures)
    for other in others:
        assert (full != other).mean() < 0.01


def hostile(model, path, change):
    """A copy of a model whose JSON is changed."""
    properties, binary = glb_parts(model)
    change(properties)
    path.write_bytes(glb_bytes(properties, binary))
    return path


def negative_normal(properties):
    """A stream that the shader would look for outside of its arrays."""
    (primitive,) = properties["meshes"][0]["primitives"]
    primitive["extensions"]["EXT_meshlet_edgebreaker"]["attributes"]["NORMAL"] = -5


def many_ways(properties):
    """From the first of 40 nodes to the last one: 2^39."""
    nodes = properties["nodes"]
    nodes += [{"children": [len(nodes) + i + 1] * 2} for i in range(40)] + [{}]
    properties["scenes"][0]["nodes"].insert(0, len(nodes) - 41)


def test_refuses_what_it_cannot_show(program, models, tmp_path):
    """One line."""
    cut = tmp_path / "cut.glb"
    cut.write_bytes(models[0].read_bytes()[:-1000])
    plain = tmp_path / "plain.glb"
    gltf_ext.compress(models[0].with_name("normals_in.glb"), plain)
    problems = {
        hostile(
            models[0], tmp_path / "normal.glb", negative_normal
        ): "NORMAL is no stream that the shader has room for",
        hostile(models[0], tmp_path / "dag.glb", many_ways): "the nodes are no trees, or too deep",
        cut: "a buffer view lies outside of the file",
        plain: "no primitive has levels of detail: compress it with --lod",
        tmp_path / "none.glb": "the file cannot be read",
    }
    for path, problem in problems.items():
        command = [program, path, tmp_path / "a.ppm"]
        result = subprocess.run(command, capture_output=True, text=True)
        assert (result.returncode, result.stderr) == (1, f"engine: {problem}\n")
    assert not (tmp_path / "a.ppm").exists()


def test_says_what_it_cannot_do(program, models, tmp_path):
    """Of small pictures, too, whose bytes wait until the file is closed; no layer is installed."""
    environment = {**os.environ, "VK_LAYER_PATH": str(tmp_path)}
    small = ("--width", "8", "--height", "8", "--frames", "1")
    for picture, options, problem in (
        ("a.ppm", ("--width", "wide"), "an option's value is no number from 0 on, or too large"),
        ("a.ppm", ("--cache", "none/a"), "the file for compiled shaders cannot be written"),
        ("/dev/full", small, "the picture cannot be written"),
        ("a.ppm", ("--validate",), "the validation layer is not installed"),
    ):
        command = [program, models[1], picture, *options]
        result = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert (result.returncode, result.stderr) == (1, f"engine: {problem}\n")
    assert not (tmp_path / "a.ppm").exists()

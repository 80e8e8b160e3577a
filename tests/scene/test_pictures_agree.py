"""Both back ends show the same picture: view, exposure and background."""

from __future__ import annotations

import re

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from gltf_meshlet.cli import main
from gltf_scene import default_light
from tests.helpers.environment import ROOT
from tests.helpers.gltf_builder import Builder
from tests.helpers.mitsuba_reference import require
from tests.helpers.vulkan_scenes import ball, require_vulkan

SIZE = (96, 72)
ROUNDING = 12  # of 255: noise, and light between the parts of the model, which rasters lack


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """uint8[height, width, 3] by back end: a matt grey ellipsoid."""
    require_vulkan()
    require("scalar_rgb")
    folder = tmp_path_factory.mktemp("pictures")
    builder = Builder()
    positions, triangles = ball(32, 20)
    stretched = positions * np.float32([1.6, 0.6, 0.8])
    normals = positions / np.float32([1.6, 0.6, 0.8])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    builder.mesh({"POSITION": stretched, "NORMAL": normals}, triangles, material=0)
    matt = {"baseColorFactor": [0.6, 0.6, 0.6, 1], "metallicFactor": 0, "roughnessFactor": 1}
    builder.properties["materials"] = [{"pbrMetallicRoughness": matt}]
    gltf_ext.compress(builder.write(folder / "raw.glb"), folder / "ball.glb")
    found = {}
    for back_end, options in (("vulkan", []), ("mitsuba", ["--spp", "64"])):
        output = folder / f"{back_end}.png"
        size = ["--width", str(SIZE[0]), "--height", str(SIZE[1])]
        command = ["render", str(folder / "ball.glb"), "-o", str(output), "--backend", back_end]
        assert main([*command, *size, *options]) == 0
        found[back_end] = np.array(Image.open(output).convert("RGB")).astype(int)
    return found


def test_view_exposure_and_background_agree(pictures):
    difference = np.abs(pictures["vulkan"] - pictures["mitsuba"]).max(axis=2)
    # Mitsuba filters silhouettes, Vulkan does not.
    assert np.mean(difference <= ROUNDING) > 0.93
    edges = np.concatenate([difference[0], difference[-1], difference[:, 0], difference[:, -1]])
    assert edges.max() <= 3
    middle = (slice(30, 42), slice(42, 54))
    means = [pictures[name][middle].mean() for name in pictures]
    assert means[0] == pytest.approx(means[1], abs=ROUNDING)


def test_the_model_fills_the_picture(pictures):
    for picture in pictures.values():
        shown = picture.max(axis=2) > picture[:, :1].max(axis=2) + 20
        columns = np.flatnonzero(shown.any(axis=0))
        assert (np.ptp(columns) + 1) / SIZE[0] == pytest.approx(0.85, abs=0.06)


def test_the_shaders_have_the_same_light():
    text = (ROOT / "shaders" / "scene" / "default_light.glsl").read_text()
    for name in ("SKY", "GROUND", "KEY"):
        (values,) = re.findall(rf"const vec3 {name} = vec3\((.*)\);", text)
        assert tuple(map(float, values.split(","))) == getattr(default_light, name)

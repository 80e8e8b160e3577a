"""Devices: choosing one, and one clear line where something is missing."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

import gltf_ext
from gltf_ext.errors import MeshletError
from tests.helpers.gltf_builder import Builder
from tests.helpers.vulkan_scenes import ball, require_vulkan, zoo


@pytest.fixture(autouse=True)
def vulkan(request):
    require_vulkan()


def test_choice_by_number_and_name():
    from vk_backend.device import Device

    with Device() as first:
        name = first.name
    with Device(0) as numbered, Device(name[:4].upper()) as named:
        assert numbered.name and named.name


@pytest.mark.parametrize("select", ["no such device", 99, "99"])
def test_no_such_device(select):
    from vk_backend.device import Device

    with pytest.raises(MeshletError, match=r"^there is no device .*; there are: 0: "):
        Device(select)


@pytest.mark.parametrize("failing", ["_choose", "_queue_families", "_create_device", "_limits"])
def test_a_device_that_cannot_be_opened_leaves_no_instance(monkeypatch, failing):
    from vk_backend import vk
    from vk_backend.device import Device

    live = []
    create, destroy = vk.vkCreateInstance, vk.vkDestroyInstance

    def created(*arguments):
        live.append(create(*arguments))
        return live[-1]

    def destroyed(instance, callbacks):
        live.remove(instance)
        destroy(instance, callbacks)

    def fail(*_):
        raise MeshletError("nothing here")

    monkeypatch.setattr(vk, "vkCreateInstance", created, raising=False)
    monkeypatch.setattr(vk, "vkDestroyInstance", destroyed, raising=False)
    monkeypatch.setattr(Device, failing, fail)
    with pytest.raises(MeshletError, match="nothing here"):
        Device(validation=True)
    assert live == []


def test_missing_extension_is_named(tmp_path):
    from vk_backend.renderer import Renderer
    from vk_backend.scene import load_scene

    scene = load_scene(zoo(tmp_path / "zoo.glb"))
    with Renderer() as renderer:
        assert renderer.default_path == "visibility"
        renderer.device.capabilities -= {"atomics64"}
        assert renderer.default_path == "stream"
        with pytest.raises(
            MeshletError, match="lacks the feature atomics64, which path visibility"
        ):
            renderer.render(scene, scene.cameras[0], "visibility", 16, 16)
        renderer.device.capabilities -= {"mesh"}
        renderer.device.extensions -= {"VK_EXT_mesh_shader"}
        assert renderer.default_path == "vertex"
        with pytest.raises(
            MeshletError,
            match=r"lacks VK_EXT_mesh_shader, which path mesh needs; choose another",
        ):
            renderer.render(scene, scene.cameras[0], "mesh", 16, 16)
        renderer.device.capabilities -= {"geometry"}
        with pytest.raises(
            MeshletError, match=r"lacks the feature geometry, which path geometry needs"
        ):
            renderer.render(scene, scene.cameras[0], "geometry", 16, 16)


def test_impossible_pictures(tmp_path):
    from vk_backend.renderer import Renderer
    from vk_backend.scene import load_scene

    scene = load_scene(zoo(tmp_path / "zoo.glb"))
    with Renderer() as renderer:
        with pytest.raises(MeshletError, match=r"^0 x 16 pixels are not possible"):
            renderer.render(scene, scene.cameras[0], "vertex", 0, 16)
        with pytest.raises(MeshletError, match=r"^there is no path tape; there are visibility, "):
            renderer.render(scene, scene.cameras[0], "tape", 16, 16)


def _command(*arguments, **environment) -> subprocess.CompletedProcess:
    command = [
        sys.executable,
        "-m",
        "gltf_meshlet",
        "render",
        "--backend",
        "vulkan",
        *map(str, arguments),
    ]
    return subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, **environment}
    )


def test_command_without_a_driver_writes_nothing(tmp_path):
    path, output = zoo(tmp_path / "zoo.glb"), tmp_path / "out.png"
    result = _command(
        path, "-o", output, VK_DRIVER_FILES="/nonexistent", VK_ICD_FILENAMES="/nonexistent"
    )
    assert result.returncode == 2 and result.stdout == ""
    assert (
        result.stderr.count("\n") == 1 and "there is no Vulkan driver; install one" in result.stderr
    )
    assert not output.exists()


def test_command_draws_and_reports(tmp_path):
    import json

    from PIL import Image

    path, output = zoo(tmp_path / "zoo.glb"), tmp_path / "out.png"
    arguments = [
        path,
        "-o",
        output,
        "--width",
        64,
        "--height",
        48,
        "--path",
        "vertex",
        "--validate",
    ]
    result = _command(*arguments)
    assert (
        result.returncode == 0
        and result.stderr == ""
        and "64 x 48, path vertex on" in result.stdout
    )
    picture = np.asarray(Image.open(output))
    assert picture.shape == (48, 64, 4)
    assert (picture[..., 3] == 255).all() and picture[..., :3].std() > 20  # before the sky
    report = json.loads(_command(*arguments, "--json", "--camera", 1).stdout)
    assert (
        report["path"] == "vertex" and report["resident_bytes"] > 0 and report["milliseconds"] > 0
    )
    turned = _command(
        *arguments[:1],
        "-o",
        tmp_path / "turn.gif",
        "--frames",
        3,
        "--width",
        32,
        "--height",
        24,
        "--path",
        "vertex",
    )
    assert turned.returncode == 0 and Image.open(tmp_path / "turn.gif").n_frames == 3
    wrong = _command(*arguments, "--camera", 7)
    assert wrong.returncode == 2 and "camera 7 does not exist; there are 2" in wrong.stderr


@pytest.mark.parametrize("path", ["mesh", "mesh-paper"])
def test_command_reports_what_task_shaders_did(tmp_path, path):
    import json

    size = ("--width", 64, "--height", 48, "--frames", 2)
    options = ("-o", tmp_path / "out.png", "--path", path, "--json", "--validate", *size)
    result = _command(zoo(tmp_path / "zoo.glb"), *options)
    assert result.returncode == 0 and result.stderr == ""
    report = json.loads(result.stdout)
    assert report["path"] == path and len(report["tasks"]) == 2
    for tasks in report["tasks"]:
        assert 0 < tasks["launched"] <= tasks["tested"] - tasks["hidden"]
    assert set(report["steps"]) == {"draw", "occlusion"}


def test_numbered_pictures_are_of_different_sides(tmp_path):
    from PIL import Image

    positions, triangles = ball(12, 8)
    builder = Builder()
    builder.mesh({"POSITION": (positions * [1, 1, 3] + [1, 0, 0]).astype(np.float32)}, triangles)
    builder.mesh({"POSITION": positions}, triangles)
    raw, path = builder.write(tmp_path / "raw.glb"), tmp_path / "ball.glb"
    gltf_ext.compress(raw, path)
    result = _command(
        path,
        "-o",
        tmp_path / "side.png",
        "--frames",
        2,
        "--width",
        32,
        "--height",
        24,
        "--path",
        "vertex",
    )
    assert result.returncode == 0, result.stderr
    first, second = (np.asarray(Image.open(tmp_path / f"side_{n}.png")) for n in (1, 2))
    assert (first != second).any()

"""Devices: choosing one, and one clear line where something is missing."""

from __future__ import annotations

import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import gltf_ext
from gltf_ext.errors import MeshletError
from gltf_meshlet import cli
from tests.helpers.gltf_builder import Builder
from tests.helpers.vulkan_scenes import ball, require_vulkan, zoo


@pytest.fixture(autouse=True)
def vulkan(request):
    require_vulkan()


def test_choice_by_number_and_name():
    from vk_backend.gpu.device import Device

    with Device() as first:
        name = first.name
    with Device(0) as numbered, Device(name[:4].upper()) as named:
        assert numbered.name and named.name


@pytest.mark.parametrize(("select", "index"), [("0", 0), ("2", 2), ("4070", 1), ("rtx 40", 1)])
def test_a_number_may_be_part_of_a_name(select, index):
    from vk_backend.gpu.physical import index_of

    assert index_of(select, ["llvmpipe", "RTX 4070", "RTX 4090"]) == index


@pytest.mark.parametrize("select", ["", " ", "no such device", 99, "99", "²", "9" * 5000])
def test_no_such_device(select):
    from vk_backend.gpu.device import Device

    with pytest.raises(MeshletError, match=r"^there is no device .*; there are: 0: "):
        Device(select)


@pytest.fixture
def live(monkeypatch):
    """The handles of instances, devices, buffers and memory that were created and not destroyed."""
    from vk_backend.gpu import vk

    handles = []

    def watch(create, destroy):
        creating, destroying = getattr(vk, create), getattr(vk, destroy)

        def created(*arguments):
            handles.append(creating(*arguments))
            return handles[-1]

        def destroyed(*arguments):
            handles.remove(arguments[-2])
            destroying(*arguments)

        monkeypatch.setattr(vk, create, created, raising=False)
        monkeypatch.setattr(vk, destroy, destroyed, raising=False)

    for kind in ("Instance", "Device", "Buffer", "CommandPool"):
        watch(f"vkCreate{kind}", f"vkDestroy{kind}")
    watch("vkAllocateMemory", "vkFreeMemory")
    return handles


OPENING = ("choose", "Device._create_device", "Device._queue", "read_limits")


@pytest.mark.parametrize("failing", OPENING)
def test_a_device_that_cannot_be_opened_leaves_nothing(monkeypatch, live, failing):
    from vk_backend.gpu.device import Device

    def fail(*_, **__):
        raise MeshletError("nothing here")

    monkeypatch.setattr(f"vk_backend.gpu.device.{failing}", fail)
    with pytest.raises(MeshletError, match="nothing here"):
        Device(validation=True)
    assert live == []


# --- choosing ---

GPU, SOFTWARE = 2, 4  # VkPhysicalDeviceType


def offer(monkeypatch, *devices: tuple[int, tuple[int, int], bool]) -> None:
    """Has the driver offer devices: (type, version of Vulkan, whether it has all features).

    They are named 0, 1, ... and are the real first one otherwise.
    """
    from vk_backend.gpu import vk

    enumerate_, properties_of = vk.vkEnumeratePhysicalDevices, vk.vkGetPhysicalDeviceProperties
    features_of = vk.vkGetPhysicalDeviceFeatures2
    handles = []  # of each device another object

    def listed(instance):
        real = enumerate_(instance)[0]
        handles[:] = [vk.ffi.cast("VkPhysicalDevice", real) for _ in devices]
        return list(handles)

    def number_of(handle):
        return next(i for i, own in enumerate(handles) if own is handle)

    def properties(handle):
        number = number_of(handle)
        kind, (major, minor), _ = devices[number]
        return SimpleNamespace(
            deviceName=f"device {number}",
            deviceType=kind,
            apiVersion=vk.VK_MAKE_VERSION(major, minor, 0),
            driverVersion=1,
            vendorID=0,
            limits=properties_of(handle).limits,
        )

    def features(handle, chain):
        if devices[number_of(handle)][2]:  # otherwise all members stay 0
            features_of(handle, chain)

    for function in ("EnumeratePhysicalDevices", "GetPhysicalDeviceProperties"):
        new = listed if function.startswith("Enumerate") else properties
        monkeypatch.setattr(vk, f"vk{function}", new, raising=False)
    monkeypatch.setattr(vk, "vkGetPhysicalDeviceFeatures2", features, raising=False)


OLD, BARE, FINE = ((1, 2), True), ((1, 3), False), ((1, 3), True)


@pytest.mark.parametrize(
    ("devices", "name"),
    [
        ([(GPU, *OLD), (GPU, *FINE)], "device 1"),
        ([(GPU, *BARE), (GPU, *FINE)], "device 1"),
        ([(GPU, *FINE), (GPU, *FINE)], "device 0"),
        ([(SOFTWARE, *FINE), (GPU, *OLD), (GPU, *FINE)], "device 2"),
        ([(SOFTWARE, *FINE), (GPU, *OLD)], "device 0"),
    ],
)
def test_default_is_the_first_device_that_works(monkeypatch, devices, name):
    from vk_backend.gpu.device import Device

    offer(monkeypatch, *devices)
    with Device() as device:
        assert device.name == name


@pytest.mark.parametrize(
    ("devices", "select", "message"),
    [
        ([(SOFTWARE, *BARE), (GPU, *OLD)], None, "^device 1 has no Vulkan 1.3; update the driver"),
        ([(GPU, *BARE), (GPU, *FINE)], 0, "^device 0 lacks bufferDeviceAddress, scalarBlock"),
        ([(GPU, *FINE), (GPU, *OLD)], "ice 1", "^device 1 has no Vulkan 1.3; update the driver"),
    ],
)
def test_no_device_that_works(monkeypatch, live, devices, select, message):
    from vk_backend.gpu.device import Device

    offer(monkeypatch, *devices)
    with pytest.raises(MeshletError, match=message):
        Device(select)
    assert live == []


# --- validation ---


def test_the_validation_layer_watches_synchronisation():
    """Two copies to the same bytes without a barrier between them."""
    from vk_backend.gpu import vk
    from vk_backend.gpu.device import Device
    from vk_backend.gpu.memory import Buffer

    with Device(validation=True) as device:
        source, target = (Buffer(device, 64) for _ in range(2))
        region = vk.VkBufferCopy(srcOffset=0, dstOffset=0, size=64)

        def copy_twice(*between):
            with device.commands() as commands:
                vk.vkCmdCopyBuffer(commands, source.handle, target.handle, 1, [region])
                for record in between:
                    record(commands)
                vk.vkCmdCopyBuffer(commands, source.handle, target.handle, 1, [region])

        copy_twice(device.full_barrier)
        assert device.messages == []
        copy_twice()
        assert "SYNC-HAZARD-WRITE-AFTER-WRITE" in device.messages[0]


# --- a lost device ---


def lose(monkeypatch, *functions):
    """Has functions of Vulkan report from now on that the device is lost."""
    from vk_backend.gpu import vk

    def lost(*_):
        raise vk.VkErrorDeviceLost

    for function in functions:
        monkeypatch.setattr(vk, function, lost, raising=False)


@pytest.mark.parametrize("where", ["vkQueueSubmit2", "vkQueueWaitIdle", "vkGetQueryPoolResults"])
def test_a_lost_device_frees_everything(monkeypatch, live, tmp_path, where):
    from vk_backend.renderer import Renderer
    from vk_backend.scene.scene import load_scene

    scene = load_scene(zoo(tmp_path / "zoo.glb"))
    lost = "was lost while it ran; the driver stopped the work"
    with pytest.raises(MeshletError, match=lost), Renderer() as renderer:
        lose(monkeypatch, where, "vkDeviceWaitIdle")
        renderer.render(scene, scene.cameras[0], "vertex", 16, 16)
    assert live == []


def test_a_lost_device_ends_the_command_with_one_line(monkeypatch, tmp_path, capsys):
    path, output = zoo(tmp_path / "zoo.glb"), tmp_path / "out.png"
    lose(monkeypatch, "vkQueueSubmit2", "vkDeviceWaitIdle")
    arguments = ["render", path, "-o", output, "--backend", "vulkan", "--path", "vertex"]
    assert cli.main([str(a) for a in arguments]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1 and "was lost while it ran" in said.err
    assert not output.exists()


def test_missing_extension_is_named(tmp_path):
    from vk_backend.renderer import Renderer
    from vk_backend.scene.scene import load_scene

    scene = load_scene(zoo(tmp_path / "zoo.glb"))
    with Renderer() as renderer:
        assert renderer.default_path(scene) == "visibility"
        renderer.device.capabilities -= {"atomics64"}
        assert renderer.default_path(scene) == "stream"
        with pytest.raises(
            MeshletError, match="lacks the feature atomics64, which path visibility"
        ):
            renderer.render(scene, scene.cameras[0], "visibility", 16, 16)
        renderer.device.capabilities -= {"mesh"}
        renderer.device.extensions -= {"VK_EXT_mesh_shader"}
        assert renderer.default_path(scene) == "vertex"
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
    from vk_backend.scene.scene import load_scene

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

"""gpu-check: finds what a driver lacks and what it draws wrong, and says so in text and JSON."""

from __future__ import annotations

import getpass
import json
import os
import platform
import re
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

import gltf_ext
from gltf_ext import _codec
from gltf_meshlet import cli
from tests.helpers.vulkan_scenes import require_vulkan

SIZE = (160, 120)


@pytest.fixture(autouse=True)
def vulkan(request):
    require_vulkan()


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The command's scene with fewer copies, without levels and with them."""
    from gltf_meshlet.demo import check_scene

    folder = tmp_path_factory.mktemp("check")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(check_scene, "PLACES", check_scene.PLACES[:2])
        source = check_scene.write(folder / "source.glb")
    gltf_ext.compress(source, folder / "plain.glb")
    gltf_ext.compress(source, folder / "levels.glb", lod=True)
    return folder / "plain.glb", folder / "levels.glb"


def usual_camera():
    from gltf_meshlet.demo import check_scene as scene
    from vk_backend.scene.camera import Camera

    options = {"yfov": scene.FIELD_OF_VIEW, "near": scene.NEAR, "far": scene.FAR}
    return Camera.look_at(scene.EYE, scene.TARGET, **options)


@pytest.fixture
def checker(files, monkeypatch):
    """Of a small scene and pictures, in this process."""
    from vk_backend.check import drawn, report
    from vk_backend.check.apart import caught

    for module in (drawn, report):
        monkeypatch.setattr(module, "CHECKED", SIZE)
    model = report.Model(str(files[0]), str(files[1]), usual_camera())
    return report.Checker(model, lambda function, job, seconds: caught(function, job))


def ways(monkeypatch, *paths):
    """Has only some paths checked, without levels."""
    from vk_backend.check import drawn, report

    chosen = tuple(w for w in drawn.WAYS if w.path in paths and w == drawn.Way(w.path))
    monkeypatch.setattr(report, "WAYS", chosen)


def results(report):
    return {way["way"]: way["result"] for way in report["ways"]}


# --- what is right ---


def test_every_way_is_right(checker):
    from vk_backend.check.drawn import WAYS
    from vk_backend.renderer import PATHS

    assert {way.path for way in WAYS} == {*PATHS, "rt"}
    shares = []
    report = checker.device_report(0, shares.append)
    assert results(report) == dict.fromkeys((way.name for way in WAYS), "right")
    assert shares == sorted(shares) and shares[-1] == 1
    found = {way["way"]: way for way in report["ways"]}
    for way in found.values():
        assert way["milliseconds"] > 0 and way["first_seconds"] > 0 and way["frames"] > 0
    assert found["vertex"]["of_uncompressed"] == 1
    for name in ("visibility", "stream", "rt"):
        assert found[name]["meshlets_compared"] > 50, name


def test_the_scene_of_the_command_has_what_paths_treat_differently(tmp_path):
    from gltf_meshlet.demo import check_scene
    from vk_backend.decode.batches import BULK_MESHLETS
    from vk_backend.scene.scene import load_scene

    gltf_ext.compress(check_scene.write(tmp_path / "a.glb"), tmp_path / "b.glb")
    scene = load_scene(tmp_path / "b.glb")
    assert scene.warnings == ["not drawn: reflections of metals"] and len(scene.textures) == 2
    assert {i.mirrored for i in scene.instances} == {True, False}
    assert [set(p.attributes) for p in scene.primitives].count({"POSITION", "NORMAL", "TEXCOORD"})
    assert any("COLOR" in p.attributes for p in scene.primitives)
    meshlets = sum(scene.primitives[i.primitive].meshlets for i in scene.instances)
    assert meshlets >= BULK_MESHLETS


# --- what is wrong ---


@pytest.fixture(scope="module")
def picture(files):
    """(scene, camera, picture by path vertex)"""
    from vk_backend.renderer import Renderer
    from vk_backend.scene.scene import load_scene

    require_vulkan()
    scene, camera = load_scene(files[0]), usual_camera()
    with Renderer() as renderer:
        return scene, camera, renderer.render(scene, camera, "vertex", *SIZE)


def test_pixels_that_show_another_triangle(picture):
    from vk_backend.check.reference import Reference

    scene, camera, drawn = picture
    reference = Reference(scene, camera, *SIZE)
    assert reference.wrong_pixels(drawn.depth, drawn.ids) == 0
    assert reference.covered > 0.8 * np.count_nonzero(drawn.covered)
    other = drawn.ids.copy()
    y, x = np.argwhere(drawn.covered)[1234]
    other[y, x, 1] ^= 1
    assert reference.wrong_pixels(drawn.depth, other) == 1
    other[y, x] = drawn.ids[y, x] ^ [1, 0]  # another instance
    assert reference.wrong_pixels(drawn.depth, other) == 1
    nearer = drawn.depth.copy()
    nearer[y, x] -= 0.01
    assert reference.wrong_pixels(nearer, drawn.ids) == 1
    hole = drawn.depth.copy()
    hole[y, x] = 1
    assert reference.wrong_pixels(hole, None) == 1
    y, x = np.argwhere(~drawn.covered)[99]
    spot = drawn.depth.copy()
    spot[y, x] = 0.5
    assert reference.wrong_pixels(spot, None) == 1


def test_colours(picture):
    from vk_backend.check.reference import wrong_colors

    _, _, drawn = picture
    other = drawn.color.copy()
    other[3, 4, 1] ^= 3
    other[5, 6, 1] ^= 1  # rounding
    pixels = SIZE[0] * SIZE[1]
    assert wrong_colors(drawn.color, drawn.ids, other, drawn.ids) == (1, pixels)
    ids = drawn.ids.copy()
    ids[3, 4] ^= 1
    assert wrong_colors(drawn.color, drawn.ids, other, ids) == (0, pixels - 1)


def other_blob(blob: bytes) -> bytes:
    """A blob that decodes, to something else."""
    right = _codec.decode(blob)[1][0]
    for place in range(len(blob) * 3 // 4, len(blob)):
        changed = bytearray(blob)
        changed[place] ^= 1
        try:
            if not np.array_equal(_codec.decode(bytes(changed))[1][0], right):
                return bytes(changed)
        except ValueError:
            continue
    raise AssertionError("no bit of the blob matters")


def test_a_wrong_decoder_is_found(checker, monkeypatch, capsys):
    """Path visibility decodes other bytes than it should."""
    from vk_backend.check.text import device_text, wrong_ways
    from vk_backend.scene import buffers as scene_buffers

    upload = scene_buffers.SceneBuffers._upload_blobs

    def wrong(buffers):
        scene = buffers.scene
        other = [replace(p, blob=other_blob(p.blob)) for p in scene.primitives]
        buffers.scene = replace(scene, primitives=other)
        upload(buffers)
        buffers.scene = scene

    ways(monkeypatch, "vertex", "visibility")
    monkeypatch.setattr(scene_buffers.SceneBuffers, "_upload_blobs", wrong)
    report = checker.device_report(0)
    assert results(report) == {"vertex": "right", "visibility": "wrong"}
    why = report["ways"][1]["why"]
    assert "pixels show another triangle" in why and "meshlets are decoded to other bytes" in why
    assert wrong_ways(report) == ["visibility"]
    assert f"wrong: {why}" in device_text(report, checker.model_report())


def test_wrong_colours_are_found(checker, monkeypatch):
    from vk_backend.check import report as reports

    ways(monkeypatch, "vertex", "mesh")
    monkeypatch.setattr(reports, "wrong_colors", lambda *_: (500, 10_000))
    report = checker.device_report(0)
    assert results(report) == {"vertex": "right", "mesh": "wrong"}
    assert report["ways"][1]["why"] == "500 of 10,000 pixels have another colour"


# --- drivers that fail ---


def sleep_long(_):
    time.sleep(60)


def doubled(number):
    return 2 * number


def test_a_crash_and_a_hang_are_failures():
    from vk_backend.check.apart import Failure, run_apart

    assert run_apart(doubled, 21, 60) == 42
    crashed = run_apart(os._exit, 7, 60)
    assert crashed == Failure("the driver crashed the process (exit status 7)")
    assert run_apart(sleep_long, None, 0.5) == Failure("no answer within 0.5 seconds")


def test_a_path_that_fails_leaves_the_others(files, checker, monkeypatch):
    from vk_backend.gpu import vk

    def refused(*_):
        raise vk.VkErrorFeatureNotPresent

    ways(monkeypatch, "vertex", "geometry")
    monkeypatch.setattr("vk_backend.raster.graphics.graphics_pipeline", refused)
    report = checker.device_report(0)
    assert results(report) == {"vertex": "failed", "geometry": "failed"}
    assert "the driver refused: VkErrorFeatureNotPresent" in report["ways"][0]["why"]


# --- drivers that lack something ---


def test_a_driver_without_mesh_shaders_and_rays(checker, monkeypatch):
    from vk_backend.check.text import device_text, wrong_ways
    from vk_backend.gpu.physical import Physical

    absent = {"VK_EXT_mesh_shader", "VK_KHR_ray_tracing_pipeline"}
    original = Physical.__init__

    def made(self, handle):
        original(self, handle)
        self.extensions -= absent

    monkeypatch.setattr(Physical, "__init__", made)
    ways(monkeypatch, "vertex", "stream", "mesh", "mesh-paper", "rt")
    report = checker.device_report(0)
    assert results(report) == {
        "vertex": "right",
        **dict.fromkeys(("stream", "mesh", "mesh-paper", "rt"), "not offered"),
    }
    assert report["extensions"]["VK_EXT_mesh_shader"] is False
    offered = {path for limit in report["limits"] for path in limit["paths"]}
    assert offered == {"visibility", "geometry", "vertex"}
    text = device_text(report, checker.model_report())
    assert "not offered: the driver lacks VK_EXT_mesh_shader" in text
    assert "without VK_EXT_mesh_shader, VK_KHR_ray_tracing_pipeline" in text
    assert wrong_ways(report) == []


def test_a_driver_that_is_too_old(checker, monkeypatch):
    from vk_backend.gpu.errors import VulkanError
    from vk_backend.gpu.physical import Physical

    fault = VulkanError("it has no Vulkan 1.3", "update the driver")
    monkeypatch.setattr(Physical, "fault", lambda self, needed: fault)
    report = checker.device_report(0)
    assert set(results(report).values()) == {"not offered"} and report["limits"] == []
    assert report["ways"][0]["why"] == fault.message


def test_a_small_payload_excludes_a_path(checker, monkeypatch):
    from vk_backend.check import driver

    limits_of = driver.limits_of
    monkeypatch.setattr(
        driver, "limits_of", lambda device: replace(limits_of(device), task_payload_bytes=128)
    )
    ways(monkeypatch, "vertex", "mesh-paper")
    report = checker.device_report(0)
    assert report["ways"][1]["result"] == "not offered"
    assert report["ways"][1]["why"].endswith("bytes at most, the path needs 2404")


def test_without_the_package_that_builds_levels(tmp_path, monkeypatch):
    from gltf_ext.lod import simplifier
    from gltf_meshlet import gpu_check_command
    from vk_backend.check import report as reports
    from vk_backend.check.drawn import WAYS

    def absent():
        raise gltf_ext.MeshletError("levels of detail need the package meshoptimizer", "install it")

    monkeypatch.setattr(simplifier, "library", absent)
    checker = gpu_check_command._checker(tmp_path)
    monkeypatch.setattr(reports, "WAYS", [way for way in WAYS if way.lod_error])
    report = checker.device_report(0)
    assert set(results(report).values()) == {"not offered"}
    assert "need the package meshoptimizer" in report["ways"][0]["why"]


# --- the command ---


@pytest.fixture
def command(checker, monkeypatch, capsys):
    """Runs gpu-check on the small scene: (status, output, errors)."""
    from gltf_meshlet import gpu_check_command

    monkeypatch.setattr(gpu_check_command, "_checker", lambda folder: checker)
    ways(monkeypatch, "vertex", "geometry")

    def run(*arguments):
        status = cli.main(["gpu-check", *arguments])
        said = capsys.readouterr()
        return status, said.out, said.err

    return run


def test_text(command):
    status, text, errors = command()
    assert (status, errors) == (0, "")
    for label in ("device", "driver", "memory", "extensions", "features", "limits", "model"):
        assert f"\n{label:12}" in text
    assert text.count("right\n") == 2 and "Vulkan 1." in text
    for private in (getpass.getuser(), platform.node(), os.getcwd()):
        assert not re.search(rf"(?<!\w){re.escape(private)}(?!\w)", text), private
    assert "/tmp" not in text
    assert max(map(len, text.splitlines())) <= 140


def test_json(command):
    status, text, _ = command("--json", "--device", "all")
    report = json.loads(text)
    assert status == 0
    assert set(report) == {"gltf_meshlet", "system", "model", "devices"}
    (first, *_) = report["devices"]
    assert set(first) == {
        *("device", "name", "type", "vendor_id", "device_id", "driver", "api_version", "heaps"),
        *("queues", "extensions", "features", "paths", "limits", "timed_pixels", "ways"),
    }
    assert set(first["ways"][0]) == {
        *("way", "result", "milliseconds", "of_uncompressed", "frames", "first_seconds"),
        "meshlets_compared",
    }
    assert all(set(limit) == {"limit", "most", "of", "paths"} for limit in first["limits"])


def test_a_wrong_path_is_one_line_and_status_1(command, monkeypatch):
    from vk_backend.check.reference import Reference

    monkeypatch.setattr(Reference, "wrong_pixels", lambda *_: 77)
    status, text, errors = command()
    assert status == 1 and "77 of 19,200 pixels show another triangle" in text
    assert errors.startswith("gltf-meshlet: wrong: vertex on ") and errors.count("\n") == 1


def test_no_such_device(command):
    status, text, errors = command("--device", "none such")
    assert status == 2 and text == "" and errors.count("\n") == 1
    assert "there is no device none such; there are: 0: " in errors


def test_without_vulkan():
    nothing = {"VK_DRIVER_FILES": "/nonexistent", "VK_ICD_FILENAMES": "/nonexistent"}
    result = subprocess.run(
        [sys.executable, "-m", "gltf_meshlet", "gpu-check"],
        capture_output=True,
        text=True,
        env={**os.environ, **nothing},
    )
    assert result.returncode == 2 and result.stdout == "" and result.stderr.count("\n") == 1
    assert "there is no Vulkan driver; install one" in result.stderr


def test_a_way_in_a_process_of_its_own(files, checker, monkeypatch):
    """As the command does it."""
    from vk_backend.check.apart import run_apart
    from vk_backend.check.report import Checker

    ways(monkeypatch, "vertex")
    monkeypatch.undo()  # the other process has the usual size of picture
    ways(monkeypatch, "vertex")
    report = Checker(checker._model, run_apart).device_report(0)
    assert results(report) == {"vertex": "right"}

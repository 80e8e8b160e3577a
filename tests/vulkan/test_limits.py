"""Limits of devices: one clear line before Vulkan is asked for more."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

import gltf_ext
from gltf_ext.errors import MeshletError
from gltf_meshlet import cli
from tests.helpers.gltf_builder import Builder, grid_mesh
from tests.helpers.vulkan_scenes import open_renderer, png, resources_of, zoo


@pytest.fixture(scope="module")
def renderer():
    yield from open_renderer()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    from vk_backend.scene.scene import load_scene

    return load_scene(zoo(tmp_path_factory.mktemp("zoo") / "zoo.glb"))


def drawn(renderer, scene, width=331, height=257):
    return renderer.render(scene, scene.cameras[0], "visibility", width, height)


def limited(monkeypatch, device, **limits):
    monkeypatch.setattr(device, "limits", replace(device.limits, **limits))


# --- workgroups ---


def test_a_large_picture_takes_no_more_workgroups_than_the_device_has(renderer, scene):
    """4096 x 4097 pixels have more than 65,535 workgroups: the validation layer must be silent."""
    from vk_backend.frame_commands import FrameCommands
    from vk_backend.visibility.rasterizer import Planes

    drawn(renderer, scene)
    planes = Planes(renderer.device, 4096, 4097, ids=False)
    FrameCommands(renderer.drawing, planes).free()
    planes.free()
    assert renderer.device.messages == []


def test_few_workgroups_clear_all_pixels(renderer, scene, monkeypatch):
    whole = drawn(renderer, scene)
    monkeypatch.setattr("vk_backend.visibility.rasterizer.MAX_WORKGROUPS", 7)
    monkeypatch.setattr("vk_backend.decode.batches.MAX_WORKGROUPS", 7)
    other = drawn(renderer, scene)
    assert (other.ids == whole.ids).all() and (other.color == whole.color).all()
    assert not whole.covered.all()


@pytest.mark.parametrize("most", [(3, 65535, 65535), (65535, 3, 65535)])
def test_too_many_workgroups(renderer, scene, monkeypatch, most):
    drawn(renderer, scene)
    resources = resources_of(renderer.device)
    limited(monkeypatch, renderer.device, workgroups=most)
    with pytest.raises(MeshletError, match=r"^\d+ x \d+ workgroups are too many for .*; ask for"):
        drawn(renderer, scene)
    assert resources_of(renderer.device) == resources


# --- textures ---


def texture_array(device, textures):
    from vk_backend.scene.textures import TextureArray

    return TextureArray(device, textures)


def test_a_texture_that_is_too_long(renderer):
    from vk_backend.scene.materials import Texture

    most = renderer.device.limits.image_side
    texture = Texture(np.zeros((1, most + 1, 4), np.uint8))
    with pytest.raises(
        MeshletError,
        match=rf"^an image has {most + 1} x 1 pixels, too many for .*; at most {most} on a side$",
    ):
        texture_array(renderer.device, [texture])
    assert renderer.device.messages == []


def test_the_command_names_the_file_with_a_texture_that_is_too_long(tmp_path, capsys):
    builder = Builder()
    positions, triangles = grid_mesh(3, 3)
    builder.mesh({"POSITION": positions, "TEXCOORD_0": positions[:, :2]}, triangles, material=0)
    image = builder.view(png(np.zeros((40_000, 1, 3), np.uint8)))
    builder.properties.update(
        images=[{"bufferView": image, "mimeType": "image/png"}],
        textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    )
    path, output = tmp_path / "long.glb", tmp_path / "out.png"
    gltf_ext.compress(builder.write(tmp_path / "raw.glb"), path)
    arguments = ["render", path, "-o", output, "--backend", "vulkan", "--path", "vertex"]
    assert cli.main([str(a) for a in arguments]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert f"{path}: an image has 1 x 40000 pixels" in said.err and not output.exists()


def test_textures_share_samplers(monkeypatch):
    """A device may allow only 4000 samplers; there are 18 different ones."""
    from vk_backend.gpu import vk
    from vk_backend.gpu.device import Device
    from vk_backend.scene.materials import Texture
    from vk_backend.scene.textures import WRAP

    live = []
    create, destroy = vk.vkCreateSampler, vk.vkDestroySampler

    def created(*arguments):
        live.append(create(*arguments))
        return live[-1]

    def destroyed(device, sampler, callbacks):
        live.remove(sampler)
        destroy(device, sampler, callbacks)

    monkeypatch.setattr(vk, "vkCreateSampler", created, raising=False)
    monkeypatch.setattr(vk, "vkDestroySampler", destroyed, raising=False)
    pixel = np.full((1, 1, 4), 255, np.uint8)
    kinds = [(wrap, nearest) for wrap in product((*WRAP, 0), repeat=2) for nearest in (False, True)]
    with Device(validation=True) as device:
        arrays = [texture_array(device, [Texture(pixel, *kind) for kind in kinds]) for _ in "ab"]
        assert len(live) == 18
        for array in arrays:
            array.free()
        assert device.messages == []
        messages = device.messages
    assert messages == [] and live == []


def test_colour_attachments_take_resources_from_textures(renderer, monkeypatch):
    from vk_backend.gpu import vk
    from vk_backend.gpu.limits import read_limits

    class Core:
        maxPerStageResources = 18

        def __getattr__(self, name):
            return getattr(real.limits, name)

    physical = renderer.device.physical
    real = vk.vkGetPhysicalDeviceProperties(physical)
    fake = SimpleNamespace(deviceName=real.deviceName, limits=Core())
    monkeypatch.setattr(vk, "vkGetPhysicalDeviceProperties", lambda _: fake, raising=False)
    assert read_limits(physical, mesh=False, raytracing=False).textures == 16


def test_too_many_textures(renderer, monkeypatch):
    from vk_backend.scene.materials import Texture

    limited(monkeypatch, renderer.device, textures=16)
    textures = [Texture(np.full((1, 1, 4), 255, np.uint8))] * 17
    monkeypatch.setattr("vk_backend.scene.textures._upload", None)  # the number is checked before
    with pytest.raises(MeshletError, match=r"room for 32 textures, too many for .*; at most 16$"):
        texture_array(renderer.device, textures)


# --- after a failure ---


def test_after_a_picture_that_does_not_fit(renderer, scene, monkeypatch):
    """The targets of the last picture are gone: a picture of its size needs new ones."""
    whole = renderer.render(scene, scene.cameras[0], "vertex", 64, 48)
    with monkeypatch.context() as patch:
        limited(patch, renderer.device, buffer_bytes=1 << 20)
        with pytest.raises(MeshletError, match=r"^a buffer of \d MB is too large"):
            renderer.render(scene, scene.cameras[0], "mesh", 600, 500)
    again = renderer.render(scene, scene.cameras[0], "vertex", 64, 48)
    assert (again.color == whole.color).all() and (again.ids == whole.ids).all()


@pytest.mark.parametrize("path", ["visibility", "mesh", "vertex"])
def test_a_failed_drawing_leaves_no_resource(renderer, scene, monkeypatch, path):
    def fail(*_, **__):
        raise MeshletError("no pipeline")

    drawn(renderer, scene)
    monkeypatch.setattr(renderer, "_drawings", {})
    monkeypatch.setattr("vk_backend.raster.graphics.graphics_pipeline", fail)
    monkeypatch.setattr("vk_backend.visibility.rasterizer.ComputePipeline.of", fail)
    before = resources_of(renderer.device)
    with pytest.raises(MeshletError, match="no pipeline"):
        renderer.render(scene, scene.cameras[0], path, 64, 48)
    assert resources_of(renderer.device) == before
    monkeypatch.undo()
    assert renderer.render(scene, scene.cameras[0], path, 64, 48).covered.any()


# --- other limits ---


def test_too_large_buffer(renderer, monkeypatch):
    from vk_backend.gpu.memory import Buffer

    limited(monkeypatch, renderer.device, buffer_bytes=10_000_000)
    with pytest.raises(
        MeshletError, match=r"^a buffer of 11 MB is too large for .*; at most 10 MB"
    ):
        Buffer(renderer.device, 11_000_000)


def test_too_many_allocations(monkeypatch):
    from vk_backend.gpu.allocator import BLOCK_BYTES
    from vk_backend.gpu.device import Device
    from vk_backend.gpu.memory import Buffer

    with Device() as device:
        limited(monkeypatch, device, allocations=2)
        first, _ = (Buffer(device, BLOCK_BYTES + 1) for _ in range(2))
        with pytest.raises(MeshletError, match="allows no more than 2 allocations of memory"):
            Buffer(device, BLOCK_BYTES + 1)
        first.free()
        Buffer(device, BLOCK_BYTES + 1)


@pytest.mark.parametrize("size", [(65, 10), (10, 65), (0, 10)])
def test_impossible_picture(renderer, scene, monkeypatch, size):
    limited(monkeypatch, renderer.device, picture_side=64)
    with pytest.raises(MeshletError, match=rf"^{size[0]} x {size[1]} pixels are not possible"):
        drawn(renderer, scene, *size)


@pytest.mark.parametrize("limit", ["structure_boxes", "structure_instances"])
def test_too_large_acceleration_structure(renderer, scene, monkeypatch, limit):
    from vk_backend.raytrace.acceleration import BOTTOM, TOP, Structures
    from vk_backend.raytrace.geometry import Boxes, Instances

    level, shape = (BOTTOM, Boxes) if limit == "structure_boxes" else (TOP, Instances)
    limited(monkeypatch, renderer.device, **{limit: 9})
    monkeypatch.setattr(Structures, "_size", None)  # the number is checked before
    with pytest.raises(MeshletError, match=r"cannot trace 10 (boxes|instances); choose another"):
        Structures(renderer.device, level, [shape(0, 10)])


def test_push_constants_fit_every_device():
    """Vulkan guarantees 128 bytes."""
    from vk_backend.gpu.limits import PUSH_BYTES
    from vk_backend.gpu.reflection import shipped_reflection, structure

    names = [name for name in shipped_reflection()["structures"] if name.endswith("Push")]
    assert len(names) > 4
    for name in names:
        assert structure(name).itemsize <= PUSH_BYTES, name

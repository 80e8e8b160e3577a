"""Device memory: few allocations, nothing overlaps, and everything comes back."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gltf_ext
from gltf_ext.errors import MeshletError
from tests.helpers.gltf_builder import Builder
from tests.helpers.vulkan_scenes import ball, require_vulkan


@pytest.fixture(scope="module", autouse=True)
def vulkan():
    require_vulkan()


@pytest.fixture
def device():
    from vk_backend.gpu.device import Device

    with Device(validation=True) as made:
        yield made
        messages = made.messages
    assert messages == []


def counted(monkeypatch, *names: str) -> dict[str, int]:
    """Counts calls of functions of the Vulkan API from now on."""
    from vk_backend.gpu import vk

    calls = dict.fromkeys(names, 0)

    def wrapped(name, function):
        def call(*arguments):
            calls[name] += 1
            return function(*arguments)

        return call

    for name in names:
        monkeypatch.setattr(vk, name, wrapped(name, getattr(vk, name)), raising=False)
    return calls


@given(st.data())
def test_ranges_of_a_block_do_not_overlap(data):
    """Takes and gives back ranges in any order; the block is whole again at the end."""
    from vk_backend.gpu.allocator import Block

    block, taken = Block(1000), {}
    for _ in range(data.draw(st.integers(1, 40))):
        if taken and data.draw(st.booleans()):
            offset = data.draw(st.sampled_from(sorted(taken)))
            block.give_back(offset, taken.pop(offset))
            continue
        size, alignment = data.draw(st.integers(1, 300)), data.draw(st.sampled_from((1, 4, 64)))
        offset = block.take(size, alignment)
        if offset is None:
            continue
        assert offset % alignment == 0 and offset + size <= 1000
        assert all(offset + size <= o or o + s <= offset for o, s in taken.items())
        taken[offset] = size
    for offset, size in taken.items():
        block.give_back(offset, size)
    assert block.empty and block.take(1000, 256) == 0


def test_a_block_fills_its_gaps():
    from vk_backend.gpu.allocator import Block

    block = Block(100)
    assert [block.take(30, 1) for _ in range(4)] == [0, 30, 60, None]
    block.give_back(30, 30)
    assert block.take(31, 1) is None
    assert block.take(20, 4) == 32
    assert [block.take(size, 1) for size in (10, 8, 2, 1)] == [90, 52, 30, None]


def test_many_buffers_take_few_allocations(device, monkeypatch):
    """A device may allow only 4096 allocations."""
    from vk_backend.gpu.allocator import LOCAL, READBACK, UPLOAD
    from vk_backend.gpu.memory import Buffer

    calls = counted(monkeypatch, "vkAllocateMemory", "vkFreeMemory")
    buffers = [
        Buffer(device, 1000 + i, memory=(UPLOAD, LOCAL, READBACK)[i % 3]) for i in range(500)
    ]
    for i, buffer in enumerate(buffers):
        buffer.write(np.full(250, i, np.uint32))
    for i, buffer in enumerate(buffers):
        assert (buffer.read(np.uint32, 250) == i).all()
    assert calls["vkAllocateMemory"] <= 3
    for buffer in buffers:
        buffer.free()
        buffer.free()
    made = calls["vkAllocateMemory"]
    assert (Buffer(device, 1000).write(bytes(1000)).read(np.uint8) == 0).all()
    assert calls["vkAllocateMemory"] == made, "the memory is used again"


def test_large_buffers_give_their_memory_back(device, monkeypatch):
    from vk_backend.gpu.allocator import BLOCK_BYTES
    from vk_backend.gpu.memory import Buffer

    calls = counted(monkeypatch, "vkAllocateMemory", "vkFreeMemory")
    for _ in range(3):
        first, second = Buffer(device, 1000), Buffer(device, BLOCK_BYTES + 1)
        first.free()
        second.free()
    assert calls == {"vkAllocateMemory": 4, "vkFreeMemory": 3}


def test_too_much_memory_is_one_line(device, monkeypatch):
    from vk_backend.gpu import vk
    from vk_backend.gpu.memory import Buffer

    def fail(*_):
        raise vk.VkErrorOutOfDeviceMemory

    monkeypatch.setattr(vk, "vkAllocateMemory", fail, raising=False)
    with pytest.raises(MeshletError, match=r"has no 50 MB of memory left; close other programs"):
        Buffer(device, 50_000_000)


def test_staging_buffers_are_forgotten(device):
    """Writes and reads leave nothing behind for the device to free."""
    from vk_backend.gpu.memory import Buffer

    buffer = Buffer(device, 4000).write(bytes(4000))
    before = len(device._closing)
    for _ in range(20):
        buffer.write(bytes(4000))
        buffer.read()
    assert len(device._closing) == before
    buffer.free()
    assert len(device._closing) == before - 1


def test_uploads_are_visible_to_later_commands(device, monkeypatch):
    """Waiting for the queue does not make them so."""
    from vk_backend.gpu import vk
    from vk_backend.gpu.memory import Buffer

    recorded = []

    def watch(name, note):
        function = getattr(vk, name)

        def call(*arguments):
            recorded.append(note(*arguments))
            return function(*arguments)

        monkeypatch.setattr(vk, name, call, raising=False)

    def barrier(commands, info):
        memory = info.pMemoryBarriers[0]
        return memory.srcStageMask, memory.dstStageMask, memory.dstAccessMask

    buffer = Buffer(device, 64)
    watch("vkCmdCopyBuffer", lambda *_: "copy")
    watch("vkCmdPipelineBarrier2", barrier)
    buffer.write(bytes(64))
    everything = vk.VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT
    access = vk.VK_ACCESS_2_MEMORY_READ_BIT | vk.VK_ACCESS_2_MEMORY_WRITE_BIT
    assert recorded == ["copy", (everything, everything, access)]


# --- what the CPU reads ---


def test_the_cpu_reads_cached_memory():
    """An NVIDIA GPU's types: without a cache, memory is read many times more slowly."""
    from vk_backend.gpu import vk
    from vk_backend.gpu.allocator import LOCAL, READBACK, UPLOAD, Allocator

    local, visible, coherent, cached = 1, 2, 4, 8
    types = [0, local, visible | coherent, visible | coherent | cached, local | visible | coherent]
    device = SimpleNamespace(physical=None, name="GPU", at_close=lambda action: None)
    with pytest.MonkeyPatch.context() as patch:
        described = SimpleNamespace(
            memoryTypeCount=len(types),
            memoryTypes=[SimpleNamespace(propertyFlags=t) for t in types],
        )
        patch.setattr(vk, "vkGetPhysicalDeviceMemoryProperties", lambda _: described, raising=False)
        allocator = Allocator(device)
    assert [allocator._type_of(0b11111, kind) for kind in (LOCAL, UPLOAD, READBACK)] == [1, 2, 3]
    assert allocator._type_of(0b10111, READBACK) == 2, "the memory may have no cache"


class Copies:
    """Watches copies into memory that the CPU reads.

    seen, unseen: how many have a barrier for the CPU after them in their command buffer, or none.
    A fence is none, and the validation layer does not watch the CPU.
    """

    def __init__(self, patch: pytest.MonkeyPatch):
        from vk_backend.gpu import vk
        from vk_backend.gpu.allocator import LOCAL, READBACK
        from vk_backend.gpu.memory import STORAGE, Buffer

        self.seen = self.unseen = 0
        readable, waiting, make = set(), {}, Buffer.__init__

        def made(buffer, device, size, usage=STORAGE, memory=LOCAL):
            make(buffer, device, size, usage, memory)
            change = readable.add if memory is READBACK else readable.discard
            change(buffer.handle)

        def copied(commands, target):
            waiting[commands] = waiting.get(commands, 0) + (target in readable)

        def barrier(commands, info):
            barriers = [info.pMemoryBarriers[i] for i in range(info.memoryBarrierCount)]
            host = vk.VK_PIPELINE_STAGE_2_HOST_BIT, vk.VK_ACCESS_2_HOST_READ_BIT
            if host in [(b.dstStageMask, b.dstAccessMask) for b in barriers]:
                self.seen += waiting.pop(commands, 0)

        def ended(commands):
            self.unseen += waiting.pop(commands, 0)

        def watch(name, note):
            function = getattr(vk, name)

            def call(*arguments):
                note(*arguments)
                return function(*arguments)

            patch.setattr(vk, name, call, raising=False)

        patch.setattr(Buffer, "__init__", made)
        watch("vkCmdCopyBuffer", lambda commands, source, target, *_: copied(commands, target))
        watch("vkCmdCopyImageToBuffer", lambda c, image, layout, to, *_: copied(c, to))
        watch("vkCmdPipelineBarrier2", barrier)
        watch("vkEndCommandBuffer", ended)


def test_copies_are_visible_to_the_cpu(monkeypatch, tmp_path):
    """Of buffers, images and results of frames with levels."""
    from vk_backend.gpu.memory import Buffer
    from vk_backend.renderer import Renderer
    from vk_backend.scene.camera import Camera
    from vk_backend.scene.scene import load_scene

    positions, triangles = ball(120, 90)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    raw, file = builder.write(tmp_path / "raw.glb"), tmp_path / "levels.glb"
    gltf_ext.compress(raw, file, lod=True)
    copies = Copies(monkeypatch)
    with Renderer() as renderer:
        Buffer(renderer.device, 100).read()
        assert (copies.seen, copies.unseen) == (1, 0)
        for levels, path, least in ((False, "vertex", 3), (True, "visibility", 5)):
            scene = load_scene(file, levels=levels)
            before = copies.seen
            camera = Camera.fit_box(scene.low, scene.high, 32, 24)
            renderer.render(scene, camera, path, 32, 24)
            assert copies.seen - before >= least and copies.unseen == 0

"""Device memory: few allocations, nothing overlaps, and everything comes back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gltf_ext.errors import MeshletError
from tests.helpers.vulkan_scenes import require_vulkan


@pytest.fixture(scope="module", autouse=True)
def vulkan():
    require_vulkan()


@pytest.fixture
def device():
    from vk_backend.device import Device

    with Device(validation=True) as made:
        yield made
        messages = made.messages
    assert messages == []


def counted(monkeypatch, *names: str) -> dict[str, int]:
    """Counts calls of functions of the Vulkan API from now on."""
    from vk_backend import vk

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
    from vk_backend.allocator import Block

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
    from vk_backend.allocator import Block

    block = Block(100)
    assert [block.take(30, 1) for _ in range(4)] == [0, 30, 60, None]
    block.give_back(30, 30)
    assert block.take(31, 1) is None
    assert block.take(20, 4) == 32
    assert [block.take(size, 1) for size in (10, 8, 2, 1)] == [90, 52, 30, None]


def test_many_buffers_take_few_allocations(device, monkeypatch):
    """A device may allow only 4096 allocations."""
    from vk_backend.memory import Buffer

    calls = counted(monkeypatch, "vkAllocateMemory", "vkFreeMemory")
    buffers = [Buffer(device, 1000 + i, host=i % 2 == 0) for i in range(500)]
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
    from vk_backend.allocator import BLOCK_BYTES
    from vk_backend.memory import Buffer

    calls = counted(monkeypatch, "vkAllocateMemory", "vkFreeMemory")
    for _ in range(3):
        first, second = Buffer(device, 1000), Buffer(device, BLOCK_BYTES + 1)
        first.free()
        second.free()
    assert calls == {"vkAllocateMemory": 4, "vkFreeMemory": 3}


def test_too_much_memory_is_one_line(device, monkeypatch):
    from vk_backend import vk
    from vk_backend.memory import Buffer

    def fail(*_):
        raise vk.VkErrorOutOfDeviceMemory

    monkeypatch.setattr(vk, "vkAllocateMemory", fail, raising=False)
    with pytest.raises(MeshletError, match=r"has no 50 MB of memory left; close other programs"):
        Buffer(device, 50_000_000)


def test_staging_buffers_are_forgotten(device):
    """Writes and reads leave nothing behind for the device to free."""
    from vk_backend.memory import Buffer

    buffer = Buffer(device, 4000).write(bytes(4000))
    before = len(device._closing)
    for _ in range(20):
        buffer.write(bytes(4000))
        buffer.read()
    assert len(device._closing) == before
    buffer.free()
    assert len(device._closing) == before - 1

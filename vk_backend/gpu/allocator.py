"""Device memory for buffers and images, from few allocations: a device may allow only 4096."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from . import vk
from .device import Device
from .errors import VulkanError

BLOCK_BYTES = 16 << 20  # of an allocation; a buffer or image that is larger gets one of its own
COHERENT = vk.VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | vk.VK_MEMORY_PROPERTY_HOST_COHERENT_BIT


@dataclass(frozen=True)
class Memory:
    """A kind of memory: VK_MEMORY_PROPERTY_ masks that it has, and more that it has if it can."""

    needed: int
    preferred: int = 0

    @property
    def mapped(self) -> bool:
        """Whether the CPU has access to its bytes."""
        return bool(self.needed & vk.VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT)


LOCAL = Memory(vk.VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT)
UPLOAD = Memory(COHERENT)  # that the CPU writes
# That the CPU reads. Of memory without a cache it reads a few bytes at a time: on NVIDIA, the first
# coherent type is such memory.
READBACK = Memory(COHERENT, vk.VK_MEMORY_PROPERTY_HOST_CACHED_BIT)


class Block:
    """An allocation, and which of its bytes are free.

    memory: VkDeviceMemory; mapped: its bytes for the CPU, or None.
    """

    def __init__(self, size: int, memory: Any = None, mapped: Any = None):
        self.size, self.memory, self.mapped = size, memory, mapped
        self._free = {0: size}  # begin -> end of each free range

    @property
    def empty(self) -> bool:
        """Whether all bytes are free."""
        return self._free == {0: self.size}

    def take(self, size: int, alignment: int) -> int | None:
        """The offset of `size` bytes that were free, or None if no free range holds them."""
        for begin, end in self._free.items():
            offset = -(-begin // alignment) * alignment
            if offset + size <= end:
                del self._free[begin]
                rest = ((begin, offset), (offset + size, end))
                self._free.update((first, last) for first, last in rest if first < last)
                return offset
        return None

    def give_back(self, offset: int, size: int) -> None:
        """Frees bytes that `take` has returned."""
        begin = next((first for first, last in self._free.items() if last == offset), offset)
        self._free[begin] = self._free.pop(offset + size, offset + size)


@dataclass(frozen=True)
class Kind:
    """What the buffers or images of a block have in common. type: number of the memory type."""

    type: int
    mapped: bool
    image: bool


@dataclass(frozen=True)
class Place:
    """Bytes of a block."""

    block: Block
    offset: int
    size: int
    kind: Kind


class Allocator:
    """The blocks of a device."""

    def __init__(self, device: Device):
        self._device = device
        self._types = vk.vkGetPhysicalDeviceMemoryProperties(device.physical)
        self._blocks: dict[Kind, list[Block]] = {}
        device.at_close(self._free_all)

    @classmethod
    def of(cls, device: Device) -> Allocator:
        """The device's allocator."""
        allocator: Allocator = device.once("allocator", lambda: cls(device))
        return allocator

    def take(self, needed: Any, memory: Memory, *, image: bool = False) -> Place:
        """Bytes of a kind of memory for `needed` (VkMemoryRequirements).

        Raises VulkanError if memory is short.
        """
        kind = Kind(self._type_of(needed.memoryTypeBits, memory), memory.mapped, image)
        blocks = self._blocks.setdefault(kind, [])
        for block in blocks:
            offset = block.take(needed.size, needed.alignment)
            if offset is not None:
                return Place(block, offset, needed.size, kind)
        block = self._allocate(needed.size, kind)
        blocks.append(block)
        block.take(needed.size, 1)
        return Place(block, 0, needed.size, kind)

    def give_back(self, place: Place) -> None:
        """Frees memory. Of each kind, one empty block is kept for the next buffers."""
        block, blocks = place.block, self._blocks[place.kind]
        block.give_back(place.offset, place.size)
        spare = any(other.empty for other in blocks if other is not block)
        if block.empty and (spare or block.size > BLOCK_BYTES):
            blocks.remove(block)
            vk.vkFreeMemory(self._device.handle, block.memory, None)

    def _type_of(self, allowed: int, memory: Memory) -> int:
        """The first memory type of the bits `allowed` that fits best."""
        for properties in (memory.needed | memory.preferred, memory.needed):
            for index in range(self._types.memoryTypeCount):
                flags = self._types.memoryTypes[index].propertyFlags
                if allowed >> index & 1 and flags & properties == properties:
                    return index
        raise VulkanError(
            f"{self._device.name} has no memory of the needed kind", "choose another --device"
        )

    def _allocate(self, size: int, kind: Kind) -> Block:
        """A block of at least `size` bytes."""
        self._device.limits.check_allocations(1 + sum(map(len, self._blocks.values())))
        addressed = vk.VkMemoryAllocateFlagsInfo(flags=vk.VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT)
        handle, room = self._device.handle, max(size, BLOCK_BYTES)
        info = vk.VkMemoryAllocateInfo(
            pNext=None if kind.image else addressed,
            allocationSize=room,
            memoryTypeIndex=kind.type,
        )
        try:
            memory = vk.vkAllocateMemory(handle, info, None)
        except (
            vk.VkErrorOutOfDeviceMemory,
            vk.VkErrorOutOfHostMemory,
            vk.VkErrorTooManyObjects,
        ):
            raise VulkanError(
                f"{self._device.name} has no {size / 1e6:.0f} MB of memory left",
                "close other programs or render a smaller scene",
            ) from None
        mapped = vk.vkMapMemory(handle, memory, 0, room, 0) if kind.mapped else None
        return Block(room, memory, mapped)

    def _free_all(self) -> None:
        for block in (block for blocks in self._blocks.values() for block in blocks):
            vk.vkFreeMemory(self._device.handle, block.memory, None)

"""Acceleration structures: built on the device, compacted, and packed into few buffers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..gpu import vk
from ..gpu.device import Device, Resource
from ..gpu.memory import ADDRESSED, STORAGE, Buffer
from ..gpu.pipelines import read_queries

BOX_BYTES = 24  # VkAabbPositionsKHR
BATCH_BYTES = 256 << 20  # of structures that are built together before they are compacted
ALIGNMENT = 256  # of a structure in its buffer, demanded by Vulkan
STORED = vk.VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR | ADDRESSED
INPUT = STORAGE | vk.VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR
BOTTOM = vk.VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR
TOP = vk.VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR

# VkAccelerationStructureInstanceKHR. index_mask: custom index, visibility mask in the upper 8 bits;
# offset_flags: shader binding table offset, flags in the upper 8 bits.
INSTANCE = np.dtype(
    [
        ("transform", np.float32, (3, 4)),
        ("index_mask", np.uint32),
        ("offset_flags", np.uint32),
        ("structure", np.uint64),
    ]
)


class Shape(Protocol):
    """What a structure is built over: `count` boxes, triangles or instances."""

    @property
    def count(self) -> int: ...

    def describe(self) -> tuple[int, Any]:
        """(VkGeometryTypeKHR, VkAccelerationStructureGeometryDataKHR)"""
        ...


@dataclass(frozen=True)
class Boxes:
    """Procedural geometry: `count` boxes (VkAabbPositionsKHR) at a device address."""

    address: int
    count: int

    def describe(self) -> tuple[int, Any]:
        data = vk.VkAccelerationStructureGeometryAabbsDataKHR(
            data=vk.VkDeviceOrHostAddressConstKHR(deviceAddress=self.address), stride=BOX_BYTES
        )
        return vk.VK_GEOMETRY_TYPE_AABBS_KHR, vk.VkAccelerationStructureGeometryDataKHR(aabbs=data)


@dataclass(frozen=True)
class Instances:
    """The contents of a top level: `count` records of INSTANCE at a device address."""

    address: int
    count: int

    def describe(self) -> tuple[int, Any]:
        data = vk.VkAccelerationStructureGeometryInstancesDataKHR(
            data=vk.VkDeviceOrHostAddressConstKHR(deviceAddress=self.address)
        )
        return vk.VK_GEOMETRY_TYPE_INSTANCES_KHR, vk.VkAccelerationStructureGeometryDataKHR(
            instances=data
        )


class Structures:
    """Acceleration structures of one level, one for each geometry, compacted.

    addresses: device addresses in the geometries' order; allocated: bytes of device memory that
    stay allocated. Raises VulkanError if memory is short, or a geometry too large for the device.
    """

    def __init__(self, device: Device, level: int, geometries: Sequence[Shape]):
        self.device, self.level = device, level
        self.addresses: list[int] = []
        self._packed: list[Packed] = []
        self.allocated = 0
        for geometry in geometries:
            device.limits.check_structure(geometry.count, of_instances=level == TOP)
        self._infos = [self._info(g) for g in geometries]
        self._sizes = [self._size(i, g.count) for i, g in zip(self._infos, geometries)]
        begin = 0
        while begin < len(geometries):
            end, total = begin + 1, self._sizes[begin][0]
            while end < len(geometries) and total + self._sizes[end][0] <= BATCH_BYTES:
                total += self._sizes[end][0]
                end += 1
            self._build_batch(geometries, begin, end)
            begin = end
        del self._infos, self._sizes

    def free(self) -> None:
        """Frees the memory; a second call does nothing."""
        for packed in self._packed:
            packed.free()

    def _info(self, geometry: Shape) -> tuple[Any, Any]:
        """(VkAccelerationStructureBuildGeometryInfoKHR, its geometry).

        The caller keeps the geometry alive: the bindings do not.
        """
        kind, data = geometry.describe()
        described = vk.VkAccelerationStructureGeometryKHR(
            geometryType=kind,
            geometry=data,
            flags=vk.VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_KHR,
        )
        pointed = vk.ffi.new("VkAccelerationStructureGeometryKHR[1]", [described])
        flags = vk.VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR
        info = vk.ffi.new("VkAccelerationStructureBuildGeometryInfoKHR *")
        info.sType = vk.VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR
        info.type = self.level
        info.flags = flags | vk.VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_KHR
        info.mode = vk.VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR
        info.geometryCount = 1
        info.pGeometries = pointed
        return info, pointed

    def _size(self, info: tuple[Any, Any], count: int) -> tuple[int, int]:
        """(bytes of the structure before compaction, bytes of scratch)"""
        sizes = vk.ffi.new("VkAccelerationStructureBuildSizesInfoKHR *")
        sizes.sType = vk.VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR
        self.device.function("vkGetAccelerationStructureBuildSizesKHR")(
            self.device.handle,
            vk.VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR,
            info[0],
            [count],
            sizes,
        )
        return int(sizes.accelerationStructureSize), int(sizes.buildScratchSize)

    def _build_batch(self, geometries: Sequence[Shape], begin: int, end: int) -> None:
        """Builds and compacts geometries [begin, end)."""
        device, count = self.device, end - begin
        infos, sizes = self._infos[begin:end], self._sizes[begin:end]
        loose = Packed(device, self.level, [size for size, _ in sizes])
        step = max(device.limits.scratch_alignment, 1)
        scratch_sizes = [-(-scratch // step) * step for _, scratch in sizes]
        scratch = Buffer(device, sum(scratch_sizes) + step, STORAGE)
        at = -(-scratch.address // step) * step
        for (info, _), structure, size in zip(infos, loose.handles, scratch_sizes):
            info.dstAccelerationStructure = structure
            info.scratchData.deviceAddress = at
            at += size
        described = vk.ffi.new(
            "VkAccelerationStructureBuildGeometryInfoKHR[]", [info[0] for info, _ in infos]
        )
        ranges = vk.ffi.new(
            "VkAccelerationStructureBuildRangeInfoKHR[]",
            [(g.count, 0, 0, 0) for g in geometries[begin:end]],
        )
        pointers = vk.ffi.new(
            "VkAccelerationStructureBuildRangeInfoKHR *[]", [ranges + i for i in range(count)]
        )
        kind = vk.VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR
        pool = vk.vkCreateQueryPool(
            device.handle, vk.VkQueryPoolCreateInfo(queryType=kind, queryCount=count), None
        )
        with device.commands() as commands:
            vk.vkCmdResetQueryPool(commands, pool, 0, count)
            # Shaders of earlier submissions have written the boxes.
            device.full_barrier(commands)
            device.function("vkCmdBuildAccelerationStructuresKHR")(
                commands, count, described, pointers
            )
            # The structures are complete before their sizes are asked for.
            device.full_barrier(commands)
            device.function("vkCmdWriteAccelerationStructuresPropertiesKHR")(
                commands, count, loose.handles, kind, pool, 0
            )
        compacted = read_queries(device, pool, count)
        vk.vkDestroyQueryPool(device.handle, pool, None)
        scratch.free()
        packed = Packed(device, self.level, [int(size) for size in compacted])
        with device.commands() as commands:
            for source, target in zip(loose.handles, packed.handles):
                copy = vk.VkCopyAccelerationStructureInfoKHR(
                    src=source, dst=target, mode=vk.VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_KHR
                )
                device.function("vkCmdCopyAccelerationStructureKHR")(commands, copy)
        loose.free()
        self._packed.append(packed)
        self.addresses += packed.addresses()
        self.allocated += packed.buffer.allocated


class Packed(Resource):
    """Acceleration structures of given sizes in one buffer, not yet built."""

    def __init__(self, device: Device, level: int, sizes: Sequence[int]):
        steps = [-(-size // ALIGNMENT) * ALIGNMENT for size in sizes]
        offsets = np.concatenate([[0], np.cumsum(steps)])
        self.buffer = Buffer(device, int(offsets[-1]), STORED)
        create = device.function("vkCreateAccelerationStructureKHR")
        self.handles = [
            create(
                device.handle,
                vk.VkAccelerationStructureCreateInfoKHR(
                    buffer=self.buffer.handle, offset=int(offset), size=int(size), type=level
                ),
                None,
            )
            for offset, size in zip(offsets, sizes)
        ]
        self.register(device)

    def addresses(self) -> list[int]:
        """The structures' device addresses."""
        infos = [
            vk.VkAccelerationStructureDeviceAddressInfoKHR(accelerationStructure=handle)
            for handle in self.handles
        ]
        return [
            vk.vkGetAccelerationStructureDeviceAddressKHR(self.device.handle, info)
            for info in infos
        ]

    def _destroy(self) -> None:
        for handle in self.handles:
            self.device.function("vkDestroyAccelerationStructureKHR")(
                self.device.handle, handle, None
            )
        self.buffer.free()

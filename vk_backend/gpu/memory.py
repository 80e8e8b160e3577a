"""Buffers and images in device memory."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import vk
from .allocator import LOCAL, READBACK, UPLOAD, Allocator, Memory
from .device import Device, Resource
from .errors import VulkanError

ADDRESSED = vk.VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT
STORAGE = vk.VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | ADDRESSED
TRANSFER = vk.VK_BUFFER_USAGE_TRANSFER_SRC_BIT | vk.VK_BUFFER_USAGE_TRANSFER_DST_BIT


class Buffer(Resource):
    """A buffer.

    size: bytes; allocated: bytes of device memory; host: mapped for the CPU, as UPLOAD and READBACK
    are; address: for shaders, 0 without ADDRESSED. Raises VulkanError if memory is short.
    """

    def __init__(self, device: Device, size: int, usage: int = STORAGE, memory: Memory = LOCAL):
        self.size, self.host = int(size), memory.mapped
        device.limits.check_buffer(self.size)
        self.handle = vk.vkCreateBuffer(
            device.handle,
            vk.VkBufferCreateInfo(
                size=max(self.size, 4), usage=usage | TRANSFER, **_sharing(device)
            ),
            None,
        )
        needed = vk.vkGetBufferMemoryRequirements(device.handle, self.handle)
        self.allocated = int(needed.size)
        try:
            self._place = Allocator.of(device).take(needed, memory)
        except VulkanError:
            vk.vkDestroyBuffer(device.handle, self.handle, None)
            raise
        block, offset = self._place.block, self._place.offset
        vk.vkBindBufferMemory(device.handle, self.handle, block.memory, offset)
        self.address = 0
        if usage & ADDRESSED:
            info = vk.VkBufferDeviceAddressInfo(buffer=self.handle)
            self.address = vk.vkGetBufferDeviceAddress(device.handle, info)
        self.register(device)

    def write(self, data: np.ndarray | bytes | memoryview, offset: int = 0) -> Buffer:
        """Copies the data's bytes to byte `offset`; waits. Returns the buffer.

        Raises ValueError if the data does not fit.
        """
        if isinstance(data, np.ndarray) and data.size:
            raw = np.ascontiguousarray(data).data.cast("B")
        else:
            raw = memoryview(bytes(data))
        if offset + len(raw) > self.size:
            raise ValueError("more data than the buffer holds")
        if not len(raw):
            return self
        if self.host:
            begin = self._place.offset + offset
            self._place.block.mapped[begin : begin + len(raw)] = raw
            return self
        staging = Buffer(self.device, len(raw), vk.VK_BUFFER_USAGE_TRANSFER_SRC_BIT, UPLOAD)
        staging.write(raw)
        with self.device.commands() as commands:
            region = vk.VkBufferCopy(srcOffset=0, dstOffset=offset, size=len(raw))
            vk.vkCmdCopyBuffer(commands, staging.handle, self.handle, 1, [region])
            # Waiting for the queue makes the bytes visible to no later command.
            self.device.full_barrier(commands)
        staging.free()
        return self

    def read(
        self, dtype: np.dtype | type = np.uint32, count: int = -1, offset: int = 0
    ) -> np.ndarray:
        """dtype[count] from byte `offset`; waits. count: -1 reads to the end."""
        dtype = np.dtype(dtype)
        count = (self.size - offset) // dtype.itemsize if count < 0 else count
        size = count * dtype.itemsize
        if self.host:
            begin = self._place.offset + offset
            return np.frombuffer(bytes(self._place.block.mapped[begin : begin + size]), dtype)
        staging = Buffer(self.device, size, vk.VK_BUFFER_USAGE_TRANSFER_DST_BIT, READBACK)
        with self.device.commands() as commands:
            # Shaders of earlier submissions may have written the buffer by its address, which the
            # validation layer does not see.
            self.device.full_barrier(commands)
            region = vk.VkBufferCopy(srcOffset=offset, dstOffset=0, size=size)
            vk.vkCmdCopyBuffer(commands, self.handle, staging.handle, 1, [region])
            self.device.host_barrier(commands)  # for `staging.read`
        data = staging.read(dtype, count)
        staging.free()
        return data

    def _destroy(self) -> None:
        vk.vkDestroyBuffer(self.device.handle, self.handle, None)
        Allocator.of(self.device).give_back(self._place)


def _sharing(device: Device) -> dict[str, Any]:
    """Sharing of a buffer between all queues of the device, without ownership transfers."""
    if len(device.families) == 1:
        return {"sharingMode": vk.VK_SHARING_MODE_EXCLUSIVE}
    return {
        "sharingMode": vk.VK_SHARING_MODE_CONCURRENT,
        "queueFamilyIndexCount": len(device.families),
        "pQueueFamilyIndices": device.families,
    }


class Owner:
    """Something on a device that owns buffers, by name."""

    def __init__(self, **buffers: Buffer):
        self.buffers = buffers

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of all buffers."""
        return sum(buffer.allocated for buffer in self.buffers.values())

    def free(self) -> None:
        """Frees the memory; a second call does nothing."""
        for buffer in self.buffers.values():
            buffer.free()


class Image(Resource):
    """A two-dimensional image with a view.

    layout: after the commands recorded so far. Raises VulkanError if memory is short, or if the
    image is too large for the device.
    """

    def __init__(
        self, device: Device, width: int, height: int, format: int, usage: int, *, levels: int = 1
    ):
        device.limits.check_image(width, height)
        self.format, self.levels = format, levels
        self.width, self.height = width, height
        depth = format == vk.VK_FORMAT_D32_SFLOAT
        self.aspect = vk.VK_IMAGE_ASPECT_DEPTH_BIT if depth else vk.VK_IMAGE_ASPECT_COLOR_BIT
        self.layout = vk.VK_IMAGE_LAYOUT_UNDEFINED
        self.handle = vk.vkCreateImage(
            device.handle,
            vk.VkImageCreateInfo(
                imageType=vk.VK_IMAGE_TYPE_2D,
                format=format,
                extent=vk.VkExtent3D(width=width, height=height, depth=1),
                mipLevels=levels,
                arrayLayers=1,
                samples=vk.VK_SAMPLE_COUNT_1_BIT,
                tiling=vk.VK_IMAGE_TILING_OPTIMAL,
                usage=usage,
                sharingMode=vk.VK_SHARING_MODE_EXCLUSIVE,
                initialLayout=self.layout,
            ),
            None,
        )
        needed = vk.vkGetImageMemoryRequirements(device.handle, self.handle)
        self.allocated = int(needed.size)
        try:
            self._place = Allocator.of(device).take(needed, LOCAL, image=True)
        except VulkanError:
            vk.vkDestroyImage(device.handle, self.handle, None)
            raise
        memory, offset = self._place.block.memory, self._place.offset
        vk.vkBindImageMemory(device.handle, self.handle, memory, offset)
        self.range = vk.VkImageSubresourceRange(
            aspectMask=self.aspect,
            baseMipLevel=0,
            levelCount=levels,
            baseArrayLayer=0,
            layerCount=1,
        )
        self.view = vk.vkCreateImageView(
            device.handle,
            vk.VkImageViewCreateInfo(
                image=self.handle,
                viewType=vk.VK_IMAGE_VIEW_TYPE_2D,
                format=format,
                subresourceRange=self.range,
            ),
            None,
        )
        self.register(device)

    def to_layout(self, commands: Any, layout: int, *, keep: bool = True) -> None:
        """Records a layout transition.

        keep: the contents, unless the layout was undefined. Without, the commands can run whatever
        the layout is then.
        """
        stage = vk.VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT
        access = vk.VK_ACCESS_2_MEMORY_READ_BIT | vk.VK_ACCESS_2_MEMORY_WRITE_BIT
        barrier = vk.VkImageMemoryBarrier2(
            srcStageMask=stage,
            srcAccessMask=access,
            dstStageMask=stage,
            dstAccessMask=access,
            oldLayout=self.layout if keep else vk.VK_IMAGE_LAYOUT_UNDEFINED,
            newLayout=layout,
            srcQueueFamilyIndex=vk.VK_QUEUE_FAMILY_IGNORED,
            dstQueueFamilyIndex=vk.VK_QUEUE_FAMILY_IGNORED,
            image=self.handle,
            subresourceRange=self.range,
        )
        vk.vkCmdPipelineBarrier2(
            commands, vk.VkDependencyInfo(imageMemoryBarrierCount=1, pImageMemoryBarriers=[barrier])
        )
        self.layout = layout

    def copy_region(self, level: int = 0) -> Any:
        """VkBufferImageCopy of a whole level, tightly packed."""
        return vk.VkBufferImageCopy(
            imageSubresource=vk.VkImageSubresourceLayers(
                aspectMask=self.aspect, mipLevel=level, layerCount=1
            ),
            imageExtent=vk.VkExtent3D(
                width=max(self.width >> level, 1), height=max(self.height >> level, 1), depth=1
            ),
        )

    def read(self, dtype: np.dtype | type, channels: int) -> np.ndarray:
        """dtype[height, width, channels] of the first level; waits. Needs TRANSFER_SRC usage."""
        size = self.width * self.height * channels * np.dtype(dtype).itemsize
        staging = Buffer(self.device, size, vk.VK_BUFFER_USAGE_TRANSFER_DST_BIT, READBACK)
        with self.device.commands() as commands:
            self.to_layout(commands, vk.VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL)
            vk.vkCmdCopyImageToBuffer(
                commands, self.handle, self.layout, staging.handle, 1, [self.copy_region()]
            )
            self.device.host_barrier(commands)  # for `staging.read`
        data = staging.read(dtype).reshape(self.height, self.width, channels)
        staging.free()
        return data

    def _destroy(self) -> None:
        vk.vkDestroyImageView(self.device.handle, self.view, None)
        vk.vkDestroyImage(self.device.handle, self.handle, None)
        Allocator.of(self.device).give_back(self._place)

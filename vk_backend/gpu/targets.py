"""The images that a picture is drawn into."""

from __future__ import annotations

from typing import Any

from . import vk
from .constants import CONSTANTS
from .device import Device
from .memory import Buffer, Image

COLOR_FORMAT = vk.VK_FORMAT_R8G8B8A8_SRGB
DEPTH_FORMAT = vk.VK_FORMAT_D32_SFLOAT
IDS_FORMAT = vk.VK_FORMAT_R32G32_UINT
NO_ID = 0xFFFFFFFF  # both ids of a pixel without a surface
FRAGMENT_TESTS = (
    vk.VK_PIPELINE_STAGE_2_EARLY_FRAGMENT_TESTS_BIT | vk.VK_PIPELINE_STAGE_2_LATE_FRAGMENT_TESTS_BIT
)


class Targets:
    """Colour, depth and (or None) ids of a picture."""

    def __init__(self, device: Device, width: int, height: int, ids: bool):
        usage = vk.VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | vk.VK_IMAGE_USAGE_TRANSFER_SRC_BIT
        depth_usage = (
            vk.VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | vk.VK_IMAGE_USAGE_TRANSFER_SRC_BIT
        )
        self._device, self.width, self.height = device, width, height
        self.color = Image(device, width, height, COLOR_FORMAT, usage)
        self.depth = Image(device, width, height, DEPTH_FORMAT, depth_usage)
        self.ids = Image(device, width, height, IDS_FORMAT, usage) if ids else None

    def begin(self, commands: Any, *, resumed: bool = False) -> None:
        """Records the start of rendering: clears the images, or (resumed) keeps their contents."""
        colors = [self.color] + ([self.ids] if self.ids else [])
        if resumed:
            self._wait_for_pixels(commands)
        else:
            color = vk.VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL
            depth = vk.VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_OPTIMAL
            for image in colors:
                image.to_layout(commands, color, keep=False)
            self.depth.to_layout(commands, depth, keep=False)
        clear_color = vk.VkClearValue(color=vk.VkClearColorValue(float32=[0.0] * 4))
        clear_ids = vk.VkClearValue(color=vk.VkClearColorValue(uint32=[NO_ID] * 4))
        clear_depth = vk.VkClearValue(depthStencil=vk.VkClearDepthStencilValue(1.0, 0))
        attachments = [
            _attachment(image, clear, resumed)
            for image, clear in zip(colors, (clear_color, clear_ids))
        ]
        area = vk.VkRect2D(vk.VkOffset2D(0, 0), vk.VkExtent2D(self.width, self.height))
        vk.vkCmdBeginRendering(
            commands,
            vk.VkRenderingInfo(
                renderArea=area,
                layerCount=1,
                viewMask=0,
                colorAttachmentCount=len(attachments),
                pColorAttachments=attachments,
                pDepthAttachment=_attachment(self.depth, clear_depth, resumed),
            ),
        )
        vk.vkCmdSetViewport(commands, 0, 1, [vk.VkViewport(0, 0, self.width, self.height, 0, 1)])
        vk.vkCmdSetScissor(commands, 0, 1, [area])

    def _wait_for_pixels(self, commands: Any) -> None:
        """Records that later drawing sees the pixels and depths of earlier drawing."""
        color, tests = vk.VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT, FRAGMENT_TESTS
        written = (
            vk.VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT
            | vk.VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT
        )
        read = (
            vk.VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT
            | vk.VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_READ_BIT
        )
        # Within a queue, rendering again over the same images waits for nothing by itself.
        self._device.barrier(commands, color | tests, written, color | tests, written | read)

    def free(self) -> None:
        """Frees the images; a second call does nothing."""
        for image in (self.color, self.depth, self.ids):
            if image:
                image.free()


class DepthTargets(Targets):
    """Also a copy of the depths for shaders, with room for their pyramid after it."""

    def __init__(self, device: Device, width: int, height: int, ids: bool):
        super().__init__(device, width, height, ids)
        self.pixels = Buffer(device, 4 * width * height + pyramid_bytes(width, height))

    def copy_depths(self, commands: Any) -> None:
        """Records a copy of the depths, after rendering."""
        self.depth.to_layout(commands, vk.VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL)
        vk.vkCmdCopyImageToBuffer(
            commands,
            self.depth.handle,
            self.depth.layout,
            self.pixels.handle,
            1,
            [self.depth.copy_region()],
        )
        self.depth.to_layout(commands, vk.VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_OPTIMAL)

    def free(self) -> None:
        super().free()
        self.pixels.free()


def pyramid_bytes(width: int, height: int) -> int:
    """Of the depth pyramid of a picture: shaders/visibility/pyramid.glsl."""
    columns, rows = pyramid_tiles(width, height)
    return 4 * CONSTANTS["PYRAMID_FLOATS"] * columns * rows


def pyramid_tiles(width: int, height: int) -> tuple[int, int]:
    """(columns, rows)"""
    side = CONSTANTS["PYRAMID_SIDE"]
    return -(-width // side), -(-height // side)


def _attachment(image: Image, clear: Any, resumed: bool) -> Any:
    return vk.VkRenderingAttachmentInfo(
        imageView=image.view,
        imageLayout=image.layout,
        resolveMode=vk.VK_RESOLVE_MODE_NONE,
        loadOp=vk.VK_ATTACHMENT_LOAD_OP_LOAD if resumed else vk.VK_ATTACHMENT_LOAD_OP_CLEAR,
        storeOp=vk.VK_ATTACHMENT_STORE_OP_STORE,
        clearValue=clear,
    )

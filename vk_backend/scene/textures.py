"""The scene's textures as one descriptor array: set 0, binding 0."""

from __future__ import annotations

from typing import Any

import numpy as np

from gltf_ext.document import gltf

from ..gpu import vk
from ..gpu.allocator import UPLOAD
from ..gpu.device import Device, Resource
from ..gpu.memory import Buffer, Image
from ..gpu.pipelines import pipeline_layout
from .materials import Texture

FORMAT = vk.VK_FORMAT_R8G8B8A8_SRGB
WRAP = {
    gltf.REPEAT: vk.VK_SAMPLER_ADDRESS_MODE_REPEAT,
    gltf.CLAMP_TO_EDGE: vk.VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE,
    gltf.MIRRORED_REPEAT: vk.VK_SAMPLER_ADDRESS_MODE_MIRRORED_REPEAT,
}
WHITE = Texture(np.full((1, 1, 4), 255, np.uint8))  # for scenes without textures


def array_size(textures: list[Texture]) -> int:
    """Descriptors of a scene's array: a power of two, so that similar scenes share pipelines."""
    return 1 << max(len(textures) - 1, 0).bit_length()


class TextureArray(Resource):
    """Images with mip levels, their samplers, and a descriptor set of `array_size` descriptors.

    set: VkDescriptorSet. Raises VulkanError if the device takes fewer textures or smaller ones.
    """

    def __init__(self, device: Device, textures: list[Texture]):
        self._size = array_size(textures)
        layout = _set_layout(device, self._size)  # first: it checks the number
        textures = textures or [WHITE]
        self._images = [_upload(device, texture) for texture in textures]
        self._samplers = [_sampler(device, texture) for texture in textures]
        self._pool = vk.vkCreateDescriptorPool(
            device.handle,
            vk.VkDescriptorPoolCreateInfo(
                maxSets=1,
                poolSizeCount=1,
                pPoolSizes=[
                    vk.VkDescriptorPoolSize(
                        type=vk.VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                        descriptorCount=self._size,
                    )
                ],
            ),
            None,
        )
        self.set = vk.vkAllocateDescriptorSets(
            device.handle,
            vk.VkDescriptorSetAllocateInfo(
                descriptorPool=self._pool,
                descriptorSetCount=1,
                pSetLayouts=[layout],
            ),
        )[0]
        self.register(device)
        self._write()

    def _write(self) -> None:
        infos = [
            vk.VkDescriptorImageInfo(
                sampler=sampler, imageView=image.view, imageLayout=image.layout
            )
            for sampler, image in zip(self._samplers, self._images)
        ]
        infos += infos[:1] * (self._size - len(infos))  # every descriptor must be valid
        write = vk.VkWriteDescriptorSet(
            dstSet=self.set,
            dstBinding=0,
            dstArrayElement=0,
            descriptorCount=len(infos),
            descriptorType=vk.VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
            pImageInfo=infos,
        )
        vk.vkUpdateDescriptorSets(self.device.handle, 1, [write], 0, None)

    def _destroy(self) -> None:
        vk.vkDestroyDescriptorPool(self.device.handle, self._pool, None)
        for image in self._images:
            image.free()


def textures_layout(device: Device, count: int) -> Any:
    """The device's pipeline layout with an array of `count` textures and push constants."""
    return device.once(
        ("layout", count), lambda: pipeline_layout(device, [_set_layout(device, count)])
    )


def _set_layout(device: Device, count: int) -> Any:
    """The device's VkDescriptorSetLayout of `count` textures."""
    return device.once(("textures", count), lambda: _make_set_layout(device, count))


def _make_set_layout(device: Device, count: int) -> Any:
    device.limits.check_textures(count)
    binding = vk.VkDescriptorSetLayoutBinding(
        binding=0,
        descriptorType=vk.VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
        descriptorCount=count,
        stageFlags=vk.VK_SHADER_STAGE_ALL,
    )
    layout = vk.vkCreateDescriptorSetLayout(
        device.handle, vk.VkDescriptorSetLayoutCreateInfo(bindingCount=1, pBindings=[binding]), None
    )
    device.at_close(lambda: vk.vkDestroyDescriptorSetLayout(device.handle, layout, None))
    return layout


def _sampler(device: Device, texture: Texture) -> Any:
    """The device's VkSampler for textures that wrap and are filtered so: one of 18."""
    u, v = (WRAP.get(wrap, vk.VK_SAMPLER_ADDRESS_MODE_REPEAT) for wrap in texture.wrap)
    nearest = texture.nearest
    return device.once(("sampler", u, v, nearest), lambda: _make_sampler(device, u, v, nearest))


def _make_sampler(device: Device, u: int, v: int, nearest: bool) -> Any:
    sampler = vk.vkCreateSampler(
        device.handle,
        vk.VkSamplerCreateInfo(
            magFilter=vk.VK_FILTER_NEAREST if nearest else vk.VK_FILTER_LINEAR,
            minFilter=vk.VK_FILTER_LINEAR,
            mipmapMode=vk.VK_SAMPLER_MIPMAP_MODE_LINEAR,
            addressModeU=u,
            addressModeV=v,
            addressModeW=u,
            maxLod=vk.VK_LOD_CLAMP_NONE,
        ),
        None,
    )
    device.at_close(lambda: vk.vkDestroySampler(device.handle, sampler, None))
    return sampler


def _upload(device: Device, texture: Texture) -> Image:
    """An image with all mip levels, ready to be sampled. Each level is half of the one before."""
    height, width = texture.pixels.shape[:2]
    levels = max(width, height).bit_length()
    usage = (
        vk.VK_IMAGE_USAGE_SAMPLED_BIT
        | vk.VK_IMAGE_USAGE_TRANSFER_DST_BIT
        | vk.VK_IMAGE_USAGE_TRANSFER_SRC_BIT
    )
    image = Image(device, width, height, FORMAT, usage, levels=levels)
    staging = Buffer(
        device, texture.pixels.nbytes, vk.VK_BUFFER_USAGE_TRANSFER_SRC_BIT, UPLOAD
    ).write(texture.pixels)
    with device.commands() as commands:
        image.to_layout(commands, vk.VK_IMAGE_LAYOUT_GENERAL)
        vk.vkCmdCopyBufferToImage(
            commands, staging.handle, image.handle, image.layout, 1, [image.copy_region()]
        )
        for level in range(1, levels):
            # A level is made from the one before it.
            device.full_barrier(commands)
            source, target = (image.copy_region(at) for at in (level - 1, level))
            region = vk.VkImageBlit(
                srcSubresource=source.imageSubresource,
                srcOffsets=_corners(source.imageExtent),
                dstSubresource=target.imageSubresource,
                dstOffsets=_corners(target.imageExtent),
            )
            vk.vkCmdBlitImage(
                commands,
                image.handle,
                image.layout,
                image.handle,
                image.layout,
                1,
                [region],
                vk.VK_FILTER_LINEAR,
            )
        image.to_layout(commands, vk.VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL)
    staging.free()
    return image


def _corners(extent: Any) -> list[Any]:
    """The first and last corner of a level."""
    return [vk.VkOffset3D(0, 0, 0), vk.VkOffset3D(extent.width, extent.height, 1)]

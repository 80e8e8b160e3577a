"""Decodes a compressed .glb on the GPU: python decode.py SHADER.spv MODEL.glb

The host of decode.comp and decode.hlsl. It takes instance, device and memory from vk_backend; an
engine has its own. SHADER.spv comes from one of these (decode.slang: a copy of decode.hlsl):

    glslangValidator -V --target-env vulkan1.1 -I.. decode.comp -o decode.spv
    dxc -spirv -T cs_6_0 -E main -I .. decode.hlsl -Fo decode.spv
    slangc decode.slang -target spirv -profile sm_6_0 -entry main -stage compute -I.. -o decode.spv
"""

from __future__ import annotations

import json
import struct
import sys
from pathlib import Path

import numpy as np

from gltf_ext import _codec
from vk_backend.gpu import vk
from vk_backend.gpu.device import Device
from vk_backend.gpu.memory import Buffer
from vk_backend.gpu.pipelines import pipeline_layout, push

GROUP = 32  # threads of a workgroup: local_size_x, numthreads
MAX_STREAMS, MAX_ELEMENTS = 8, 20  # as in the shader
BUFFER = vk.VK_DESCRIPTOR_TYPE_STORAGE_BUFFER
COMPUTE = vk.VK_SHADER_STAGE_COMPUTE_BIT
EXTENSION = "EXT_meshlet_edgebreaker"
TRANSPORT = "EXT_meshlet_transport"


def blobs_of(glb: bytes) -> list[bytes]:
    """The blobs of all compressed primitives. Raises ValueError if one is malformed."""
    (length,) = struct.unpack_from("<I", glb, 12)
    gltf = json.loads(glb[20 : 20 + length])
    blobs = []
    for mesh in gltf["meshes"]:
        for primitive in mesh["primitives"]:
            number = primitive["extensions"][EXTENSION]["bufferView"]
            place = gltf["bufferViews"][number]
            begin = 28 + length + place.get("byteOffset", 0)
            view = glb[begin : begin + place["byteLength"]]
            if TRANSPORT in place.get("extensions", {}):
                view = _codec.unpack(view)
            # Checks headers and tables, which the shader trusts.
            blobs += [view[at : at + size] for at, size in _codec.split(view)]
    return blobs


class GpuDecoder:
    """A compute pipeline with storage buffers at bindings 0 to 3 and push constants."""

    def __init__(self, device: Device, code: bytes):
        self.device, handle = device, device.handle
        bindings = [
            vk.VkDescriptorSetLayoutBinding(
                binding=i, descriptorType=BUFFER, descriptorCount=1, stageFlags=COMPUTE
            )
            for i in range(4)
        ]
        information = vk.VkDescriptorSetLayoutCreateInfo(bindingCount=4, pBindings=bindings)
        set_layout = vk.vkCreateDescriptorSetLayout(handle, information, None)
        device.at_close(lambda: vk.vkDestroyDescriptorSetLayout(handle, set_layout, None))
        self._layout = pipeline_layout(device, [set_layout])
        size = vk.VkDescriptorPoolSize(type=BUFFER, descriptorCount=4)
        information = vk.VkDescriptorPoolCreateInfo(maxSets=1, poolSizeCount=1, pPoolSizes=[size])
        pool = vk.vkCreateDescriptorPool(handle, information, None)
        device.at_close(lambda: vk.vkDestroyDescriptorPool(handle, pool, None))
        information = vk.VkDescriptorSetAllocateInfo(
            descriptorPool=pool, descriptorSetCount=1, pSetLayouts=[set_layout]
        )
        (self._set,) = vk.vkAllocateDescriptorSets(handle, information)
        information = vk.VkShaderModuleCreateInfo(codeSize=len(code), pCode=code)
        module = vk.vkCreateShaderModule(handle, information, None)
        stage = vk.VkPipelineShaderStageCreateInfo(stage=COMPUTE, module=module, pName="main")
        information = vk.VkComputePipelineCreateInfo(stage=stage, layout=self._layout)
        (self._pipeline,) = vk.vkCreateComputePipelines(handle, None, 1, [information], None)
        device.at_close(lambda: vk.vkDestroyPipeline(handle, self._pipeline, None))
        vk.vkDestroyShaderModule(handle, module, None)

    def decode(self, blob: bytes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Decodes all M meshlets of a blob.

        Returns (summaries: uint32[M], triangles: uint32[M, 64], integers: uint32[M, elements, 64]):
        see docs/shaders.md. Raises ValueError if the header is malformed, or if the shader lacks
        room for the streams.
        """
        table = _codec.Decoder(blob)
        meshlets, streams = table.meshlet_count, len(table.streams)
        elements = sum(stream.elements for stream in table.streams)
        if streams > MAX_STREAMS or elements > MAX_ELEMENTS:
            raise ValueError(f"there is no room for {streams} streams of {elements} elements")
        sizes = (len(blob), 4 * meshlets, 256 * meshlets, 256 * elements * meshlets)
        buffers = [Buffer(self.device, size) for size in sizes]
        buffers[0].write(blob)
        job = np.array([len(blob) // 4, meshlets, streams, elements], np.uint32)
        self._dispatch(buffers, job, -(-meshlets // GROUP))
        summaries, triangles, integers = (buffer.read() for buffer in buffers[1:])
        for buffer in buffers:
            buffer.free()
        return summaries, triangles.reshape(-1, 64), integers.reshape(-1, elements, 64)

    def _dispatch(self, buffers: list[Buffer], job: np.ndarray, groups: int) -> None:
        for i, buffer in enumerate(buffers):
            place = vk.VkDescriptorBufferInfo(buffer=buffer.handle, range=buffer.size)
            write = vk.VkWriteDescriptorSet(
                dstSet=self._set,
                dstBinding=i,
                descriptorCount=1,
                descriptorType=BUFFER,
                pBufferInfo=[place],
            )
            vk.vkUpdateDescriptorSets(self.device.handle, 1, [write], 0, None)
        point = vk.VK_PIPELINE_BIND_POINT_COMPUTE
        with self.device.commands() as commands:
            vk.vkCmdBindPipeline(commands, point, self._pipeline)
            vk.vkCmdBindDescriptorSets(commands, point, self._layout, 0, 1, [self._set], 0, None)
            push(commands, self._layout, job)
            vk.vkCmdDispatch(commands, groups, 1, 1)


def main(shader: str, model: str) -> None:
    code = Path(shader).read_bytes()
    with Device() as device:
        decoder = GpuDecoder(device, code)
        for blob in blobs_of(Path(model).read_bytes()):
            summaries, _, _ = decoder.decode(blob)
            malformed = int((summaries >> 16 != 0).sum())
            triangles = int((summaries & 255).sum())
            print(f"{len(summaries)} meshlets, {triangles} triangles, {malformed} malformed")


if __name__ == "__main__":
    main(*sys.argv[1:])

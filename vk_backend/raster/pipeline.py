"""The graphics pipelines of the raster paths."""

from __future__ import annotations

from typing import Any

from ..gpu import vk
from ..gpu.device import Device
from ..gpu.pipelines import Compiler, Pipeline, stage
from ..gpu.targets import COLOR_FORMAT, DEPTH_FORMAT, IDS_FORMAT
from ..scene.decoded import VERTEX_FLOATS
from ..scene.textures import textures_layout

MESH = vk.VK_SHADER_STAGE_MESH_BIT_EXT
TASK = vk.VK_SHADER_STAGE_TASK_BIT_EXT
VERTEX = vk.VK_SHADER_STAGE_VERTEX_BIT
GEOMETRY = vk.VK_SHADER_STAGE_GEOMETRY_BIT
FRAGMENT = vk.VK_SHADER_STAGE_FRAGMENT_BIT

# (module, VkShaderStageFlagBits) of each stage.
Modules = tuple[tuple[str, int], ...]


def graphics_pipeline(
    device: Device, modules: Modules, constants: dict[str, int], textures: int, ids: bool
) -> Pipeline:
    """The device's pipeline; made on first use.

    constants: specialisation constants by name; textures: size of the descriptor array; ids: draw
    ids, too.
    """
    pipeline: Pipeline = device.once(
        (modules, *constants.items(), textures, ids),
        lambda: _make_pipeline(device, modules, constants, textures, ids),
    )
    return pipeline


def _make_pipeline(
    device: Device, modules: Modules, constants: dict[str, int], textures: int, ids: bool
) -> Pipeline:
    stages = [stage(device, name, bit, constants) for name, bit in modules]
    formats = [COLOR_FORMAT] + ([IDS_FORMAT] if ids else [])
    kinds = {bit for _, bit in modules}
    indexed = kinds == {VERTEX, FRAGMENT}
    topology = (
        vk.VK_PRIMITIVE_TOPOLOGY_POINT_LIST
        if GEOMETRY in kinds
        else vk.VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST
    )
    blend = [
        vk.VkPipelineColorBlendAttachmentState(blendEnable=0, colorWriteMask=0xF) for _ in formats
    ]
    dynamic = [
        vk.VK_DYNAMIC_STATE_VIEWPORT, vk.VK_DYNAMIC_STATE_SCISSOR,
        vk.VK_DYNAMIC_STATE_CULL_MODE, vk.VK_DYNAMIC_STATE_FRONT_FACE,
    ]  # fmt: skip
    info = vk.VkGraphicsPipelineCreateInfo(
        pNext=vk.VkPipelineRenderingCreateInfo(
            viewMask=0,
            colorAttachmentCount=len(formats),
            pColorAttachmentFormats=formats,
            depthAttachmentFormat=DEPTH_FORMAT,
            stencilAttachmentFormat=vk.VK_FORMAT_UNDEFINED,
        ),
        stageCount=len(stages),
        pStages=stages,
        pVertexInputState=_vertex_input(constants["ATTRIBUTES"])
        if indexed
        else vk.VkPipelineVertexInputStateCreateInfo(),
        pInputAssemblyState=vk.VkPipelineInputAssemblyStateCreateInfo(topology=topology),
        pViewportState=vk.VkPipelineViewportStateCreateInfo(viewportCount=1, scissorCount=1),
        pRasterizationState=vk.VkPipelineRasterizationStateCreateInfo(
            polygonMode=vk.VK_POLYGON_MODE_FILL, lineWidth=1.0
        ),
        pMultisampleState=vk.VkPipelineMultisampleStateCreateInfo(
            rasterizationSamples=vk.VK_SAMPLE_COUNT_1_BIT
        ),
        pDepthStencilState=vk.VkPipelineDepthStencilStateCreateInfo(
            depthTestEnable=1, depthWriteEnable=1, depthCompareOp=vk.VK_COMPARE_OP_LESS
        ),
        pColorBlendState=vk.VkPipelineColorBlendStateCreateInfo(
            attachmentCount=len(blend), pAttachments=blend
        ),
        pDynamicState=vk.VkPipelineDynamicStateCreateInfo(
            dynamicStateCount=len(dynamic), pDynamicStates=dynamic
        ),
        layout=textures_layout(device, textures),
    )
    return Compiler.of(device).start(vk.vkCreateGraphicsPipelines, info, stages)


FLOAT_FORMATS = {
    2: vk.VK_FORMAT_R32G32_SFLOAT,
    3: vk.VK_FORMAT_R32G32B32_SFLOAT,
    4: vk.VK_FORMAT_R32G32B32A32_SFLOAT,
}


def _vertex_input(scene_attributes: int) -> Any:
    """Interleaved floats: the position, then the attributes (HAS_) that the scene has."""
    attributes, at = [_input(0, vk.VK_FORMAT_R32G32B32_SFLOAT, 0)], 12
    for location, (bit, floats) in enumerate(VERTEX_FLOATS, start=1):
        # The shader declares all attributes but reads only the scene's: others may have any format.
        there = bool(scene_attributes & bit)
        attributes.append(
            _input(
                location,
                FLOAT_FORMATS[floats] if there else vk.VK_FORMAT_R32_SFLOAT,
                at if there else 0,
            )
        )
        at += 4 * floats if there else 0
    binding = vk.VkVertexInputBindingDescription(
        binding=0, stride=at, inputRate=vk.VK_VERTEX_INPUT_RATE_VERTEX
    )
    return vk.VkPipelineVertexInputStateCreateInfo(
        vertexBindingDescriptionCount=1,
        pVertexBindingDescriptions=[binding],
        vertexAttributeDescriptionCount=len(attributes),
        pVertexAttributeDescriptions=attributes,
    )


def _input(location: int, format: int, offset: int) -> Any:
    return vk.VkVertexInputAttributeDescription(
        location=location, binding=0, format=format, offset=offset
    )

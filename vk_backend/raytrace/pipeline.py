"""Ray-tracing pipelines and their shader binding tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..gpu import vk
from ..gpu.device import Device
from ..gpu.memory import STORAGE, Buffer
from ..gpu.pipelines import stage

SHADER_GROUPS = 3  # ray generation, miss, hit
STAGES = {
    "rgen": vk.VK_SHADER_STAGE_RAYGEN_BIT_KHR,
    "rmiss": vk.VK_SHADER_STAGE_MISS_BIT_KHR,
    "rchit": vk.VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR,
    "rahit": vk.VK_SHADER_STAGE_ANY_HIT_BIT_KHR,
    "rint": vk.VK_SHADER_STAGE_INTERSECTION_BIT_KHR,
}
ROLES = ("generalShader", "closestHitShader", "anyHitShader", "intersectionShader")


class RayPipeline:
    """A ray-tracing pipeline and its shader binding table.

    hit: ROLES -> module, of the shaders of a hit. constants: specialisation constants. layout:
    VkPipelineLayout for `textures` textures. Equal pipelines of a device are shared.
    """

    def __init__(
        self,
        device: Device,
        hit: dict[str, str],
        *,
        constants: dict[str, int],
        layout: Any,
        textures: int,
    ):
        self._device = device
        groups = ({"generalShader": "rt_camera.rgen"}, {"generalShader": "rt_miss.rmiss"}, hit)
        key = (*hit.values(), textures, *sorted(constants.items()))
        self.handle = device.once(key, lambda: _make(device, groups, constants, layout))
        self.table, self.regions = self._binding_table()

    def _binding_table(self) -> tuple[Buffer, list[Any]]:
        """(shader binding table with a handle per shader group, its four regions)"""
        limits = self._device.limits
        size = limits.handle_bytes
        step = -(-size // limits.base_alignment) * limits.base_alignment
        handles = vk.ffi.new(f"char[{size * SHADER_GROUPS}]")
        get = self._device.function("vkGetRayTracingShaderGroupHandlesKHR")
        get(self._device.handle, self.handle, 0, SHADER_GROUPS, size * SHADER_GROUPS, handles)
        raw = bytes(vk.ffi.buffer(handles))
        usage = STORAGE | vk.VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR
        table = Buffer(self._device, step * (SHADER_GROUPS + 1), usage)
        begin = -(-table.address // step) * step
        data = b"".join(
            raw[size * i : size * (i + 1)].ljust(step, b"\0") for i in range(SHADER_GROUPS)
        )
        table.write(data, begin - table.address)
        regions = [
            vk.VkStridedDeviceAddressRegionKHR(
                deviceAddress=begin + step * i, stride=step, size=step
            )
            for i in range(SHADER_GROUPS)
        ]
        return table, [*regions, vk.VkStridedDeviceAddressRegionKHR()]


def _make(
    device: Device, groups: Sequence[dict[str, str]], constants: dict[str, int], layout: Any
) -> Any:
    """The VkPipeline of shader groups: ROLES -> module."""
    names = [name for group in groups for name in group.values()]
    stages = [stage(device, name, STAGES[name.split(".")[1]], constants) for name in names]
    unused = dict.fromkeys(ROLES, vk.VK_SHADER_UNUSED_KHR)
    described = [
        vk.VkRayTracingShaderGroupCreateInfoKHR(
            sType=vk.VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR,
            type=_group_type(group),
            **{**unused, **{role: names.index(name) for role, name in group.items()}},
        )
        for group in groups
    ]
    info = vk.VkRayTracingPipelineCreateInfoKHR(
        sType=vk.VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR,
        stageCount=len(stages),
        pStages=stages,
        groupCount=len(described),
        pGroups=described,
        maxPipelineRayRecursionDepth=1,
        layout=layout,
    )
    create = device.function("vkCreateRayTracingPipelinesKHR")
    pipeline = create(device.handle, None, None, 1, [info], None)[0]
    device.at_close(lambda: vk.vkDestroyPipeline(device.handle, pipeline, None))
    return pipeline


def _group_type(group: dict[str, str]) -> int:
    """VkRayTracingShaderGroupTypeKHR"""
    if "generalShader" in group:
        return int(vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR)
    if "intersectionShader" in group:
        return int(vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_KHR)
    return int(vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR)

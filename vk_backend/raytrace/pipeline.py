"""Ray-tracing pipelines and their shader binding tables."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from ..gpu import vk
from ..gpu.device import Device
from ..gpu.memory import STORAGE, Buffer
from ..gpu.pipelines import Compiler, Pipeline, stage
from ..scene.view import SceneView

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
    """A ray-tracing pipeline and its shader binding table. Equal pipelines are shared.

    hit: ROLES -> module, of the shaders of a hit; that of any hit is left out where no material can
    be transparent. constants: specialisation constants.
    """

    def __init__(self, view: SceneView, hit: dict[str, str], constants: dict[str, int]):
        device = self._device = view.device
        if not view.scene.any_masked:
            hit = {role: module for role, module in hit.items() if role != "anyHitShader"}
        groups = ({"generalShader": "rt_camera.rgen"}, {"generalShader": "rt_miss.rmiss"}, hit)
        key = (*hit.values(), view.textures, *sorted(constants.items()))
        self._pipeline: Pipeline = device.once(
            key, lambda: _make(device, groups, constants, view.layout)
        )

    @property
    def handle(self) -> Any:
        """The VkPipeline; waits for it."""
        return self._pipeline.handle

    @cached_property
    def table(self) -> Buffer:
        """The shader binding table with a handle per shader group; waits for the pipeline."""
        size, step = self._device.limits.handle_bytes, self._step
        handles = vk.ffi.new(f"char[{size * SHADER_GROUPS}]")
        get = self._device.function("vkGetRayTracingShaderGroupHandlesKHR")
        get(self._device.handle, self.handle, 0, SHADER_GROUPS, size * SHADER_GROUPS, handles)
        raw = bytes(vk.ffi.buffer(handles))
        usage = STORAGE | vk.VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR
        table = Buffer(self._device, step * (SHADER_GROUPS + 1), usage)
        data = b"".join(
            raw[size * i : size * (i + 1)].ljust(step, b"\0") for i in range(SHADER_GROUPS)
        )
        table.write(data, -table.address % step)
        return table

    @cached_property
    def regions(self) -> list[Any]:
        """The table's four regions, of which callable shaders have none."""
        step = self._step
        begin = -(-self.table.address // step) * step
        regions = [
            vk.VkStridedDeviceAddressRegionKHR(
                deviceAddress=begin + step * i, stride=step, size=step
            )
            for i in range(SHADER_GROUPS)
        ]
        return [*regions, vk.VkStridedDeviceAddressRegionKHR()]

    @property
    def _step(self) -> int:
        """Bytes from one handle to the next."""
        limits = self._device.limits
        return -(-limits.handle_bytes // limits.base_alignment) * limits.base_alignment


def _make(
    device: Device, groups: Sequence[dict[str, str]], constants: dict[str, int], layout: Any
) -> Pipeline:
    """The pipeline of shader groups: ROLES -> module."""
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
    function = device.function("vkCreateRayTracingPipelinesKHR")

    def create(handle: Any, cache: Any, *rest: Any) -> Any:
        return function(handle, None, cache, *rest)  # None: the call itself creates it

    return Compiler.of(device).start(create, info, stages, described)


def _group_type(group: dict[str, str]) -> int:
    """VkRayTracingShaderGroupTypeKHR"""
    if "generalShader" in group:
        return int(vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR)
    if "intersectionShader" in group:
        return int(vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_KHR)
    return int(vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR)

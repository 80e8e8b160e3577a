"""Ray-tracing pipelines and their shader binding tables."""

from __future__ import annotations

from typing import Any

from . import vk
from .device import Device
from .memory import STORAGE, Buffer
from .pipelines import stage

SHADER_GROUPS = 3  # of a pipeline: ray generation, miss, hit
# Path -> what the names of its hit shaders end in; the intersection shader.
HIT_SHADERS: dict[str, tuple[str, str | None]] = {
    "rt": ("", "rt_meshlets.rint"),
    "rt-paper": ("_paper", "rt_paper.rint"),
    "rt-plain": ("_plain", "rt_plain.rint"),
    "rt-triangles": ("_triangles", None),
}


class RayPipeline:
    """A pipeline with three shader groups: ray generation, miss, hit; and its binding table.

    any_masked: with the any-hit shader. shading, positions: specialisation constants of the
    shaders, and of those that decode positions only. layout: VkPipelineLayout. Equal ones of a
    device share the pipeline; key: what they have to have in common besides.
    """

    def __init__(
        self,
        device: Device,
        path: str,
        *,
        any_masked: bool,
        shading: dict[str, int],
        positions: dict[str, int],
        layout: Any,
        key: tuple[Any, ...],
    ):
        self._device, self._layout = device, layout
        suffix, intersection = HIT_SHADERS[path]
        parts: list[tuple[str, str, int, dict[str, int]]] = [
            ("", "rt_camera.rgen", vk.VK_SHADER_STAGE_RAYGEN_BIT_KHR, shading),
            ("", "rt_miss.rmiss", vk.VK_SHADER_STAGE_MISS_BIT_KHR, shading),
            (
                "closestHitShader",
                f"rt_surface{suffix}.rchit",
                vk.VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR,
                shading,
            ),
        ]
        if intersection:
            bit = vk.VK_SHADER_STAGE_INTERSECTION_BIT_KHR
            parts.append(("intersectionShader", intersection, bit, positions))
        if any_masked:
            bit = vk.VK_SHADER_STAGE_ANY_HIT_BIT_KHR
            parts.append(("anyHitShader", f"rt_alpha{suffix}.rahit", bit, shading))
        key = (path, any_masked, device.pipeline_flags, *key, *sorted(shading.items()))
        self.handle = device.once(key, lambda: self._make(parts, bool(intersection)))
        self.table, self.regions = self._binding_table()

    def _make(self, parts: list[tuple[str, str, int, dict[str, int]]], boxes: bool) -> Any:
        device, unused = self._device, vk.VK_SHADER_UNUSED_KHR
        roles = ("closestHitShader", "anyHitShader", "intersectionShader")
        hit = {**dict.fromkeys(roles, unused), **{p[0]: i for i, p in enumerate(parts) if p[0]}}
        kind = (
            vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_KHR
            if boxes
            else vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR
        )
        general = vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR
        groups = [
            vk.VkRayTracingShaderGroupCreateInfoKHR(
                sType=vk.VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR,
                type=type_,
                generalShader=number,
                **own,
            )
            for type_, number, own in (
                (general, 0, dict.fromkeys(roles, unused)),
                (general, 1, dict.fromkeys(roles, unused)),
                (kind, unused, hit),
            )
        ]
        stages = [stage(device, name, bit, constants) for _, name, bit, constants in parts]
        info = vk.VkRayTracingPipelineCreateInfoKHR(
            sType=vk.VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR,
            flags=device.pipeline_flags,
            stageCount=len(stages),
            pStages=stages,
            groupCount=SHADER_GROUPS,
            pGroups=groups,
            maxPipelineRayRecursionDepth=1,
            layout=self._layout,
        )
        pipeline = device.function("vkCreateRayTracingPipelinesKHR")(
            device.handle, None, None, 1, [info], None
        )[0]
        device.at_close(lambda: vk.vkDestroyPipeline(device.handle, pipeline, None))
        return pipeline

    def _binding_table(self) -> tuple[Buffer, list[Any]]:
        """(shader binding table with a handle per group, its four regions)"""
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

"""Pipelines from the package's SPIR-V, and the timing of what they run."""

from __future__ import annotations

from importlib import resources

import numpy as np
import vulkan as vk

from .device import Device

PUSH_BYTES = 128  # what every device has


def shader_module(device: Device, name: str):
    """The module of spirv/<name>.spv; freed with the device."""
    code = (resources.files(__package__) / "spirv" / f"{name}.spv").read_bytes()
    module = vk.vkCreateShaderModule(
        device.handle, vk.VkShaderModuleCreateInfo(codeSize=len(code), pCode=code), None
    )
    device.at_close(lambda: vk.vkDestroyShaderModule(device.handle, module, None))
    return module


def stage(device: Device, name: str, bit: int, constants: dict[int, int] | None = None):
    """A pipeline stage with specialisation constants (constant id -> 32-bit unsigned value)."""
    special = None
    if constants:
        data = vk.ffi.new("uint32_t[]", list(constants.values()))
        device.at_close(lambda: vk.ffi.release(data))  # the structures below do not keep it alive
        entries = [
            vk.VkSpecializationMapEntry(constantID=id, offset=4 * i, size=4)
            for i, id in enumerate(constants)
        ]
        special = vk.VkSpecializationInfo(
            mapEntryCount=len(entries), pMapEntries=entries, dataSize=4 * len(constants), pData=data
        )
    return vk.VkPipelineShaderStageCreateInfo(
        stage=bit, module=shader_module(device, name), pName="main", pSpecializationInfo=special
    )


def pipeline_layout(device: Device, sets: list | None = None):
    """A layout with the descriptor set layouts `sets` and PUSH_BYTES of push constants for all stages; freed with the device."""
    ranges = [vk.VkPushConstantRange(stageFlags=vk.VK_SHADER_STAGE_ALL, offset=0, size=PUSH_BYTES)]
    layout = vk.vkCreatePipelineLayout(
        device.handle,
        vk.VkPipelineLayoutCreateInfo(
            setLayoutCount=len(sets or []),
            pSetLayouts=sets or [],
            pushConstantRangeCount=1,
            pPushConstantRanges=ranges,
        ),
        None,
    )
    device.at_close(lambda: vk.vkDestroyPipelineLayout(device.handle, layout, None))
    return layout


def push(commands, layout, data: np.ndarray) -> None:
    """Sets the push constants to the array's bytes."""
    raw = np.ascontiguousarray(data).tobytes()
    vk.vkCmdPushConstants(
        commands, layout, vk.VK_SHADER_STAGE_ALL, 0, len(raw), vk.ffi.from_buffer(raw)
    )


MAX_GROUPS = 65535  # workgroups in one dimension of a dispatch or draw that every device allows


class ComputePipeline:
    """A compute shader with specialisation constants by id."""

    @classmethod
    def of(cls, device: Device, name: str, constants: dict[int, int]) -> "ComputePipeline":
        """The device's pipeline of a module and constants, made when it is first asked for."""
        key = (name, device.pipeline_flags, *sorted(constants.items()))
        return device.once(key, lambda: cls(device, name, constants))

    def __init__(self, device: Device, name: str, constants: dict[int, int]):
        self.device, self.layout = device, pipeline_layout(device)
        shader = stage(
            device, name, vk.VK_SHADER_STAGE_COMPUTE_BIT, constants
        )  # must outlive the call
        info = vk.VkComputePipelineCreateInfo(
            flags=device.pipeline_flags, stage=shader, layout=self.layout
        )
        self.handle = vk.vkCreateComputePipelines(device.handle, None, 1, [info], None)[0]
        device.at_close(lambda: vk.vkDestroyPipeline(device.handle, self.handle, None))

    def dispatch(self, commands, groups: int, data: np.ndarray, rows: int = 1) -> None:
        """Records `groups` x `rows` workgroups with `data` as push constants."""
        vk.vkCmdBindPipeline(commands, vk.VK_PIPELINE_BIND_POINT_COMPUTE, self.handle)
        push(commands, self.layout, data)
        vk.vkCmdDispatch(commands, groups, rows, 1)


class Timestamps:
    """`count` places in a command buffer whose times are asked for afterwards."""

    def __init__(self, device: Device, count: int):
        self.device, self.count = device, count
        self._pool = vk.vkCreateQueryPool(
            device.handle,
            vk.VkQueryPoolCreateInfo(queryType=vk.VK_QUERY_TYPE_TIMESTAMP, queryCount=count),
            None,
        )
        device.at_close(lambda: vk.vkDestroyQueryPool(device.handle, self._pool, None))

    def reset(self, commands) -> None:
        """To be recorded before the first mark."""
        vk.vkCmdResetQueryPool(commands, self._pool, 0, self.count)

    def mark(self, commands, index: int) -> None:
        """The time when all that was recorded before has run."""
        vk.vkCmdWriteTimestamp2(
            commands, vk.VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, self._pool, index
        )

    def milliseconds(self) -> np.ndarray:
        """float64[count - 1]: the time from each mark to the next, of the last run."""
        raw = np.zeros(self.count, np.uint64)
        flags = vk.VK_QUERY_RESULT_64_BIT | vk.VK_QUERY_RESULT_WAIT_BIT
        vk.vkGetQueryPoolResults(
            self.device.handle,
            self._pool,
            0,
            self.count,
            raw.nbytes,
            vk.ffi.cast("void *", raw.ctypes.data),
            8,
            flags,
        )
        return np.diff(raw.astype(np.int64)) * self.device.limits.timestamp_ns / 1e6

"""The driver's statistics of a compiled pipeline: registers, stack, shared memory."""

from __future__ import annotations

from typing import Any

from vk_backend import vk
from vk_backend.device import Device


def capture_statistics(device: Device) -> bool:
    """Has the driver keep statistics of pipelines made from now on; False if it cannot."""
    if "statistics" not in device.capabilities:
        return False
    device.pipeline_flags |= vk.VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR
    return True


def pipeline_statistics(device: Device, pipeline: Any) -> dict[str, dict[str, float]]:
    """Executable -> statistic -> value, with the driver's names.

    Empty without capture_statistics.
    """
    if not device.pipeline_flags & vk.VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR:
        return {}
    properties = device.function("vkGetPipelineExecutablePropertiesKHR")
    statistics = device.function("vkGetPipelineExecutableStatisticsKHR")
    executables = properties(device.handle, vk.VkPipelineInfoKHR(pipeline=pipeline))
    found: dict[str, dict[str, float]] = {}
    for index, executable in enumerate(executables):
        info = vk.VkPipelineExecutableInfoKHR(pipeline=pipeline, executableIndex=index)
        found[_text(executable.name)] = {
            _text(s.name): _value(s) for s in statistics(device.handle, info)
        }
    return found


def _text(name: Any) -> str:
    return name if isinstance(name, str) else vk.ffi.string(name).decode(errors="replace")


def _value(statistic: Any) -> float:
    kinds = {
        vk.VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_BOOL32_KHR: "b32",
        vk.VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_INT64_KHR: "i64",
        vk.VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_UINT64_KHR: "u64",
    }
    return float(getattr(statistic.value, kinds.get(statistic.format, "f64")))

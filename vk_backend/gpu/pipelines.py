"""Pipelines from the package's SPIR-V, push constants, and timestamps."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from importlib import resources
from typing import Any

import numpy as np

from . import vk
from .device import Device, Resource
from .limits import PUSH_BYTES
from .memory import Buffer
from .pipeline_cache import PipelineCache
from .reflection import specialization_ids, split_name


def shader_module(device: Device, name: str) -> Any:
    """The module of spirv/NAME.spv; freed with the device. name: see reflection.split_name."""
    package, file = split_name(name)
    code = (resources.files(package) / "spirv" / f"{file}.spv").read_bytes()
    module = vk.vkCreateShaderModule(
        device.handle, vk.VkShaderModuleCreateInfo(codeSize=len(code), pCode=code), None
    )
    device.at_close(lambda: vk.vkDestroyShaderModule(device.handle, module, None))
    return module


def stage(device: Device, name: str, bit: int, constants: Mapping[str, int]) -> Any:
    """A pipeline stage: VkPipelineShaderStageCreateInfo.

    constants: specialisation constants, name -> 32-bit unsigned value. Those that this shader lacks
    are ignored, so that all stages of a pipeline can take the same constants; ValueError for names
    that no shader has.
    """
    values = specialization_ids(name, constants)
    data = vk.ffi.new("uint32_t[]", list(values.values()))
    device.at_close(lambda: vk.ffi.release(data))  # VkSpecializationInfo does not keep it alive
    entries = [
        vk.VkSpecializationMapEntry(constantID=identifier, offset=4 * i, size=4)
        for i, identifier in enumerate(values)
    ]
    return vk.VkPipelineShaderStageCreateInfo(
        stage=bit,
        module=shader_module(device, name),
        pName="main",
        pSpecializationInfo=vk.VkSpecializationInfo(
            mapEntryCount=len(entries), pMapEntries=entries, dataSize=4 * len(values), pData=data
        ),
    )


def pipeline_layout(device: Device, sets: list[Any] | None = None) -> Any:
    """A layout with PUSH_BYTES of push constants for all stages; freed with the device.

    sets: descriptor set layouts.
    """
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


def push_record(dtype: np.dtype, **fields: Any) -> np.ndarray:
    """dtype[()] with the given fields; all others are 0."""
    record = np.zeros((), dtype)
    for name, value in fields.items():
        record[name] = value
    return record


def addresses(dtype: np.dtype, buffers: Mapping[str, Buffer]) -> dict[str, int]:
    """The addresses of the buffers that have the name of a field."""
    return {name: b.address for name, b in buffers.items() if name in (dtype.names or ())}


def push(commands: Any, layout: Any, data: np.ndarray) -> None:
    """Sets the push constants to the array's bytes."""
    raw = np.ascontiguousarray(data).tobytes()
    vk.vkCmdPushConstants(
        commands, layout, vk.VK_SHADER_STAGE_ALL, 0, len(raw), vk.ffi.from_buffer(raw)
    )


class Compiler:
    """Creates a device's pipelines in threads, since a driver takes seconds for a decoder.

    cache: what the driver has compiled before.
    """

    @classmethod
    def of(cls, device: Device) -> Compiler:
        """The device's compiler."""
        compiler: Compiler = device.once("compiler", lambda: cls(device))
        return compiler

    def __init__(self, device: Device):
        self.cache = PipelineCache(device)
        self._device = device
        self._threads = ThreadPoolExecutor(os.cpu_count())
        device.at_close(self._threads.shutdown)
        self._times: list[tuple[float, float]] = []  # start and end of each creation

    def start(self, create: Callable[..., Any], info: Any, *keep: Any) -> Pipeline:
        """Starts creating a pipeline.

        create: takes VkDevice, VkPipelineCache, and then as vkCreateComputePipelines does. keep:
        what `info` points to and does not keep alive.
        """
        return Pipeline(self._device, self._threads.submit(self._create, create, info, keep))

    def _create(self, create: Callable[..., Any], info: Any, keep: tuple[Any, ...]) -> Any:
        start = time.perf_counter()
        handle = create(self._device.handle, self.cache.handle, 1, [info], None)[0]
        self._times.append((start, time.perf_counter()))
        return handle

    def statistics(self) -> dict[str, Any]:
        """Of the pipelines that are ready.

        count: their number; seconds: from the start of the first to the end of the last, in
        which the host does other work as well; work_seconds: of all threads together; cached_bytes:
        that the driver had from earlier starts.
        """
        starts, ends = zip(*self._times) if self._times else ((0.0,), (0.0,))
        return {
            "count": len(self._times),
            "seconds": max(ends) - min(starts),
            "work_seconds": sum(end - start for start, end in self._times),
            "cached_bytes": self.cache.read,
        }


class Pipeline:
    """A VkPipeline that a thread creates; freed with the device."""

    def __init__(self, device: Device, future: Future[Any]):
        self._future = future
        device.at_close(lambda: self._destroy(device))

    @property
    def handle(self) -> Any:
        """The VkPipeline; waits for it. Raises VkError if the driver refuses it."""
        return self._future.result()

    def _destroy(self, device: Device) -> None:
        if self._future.exception() is None:
            vk.vkDestroyPipeline(device.handle, self._future.result(), None)


class ComputePipeline:
    """A compute shader with its specialisation constants.

    layout: of the pipeline; by default push constants alone.
    """

    @classmethod
    def of(
        cls, device: Device, name: str, constants: Mapping[str, int], layout: Any = None
    ) -> ComputePipeline:
        """The device's pipeline of a module, constants and layout; made on first use."""
        key = (name, layout, *sorted(constants.items()))
        pipeline: ComputePipeline = device.once(key, lambda: cls(device, name, constants, layout))
        return pipeline

    def __init__(self, device: Device, name: str, constants: Mapping[str, int], layout: Any = None):
        self.device, self.layout = device, layout or pipeline_layout(device)
        shader = stage(device, name, vk.VK_SHADER_STAGE_COMPUTE_BIT, constants)
        info = vk.VkComputePipelineCreateInfo(stage=shader, layout=self.layout)
        self._pipeline = Compiler.of(device).start(vk.vkCreateComputePipelines, info, shader)

    def dispatch(self, commands: Any, workgroups: int, data: np.ndarray, rows: int = 1) -> None:
        """Records `rows` rows of workgroups with `data` as push constants.

        Raises VulkanError if they are too many for the device.
        """
        self.device.limits.check_workgroups(workgroups, rows)
        vk.vkCmdBindPipeline(commands, vk.VK_PIPELINE_BIND_POINT_COMPUTE, self._pipeline.handle)
        push(commands, self.layout, data)
        vk.vkCmdDispatch(commands, workgroups, rows, 1)

    def dispatch_indirect(
        self, commands: Any, arguments: Buffer, offset: int, data: np.ndarray
    ) -> None:
        """The same; the device takes the workgroups from three words of a buffer."""
        vk.vkCmdBindPipeline(commands, vk.VK_PIPELINE_BIND_POINT_COMPUTE, self._pipeline.handle)
        push(commands, self.layout, data)
        vk.vkCmdDispatchIndirect(commands, arguments.handle, offset)


class Timestamps(Resource):
    """`count` timestamps that a command buffer writes and the host reads afterwards."""

    def __init__(self, device: Device, count: int):
        self.count = count
        self._pool = vk.vkCreateQueryPool(
            device.handle,
            vk.VkQueryPoolCreateInfo(queryType=vk.VK_QUERY_TYPE_TIMESTAMP, queryCount=count),
            None,
        )
        self.register(device)

    def _destroy(self) -> None:
        vk.vkDestroyQueryPool(self.device.handle, self._pool, None)

    def reset(self, commands: Any) -> None:
        """Record this before the first mark."""
        vk.vkCmdResetQueryPool(commands, self._pool, 0, self.count)

    def mark(self, commands: Any, index: int) -> None:
        """Records a timestamp that is written when all commands before have finished."""
        vk.vkCmdWriteTimestamp2(
            commands, vk.VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, self._pool, index
        )

    def milliseconds(self) -> np.ndarray:
        """float64[count - 1]: the time between successive timestamps of the last run; waits."""
        ticks = read_queries(self.device, self._pool, self.count)
        return np.diff(ticks.astype(np.int64)) * self.device.limits.timestamp_ns / 1e6


def read_queries(device: Device, pool: Any, count: int) -> np.ndarray:
    """uint64[count]: the results of a pool's queries; waits.

    Raises VulkanError if the device is lost.
    """
    results = np.zeros(count, np.uint64)
    with device.loss_as_error():
        vk.vkGetQueryPoolResults(
            device.handle,
            pool,
            0,
            count,
            results.nbytes,
            vk.ffi.cast("void *", results.ctypes.data),
            8,
            vk.VK_QUERY_RESULT_64_BIT | vk.VK_QUERY_RESULT_WAIT_BIT,
        )
    return results

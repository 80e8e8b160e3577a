"""Culling bounds of meshlets, which a compute shader finds from the blobs."""

from __future__ import annotations

from typing import Any

from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.limits import MAX_WORKGROUPS
from ..gpu.pipelines import ComputePipeline, push_record
from ..scene.buffers import SceneBuffers
from ..scene.scene import Scene
from .structures import BOUNDS_PUSH


def fill_bounds(buffers: SceneBuffers) -> None:
    """Computes the culling bounds of all meshlets on the device, from the blobs."""
    device, scene = buffers.device, buffers.scene
    pipeline = bounds_pipeline(device, scene)
    with device.commands() as commands:
        for number, primitive in enumerate(scene.primitives):
            table = {"primitives": buffers.primitives_address, "primitive": number}
            record_bounds(commands, pipeline, primitive.meshlets, **table)
        # Later submissions read the bounds.
        device.full_barrier(commands)


def bounds_pipeline(device: Device, scene: Scene) -> ComputePipeline:
    return ComputePipeline.of(device, "bounds.comp", {"MAX_STREAMS": scene.max_streams})


def record_bounds(commands: Any, pipeline: ComputePipeline, meshlets: int, **fields: int) -> None:
    """Records the bounds of so many meshlets. fields: of BOUNDS_PUSH."""
    data = push_record(BOUNDS_PUSH, meshlets=meshlets, **fields)
    workgroups = min(-(-meshlets // CONSTANTS["BOUNDS_THREADS"]), MAX_WORKGROUPS)
    pipeline.dispatch(commands, workgroups, data)

"""Culling bounds of meshlets, which a compute shader finds from the blobs."""

from __future__ import annotations

from typing import Any

from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.limits import MAX_WORKGROUPS
from ..gpu.pipelines import ComputePipeline, push_record
from ..scene.buffers import SceneBuffers
from ..scene.scene import Scene
from ..scene.view import SceneView
from .structures import BOUNDS_PUSH


def fill_bounds(view: SceneView) -> None:
    """Computes the culling bounds of all meshlets on the device, at the first look at the scene.

    By then the driver compiles the scene's other pipelines, too. Call it before they are made: that
    of the bounds takes longest.
    """
    view.at_first_look(Bounds(view.buffers).fill)


class Bounds:
    """The culling bounds of all meshlets, which the device computes from the blobs."""

    def __init__(self, buffers: SceneBuffers):
        self._buffers = buffers
        self._pipeline = bounds_pipeline(buffers.device, buffers.scene)

    def fill(self) -> None:
        """Computes them; waits."""
        device, address = self._buffers.device, self._buffers.primitives_address
        with device.commands() as commands:
            for number, primitive in enumerate(self._buffers.scene.primitives):
                table = {"primitives": address, "primitive": number}
                record_bounds(commands, self._pipeline, primitive.meshlets, **table)
            # Later submissions read the bounds.
            device.full_barrier(commands)


def bounds_pipeline(device: Device, scene: Scene) -> ComputePipeline:
    return ComputePipeline.of(device, "bounds.comp", {"MAX_STREAMS": scene.max_streams})


def record_bounds(commands: Any, pipeline: ComputePipeline, meshlets: int, **fields: int) -> None:
    """Records the bounds of so many meshlets. fields: of BOUNDS_PUSH."""
    data = push_record(BOUNDS_PUSH, meshlets=meshlets, **fields)
    workgroups = min(-(-meshlets // CONSTANTS["BOUNDS_THREADS"]), MAX_WORKGROUPS)
    pipeline.dispatch(commands, workgroups, data)

"""Path stream: compute shaders decode meshlets, a few thousand at a time, into a ring of slots, and a mesh shader draws from there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import vulkan as vk

from .errors import VulkanError
from .memory import Buffer
from .scene import Scene, address_words
from .slots import SlotLayout

if TYPE_CHECKING:
    from .raster import Pipelines

RING = 8192  # slots, where a scene needs so many
OVERLAP = False  # whether one half is filled while the other is drawn from
PASSES = {"connect_stream.comp": 32, "values_stream.comp": 1}  # meshlets of a workgroup; stream.mesh has one, too
SUMMARY_BYTES, CONNECTED_BYTES = 4, 16  # of shaders/decode_buffers.glsl
COMPUTE_STAGE = vk.VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT
MESH_STAGE = vk.VK_PIPELINE_STAGE_2_MESH_SHADER_BIT_EXT
READ, WRITE = vk.VK_ACCESS_2_SHADER_STORAGE_READ_BIT, vk.VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT


@dataclass(frozen=True)
class Segment:
    """Meshlets [first, first + meshlets) of an instance, in the slots from `slot` on."""

    instance: int
    first: int
    meshlets: int
    slot: int


def schedule(meshlets: Sequence[int], slots: int, longest: int, parts: int = 1) -> list[list[Segment]]:
    """Batches that fit `slots` slots, of segments of at most `longest` meshlets, in the instances' order.

    meshlets: of each instance. parts: of the ring, each of `slots` slots, which batches take in turns.
    """
    batches: list[list[Segment]] = []
    free = 0
    for instance, count in enumerate(meshlets):
        first = 0
        while first < count:
            if free == 0:
                batches.append([])
                free = slots
            taken = min(count - first, free, longest)
            batches[-1].append(Segment(instance, first, taken, (len(batches) - 1) % parts * slots + slots - free))
            first, free = first + taken, free - taken
    return batches


class Ring:
    """The slots that a scene's meshlets pass through, and the passes that decode into them.

    slots: at most so many; a scene with fewer meshlets has one for each. parts: 2 where one part is filled while the other is drawn from,
    else 1. constants: of the raster paths' shaders. decoded, drawn: timelines for that. Raises VulkanError.
    """

    def __init__(self, pipelines: Pipelines, scene: Scene, slots: int, overlap: bool, constants: dict[int, int]):
        if slots < 1:
            raise VulkanError(f"a ring of {slots} slots holds no meshlet", "use 1 or more")
        device = self._device = pipelines.device
        self._meshlets = [scene.primitives[i.primitive].meshlets for i in scene.instances]
        layout = SlotLayout.of(scene)
        self.parts = 2 if overlap and slots > 1 else 1
        self._part = slots // self.parts
        self.slots = min(self.parts * self._part, sum(self._meshlets))
        self.decoded, self.drawn = pipelines.timelines() if self.parts > 1 else (None, None)
        self.constants = {**constants, **layout.constants}
        sizes = {"slots": layout.bytes, "summaries": SUMMARY_BYTES, "connectivity": CONNECTED_BYTES}
        self._buffers = {name: Buffer(device, self.slots * size) for name, size in sizes.items()}
        self._passes = [(pipelines.compute(name, self.constants), per) for name, per in PASSES.items()]

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of the slots and of what decoding needs for each."""
        return sum(buffer.allocated for buffer in self._buffers.values())

    @property
    def pipelines(self) -> dict[str, object]:
        """Shader -> the pipeline that decodes with it, for vk_backend.statistics."""
        return {name: pipeline.handle for name, (pipeline, _) in zip(PASSES, self._passes)}

    def batches(self, longest: int) -> list[list[Segment]]:
        """What is decoded and drawn together; a segment has at most `longest` meshlets."""
        return schedule(self._meshlets, self._part, longest, self.parts)

    def fields(self, segment: Segment) -> dict[str, object]:
        """What the push constants say of a segment, by the names in shaders/raster.glsl."""
        addresses = {name: address_words(buffer.address) for name, buffer in self._buffers.items()}
        return {"first": segment.first, "meshlets": segment.meshlets, "first_slot": segment.slot, **addresses}

    def decode(self, commands, batch: list[Segment], pushed: list[np.ndarray]) -> None:
        """Records the decoding of a batch. pushed: the push constants of each segment."""
        for number, (pipeline, per) in enumerate(self._passes):
            if number > 0:
                self._device.barrier(commands, COMPUTE_STAGE, WRITE, COMPUTE_STAGE, READ | WRITE)
            for segment, data in zip(batch, pushed):
                pipeline.dispatch(commands, -(-segment.meshlets // per), data)

    def wait_for_drawing(self, commands) -> None:
        """Records, for one queue, that what is decoded next waits for what was drawn before."""
        self._device.barrier(commands, MESH_STAGE, 0, COMPUTE_STAGE, 0)

    def wait_for_decoding(self, commands) -> None:
        """Records, for one queue, that what is drawn next waits for what was decoded before."""
        self._device.barrier(commands, COMPUTE_STAGE, WRITE, MESH_STAGE, READ)

    def free(self) -> None:
        for buffer in self._buffers.values():
            buffer.free()

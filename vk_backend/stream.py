"""Path stream: compute shaders decode some thousand meshlets at a time into a ring of slots, and a mesh shader draws from there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING

import numpy as np
import vulkan as vk

from .errors import VulkanError
from .memory import Buffer
from .pipelines import ComputePipeline
from .scene import Scene
from .scene_buffers import address_words
from .slots import SlotLayout

if TYPE_CHECKING:
    from .raster import Pipelines

RING = 8192  # slots, where a scene needs so many
OVERLAPPED = 4096  # meshlets from which on it pays to fill one half of the ring while the other is drawn from,
TURNS = 3  #   in no fewer turns than these
PASSES = {
    "connect_stream.comp": 32,
    "values_stream.comp": 1,
}  # meshlets of a workgroup; stream.mesh has one, too
SUMMARY_BYTES, CONNECTED_BYTES, SEGMENT_BYTES = (
    4,
    24,
    16,
)  # of shaders/decode_buffers.glsl and stream_push.glsl
COMPUTE_STAGE = vk.VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT
MESH_STAGE = vk.VK_PIPELINE_STAGE_2_MESH_SHADER_BIT_EXT
READ, WRITE = vk.VK_ACCESS_2_SHADER_STORAGE_READ_BIT, vk.VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT


@dataclass(frozen=True)
class Segment:
    """Meshlets [first, first + meshlets) of an instance, in the slots from `slot` on; as in shaders/stream_push.glsl."""

    instance: int
    first: int
    meshlets: int
    slot: int


def schedule(meshlets: Sequence[int], slots: int, parts: int = 1) -> list[list[Segment]]:
    """Batches that fit `slots` slots, in the instances' order.

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
            taken = min(count - first, free)
            batches[-1].append(
                Segment(instance, first, taken, (len(batches) - 1) % parts * slots + slots - free)
            )
            first, free = first + taken, free - taken
    return batches


def division(meshlets: int, slots: int, overlap: bool | None) -> tuple[int, int]:
    """(parts of a ring, slots of each) for a scene of so many meshlets: see Ring."""
    if overlap is None and meshlets >= OVERLAPPED:
        overlap, slots = True, min(slots, 2 * -(-meshlets // TURNS))
    parts = 2 if overlap and slots > 1 else 1
    return parts, slots // parts


class Ring:
    """The slots that a scene's meshlets pass through, and the passes that decode into them.

    slots: at most so many; a scene with fewer meshlets has one for each. overlap: the ring is in two parts, one of which is filled while
    the other is drawn from; None: where that pays. constants: of the raster paths' shaders. Raises VulkanError.
    """

    def __init__(
        self,
        pipelines: Pipelines,
        scene: Scene,
        slots: int,
        overlap: bool | None,
        constants: dict[int, int],
    ):
        if slots < 1:
            raise VulkanError(f"a ring of {slots} slots holds no meshlet", "use 1 or more")
        device = self._device = pipelines.device
        meshlets = [scene.primitives[i.primitive].meshlets for i in scene.instances]
        layout = SlotLayout.of(scene)
        self.constants = {**constants, **layout.constants}
        self.parts, of_part = division(sum(meshlets), slots, overlap)
        self.batches = schedule(meshlets, of_part, self.parts)
        self.slots = min(self.parts * of_part, sum(meshlets))
        self.decoded, self.drawn = (
            pipelines.timelines() if self.parts > 1 else (None, None)
        )  # see frame.py

        sizes = {"slots": layout.bytes, "summaries": SUMMARY_BYTES, "connectivity": CONNECTED_BYTES}
        self._buffers = {name: Buffer(device, self.slots * size) for name, size in sizes.items()}
        rows = np.array(
            [astuple(segment) for batch in self.batches for segment in batch], np.uint32
        )
        self._buffers["segments"] = Buffer(device, rows.nbytes).write(rows)
        counts = np.array([len(batch) for batch in self.batches])
        self._first_segments = np.cumsum(counts) - counts
        self._passes = [
            (ComputePipeline.of(device, name, self.constants), per) for name, per in PASSES.items()
        ]

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of the slots and of what decoding needs for each."""
        return sum(buffer.allocated for buffer in self._buffers.values())

    @property
    def pipelines(self) -> dict[str, object]:
        """Shader -> the pipeline that decodes with it, for vk_backend.statistics."""
        return {name: pipeline.handle for name, (pipeline, _) in zip(PASSES, self._passes)}

    @property
    def addresses(self) -> dict[str, tuple[int, int]]:
        """Of the buffers, by the names that the push constants of shaders/raster.glsl have for them."""
        return {name: address_words(buffer.address) for name, buffer in self._buffers.items()}

    def decode(self, commands, number: int, pushed: np.ndarray, longest: int) -> None:
        """Records the decoding of a batch.

        pushed: push constants, with what does not depend on the batch; longest: workgroups of a dispatch, at most.
        """
        batch, pushed = self.batches[number], pushed.copy()
        pushed["segments"] = address_words(
            self._buffers["segments"].address + SEGMENT_BYTES * int(self._first_segments[number])
        )
        pushed["segment_count"] = len(batch)
        meshlets = sum(segment.meshlets for segment in batch)
        for later, (pipeline, per) in enumerate(self._passes):
            if later:
                self._device.barrier(commands, COMPUTE_STAGE, WRITE, COMPUTE_STAGE, READ | WRITE)
            for first in range(0, meshlets, longest * per):
                pushed["first_slot"], pushed["meshlets"] = (
                    batch[0].slot + first,
                    min(meshlets - first, longest * per),
                )
                pipeline.dispatch(commands, -(-int(pushed["meshlets"]) // per), pushed)

    def wait_for_drawing(self, commands) -> None:
        """Records, for one queue, that what is decoded next waits for what was drawn before."""
        self._device.barrier(commands, MESH_STAGE, 0, COMPUTE_STAGE, 0)

    def wait_for_decoding(self, commands) -> None:
        """Records that what is drawn next sees what was decoded before.

        Another queue's semaphore is not enough: NVIDIA's driver then leaves in the caches what the slots held earlier.
        """
        self._device.barrier(commands, COMPUTE_STAGE, WRITE, MESH_STAGE, READ)

    def free(self) -> None:
        for buffer in self._buffers.values():
            buffer.free()

"""The ring of path stream: compute shaders decode batches of meshlets into its slots.

A mesh shader then draws the slots. shaders/scene/slots.glsl describes a slot,
shaders/raster/stream_push.glsl the decoding of a batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from . import vk
from .constants import CONSTANTS
from .device import Device, Timeline
from .errors import VulkanError
from .memory import Buffer
from .pipelines import MAX_WORKGROUPS, ComputePipeline
from .raster_layout import CONNECTED, SEGMENT
from .scene import Scene
from .slot_layout import SlotLayout

RING = 8192  # slots, unless the scene has fewer meshlets
# From this many meshlets on, filling one half of the ring while the other is drawn was faster on an
# H200; a scene then takes at least TURNS batches.
OVERLAPPED = 4096
TURNS = 3
# Shader -> meshlets of a workgroup, in the order in which they run.
PASSES = {"connect_stream.comp": 32, "values_stream.comp": 1}
COMPUTE_STAGE = vk.VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT
MESH_STAGE = vk.VK_PIPELINE_STAGE_2_MESH_SHADER_BIT_EXT
READ = vk.VK_ACCESS_2_SHADER_STORAGE_READ_BIT
WRITE = vk.VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT


@dataclass(frozen=True)
class Segment:
    """Meshlets [first, first + meshlets) of an instance, in the slots from `slot` on.

    Same fields as the structure of shaders/raster/stream_push.glsl.
    """

    instance: int
    first: int
    meshlets: int
    slot: int


def schedule(meshlets: Sequence[int], slots: int, sections: int = 1) -> list[list[Segment]]:
    """Cuts the meshlets of all instances, in order, into batches of at most `slots` meshlets.

    meshlets: of each instance. sections: of the ring, `slots` slots each; batches use them in turn.
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
            slot = (len(batches) - 1) % sections * slots + slots - free
            batches[-1].append(Segment(instance, first, taken, slot))
            first, free = first + taken, free - taken
    return batches


def division(meshlets: int, slots: int, overlap: bool | None) -> tuple[int, int]:
    """(sections of the ring, slots of each) for a scene with this many meshlets: see Ring."""
    if overlap is None and meshlets >= OVERLAPPED:
        overlap, slots = True, min(slots, 2 * -(-meshlets // TURNS))
    sections = 2 if overlap and slots > 1 else 1
    return sections, slots // sections


class Ring:
    """The slots that a scene's meshlets pass through, and the pipelines that decode into them.

    slots: at most; a scene with fewer meshlets gets one for each. overlap: two sections, one of
    which is filled while the other is drawn; None: if the scene is large enough. constants:
    specialisation constants of the raster shaders. Raises VulkanError for a ring without slots.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        slots: int,
        overlap: bool | None,
        constants: dict[str, int],
    ):
        if slots < 1:
            raise VulkanError(f"a ring of {slots} slots holds no meshlet", "use 1 or more")
        self._device = device
        meshlets = [scene.primitives[i.primitive].meshlets for i in scene.instances]
        layout = SlotLayout.of(scene)
        self.constants = {**constants, **layout.constants}
        self.sections, section_slots = division(sum(meshlets), slots, overlap)
        self.batches = schedule(meshlets, section_slots, self.sections)
        self.slots = min(self.sections * section_slots, sum(meshlets))
        # Only a ring of two sections uses two queues, which these synchronise: frame_commands.py.
        self.decoded: Timeline | None = None
        self.drawn: Timeline | None = None
        if self.sections > 1:
            self.decoded, self.drawn = _timelines(device)

        sizes = {
            "slots": layout.bytes,
            "summaries": CONSTANTS["SUMMARY_BYTES"],
            "connectivity": CONNECTED.itemsize,
        }
        self._buffers = {name: Buffer(device, self.slots * size) for name, size in sizes.items()}
        rows = np.array(
            [astuple(segment) for batch in self.batches for segment in batch], np.uint32
        )
        self._buffers["segments"] = Buffer(device, rows.nbytes).write(rows)
        counts = np.array([len(batch) for batch in self.batches])
        self._first_segments = np.cumsum(counts) - counts
        self._passes = [
            (ComputePipeline.of(device, name, self.constants), per_group)
            for name, per_group in PASSES.items()
        ]

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of the slots and of the data that decoding needs for each."""
        return sum(buffer.allocated for buffer in self._buffers.values())

    @property
    def pipelines(self) -> dict[str, Any]:
        """Shader -> VkPipeline, for pipeline_statistics."""
        return {name: pipeline.handle for name, (pipeline, _) in zip(PASSES, self._passes)}

    @property
    def addresses(self) -> dict[str, int]:
        """Buffer addresses, by the names of RasterPush in shaders/raster/raster.glsl."""
        return {name: buffer.address for name, buffer in self._buffers.items()}

    def decode(
        self, commands: Any, number: int, pushed: np.ndarray, max_workgroups: int = MAX_WORKGROUPS
    ) -> None:
        """Records the decoding of a batch.

        pushed: push constants that do not depend on the batch; max_workgroups: per dispatch.
        """
        batch, pushed = self.batches[number], pushed.copy()
        first = SEGMENT.itemsize * int(self._first_segments[number])
        pushed["segments"] = self._buffers["segments"].address + first
        pushed["segment_count"] = len(batch)
        meshlets = sum(segment.meshlets for segment in batch)
        for index, (pipeline, per_group) in enumerate(self._passes):
            if index > 0:
                self._device.compute_barrier(commands)
            step = max_workgroups * per_group
            for first in range(0, meshlets, step):
                count = min(meshlets - first, step)
                pushed["first_slot"], pushed["meshlets"] = batch[0].slot + first, count
                pipeline.dispatch(commands, -(-count // per_group), pushed)

    def wait_for_drawing(self, commands: Any) -> None:
        """Records, for a single queue, that later decoding waits for earlier drawing."""
        self._device.barrier(commands, MESH_STAGE, 0, COMPUTE_STAGE, 0)

    def wait_for_decoding(self, commands: Any) -> None:
        """Records that later drawing sees the results of earlier decoding.

        A semaphore between two queues is not enough: NVIDIA's driver leaves stale data in caches.
        """
        self._device.barrier(commands, COMPUTE_STAGE, WRITE, MESH_STAGE, READ)

    def free(self) -> None:
        """Frees the memory; a second call does nothing."""
        for buffer in self._buffers.values():
            buffer.free()


def _timelines(device: Device) -> tuple[Timeline, Timeline]:
    """The device's timelines of decoding and of drawing."""
    timelines: tuple[Timeline, Timeline] = device.once(
        "ring timelines", lambda: (Timeline(device), Timeline(device))
    )
    return timelines

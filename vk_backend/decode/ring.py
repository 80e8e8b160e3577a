"""The ring of paths stream and visibility: compute shaders decode batches of meshlets into slots.

Other shaders then draw the slots. shaders/scene/slots.glsl describes a slot,
shaders/raster/stream_push.glsl the decoding of a batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext.ranges import begins

from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device, Timeline
from ..gpu.errors import VulkanError
from ..gpu.limits import MAX_WORKGROUPS
from ..gpu.memory import Buffer
from ..gpu.pipelines import ComputePipeline, addresses
from ..scene.scene import SHADED, Primitive, Scene
from .slots import SlotLayout, packed_field
from .structures import CONNECTED, PLACES, RASTER_PUSH, SEGMENT

RING = 8192  # slots of path stream, unless the scene has fewer meshlets
# From this many meshlets on, filling one half of the ring while the other is drawn was faster on an
# H200; a scene then takes at least TURNS batches.
OVERLAPPED = 4096
TURNS = 3


@dataclass(frozen=True)
class Pass:
    """A dispatch.

    meshlets: of a workgroup; split: a row of workgroups for each stream; spread: SPREAD threads
    take a meshlet.
    """

    shader: str
    meshlets: int
    split: bool = False
    spread: bool = False


# The team decoder: a workgroup decodes the values of a meshlet.
TEAM = (Pass("connect_stream.comp", 32, spread=True), Pass("values_stream.comp", 1))
# The bulk passes: a thread decodes a small part of a meshlet's boundary, a workgroup the interior.
BULK = (
    Pass("connect_bulk.comp", 32, spread=True),
    Pass("lengths_bulk.comp", 8),
    Pass("corners_bulk.comp", 8, split=True),
    Pass("chains_bulk.comp", 8, split=True),
    Pass("interior_bulk.comp", 1),
)
BULK_SLOTS = 8  # segments begin at multiples: the meshlets of a workgroup are of one primitive
# The bulk passes are for paths with compute shaders from so many meshlets on. On an H200 they take
# 0.49 ms for sponza_like (5,137 meshlets) and 0.32 for dragon (14,227), the team 0.58 and 0.48; for
# bunny (1,108) it is 0.23 and 0.17.
BULK_MESHLETS = 4000
# Threads of connect.comp for a meshlet, of which one works, in rings of fewer slots: threads of a
# warp wait for each other. On an H200 this saves 0.02 of 0.05 ms for 1,100 meshlets, nothing for
# 5,137.
SPREAD, SPREAD_SLOTS = 16, 4000
COMPUTE_STAGE = vk.VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT
MESH_STAGE = vk.VK_PIPELINE_STAGE_2_MESH_SHADER_BIT_EXT
READ = vk.VK_ACCESS_2_SHADER_STORAGE_READ_BIT
WRITE = vk.VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT


def schedule_whole(meshlets: Sequence[int] | np.ndarray, slots: int) -> list[np.recarray]:
    """Batches of at most `slots` slots for the bulk passes: no segment is cut. See `schedule`.

    meshlets: of each instance, at most `slots`. Segments begin at multiples of BULK_SLOTS.
    """
    counts = np.asarray(meshlets, np.int64)
    begin = begins(-(-counts // BULK_SLOTS) * BULK_SLOTS)
    ends = begin[:-1] + counts
    batches = []
    first = 0
    while first < len(counts):
        end = int(np.searchsorted(ends, begin[first] + slots, "right"))
        own = np.arange(first, end)
        batches.append(_segments(own, 0 * own, counts[own], begin[own] - begin[first]))
        first = end
    return batches


def schedule(
    meshlets: Sequence[int] | np.ndarray, slots: int, sections: int = 1
) -> list[np.recarray]:
    """Cuts the meshlets of all instances, in order, into batches of at most `slots` meshlets.

    meshlets: of each instance. sections: of the ring, `slots` slots each; batches use them in turn.
    Returns the SEGMENTs of each batch: meshlets [first, first + meshlets) of an instance in the
    slots from `slot` on.
    """
    begin = begins(np.asarray(meshlets, np.int64))
    total = int(begin[-1])
    cuts = np.union1d(begin[:-1][np.diff(begin) > 0], np.arange(0, total, slots))
    instance = np.searchsorted(begin, cuts, "right") - 1
    batch = cuts // slots
    slot = batch % sections * slots + cuts % slots
    counts = np.diff(np.append(cuts, total))
    ends = np.searchsorted(batch, np.arange(-(-total // slots)), "right").tolist()
    return [
        _segments(instance[of], cuts[of] - begin[instance[of]], counts[of], slot[of])
        for of in map(slice, [0, *ends], ends)
    ]


def _segments(
    instance: np.ndarray, first: np.ndarray, meshlets: np.ndarray, slot: np.ndarray
) -> np.recarray:
    rows = np.zeros(len(instance), SEGMENT)
    rows["instance"], rows["first"], rows["meshlets"], rows["slot"] = (
        instance,
        first,
        meshlets,
        slot,
    )
    return rows.view(np.recarray)


def division(meshlets: int, slots: int) -> tuple[int, int]:
    """(sections of the ring, slots of each) for a scene with this many meshlets: see Ring."""
    if meshlets < OVERLAPPED or slots == 1:
        return 1, slots
    return 2, min(slots, 2 * -(-meshlets // TURNS)) // 2


class Ring:
    """The slots that a scene's meshlets pass through, and the pipelines that decode into them.

    slots: at most; a scene with fewer meshlets gets one for each. bulk: decode in bulk passes from
    BULK_MESHLETS on, if `bulk_fits`; without, a large scene gets two sections, one of which is
    filled while the other is drawn. constants: specialisation constants of the raster shaders.
    Raises VulkanError for a ring without slots.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        slots: int,
        constants: dict[str, int],
        *,
        bulk: bool,
    ):
        if slots < 1:
            raise VulkanError(f"a ring of {slots} slots holds no meshlet", "use 1 or more")
        self._device = device
        meshlets = scene.instance_meshlets
        layout = SlotLayout.of(scene)
        self.constants = {**constants, **layout.constants}
        total = int(meshlets.sum())
        enough = total >= BULK_MESHLETS
        self.bulk = bulk and enough and bulk_fits(scene, layout, slots)
        if self.bulk:
            self.sections, self.batches = 1, schedule_whole(meshlets, slots)
            self.slots = max(map(_slots_of, self.batches))
        else:
            # Decoding never overlaps drawing where both are compute shaders.
            self.sections, section_slots = (1, slots) if bulk else division(total, slots)
            self.batches = schedule(meshlets, section_slots, self.sections)
            self.slots = min(self.sections * section_slots, total)
        # Only a ring of two sections uses two queues, which these synchronise: frame_commands.py.
        self.decoded: Timeline | None = None
        self.drawn: Timeline | None = None
        if self.sections > 1:
            self.decoded, self.drawn = _timelines(device)

        self._allocate(layout, scene.max_streams)
        rows = np.concatenate(self.batches)
        self._buffers["segments"] = Buffer(device, rows.nbytes).write(rows)
        counts = np.array([len(batch) for batch in self.batches])
        self._first_segments = np.cumsum(counts) - counts

    def _allocate(self, layout: SlotLayout, streams: int) -> None:
        """Makes the buffers with an item for each slot, and the pipelines."""
        sizes = {
            "slots": layout.bytes,
            "summaries": CONSTANTS["SUMMARY_BYTES"],
            "connectivity": CONNECTED.itemsize,
        }
        if self.bulk:
            sizes["places"] = PLACES.itemsize
        self._buffers = {
            name: Buffer(self._device, self.slots * size) for name, size in sizes.items()
        }
        self._streams = streams
        self._spread = SPREAD if self.slots < SPREAD_SLOTS else 1
        # Only the first pass culls. The others are the same pipelines with culling and without.
        first = {**self.constants, "SPREAD": self._spread}
        later = {**self.constants, "CULLING": 1}
        self._passes = [
            (step, ComputePipeline.of(self._device, step.shader, first if step.spread else later))
            for step in (BULK if self.bulk else TEAM)
        ]

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of the slots and of the data that decoding needs for each."""
        return sum(buffer.allocated for buffer in self._buffers.values())

    @property
    def addresses(self) -> dict[str, int]:
        """Buffer addresses, by the names of RasterPush in shaders/raster/raster.glsl."""
        return addresses(RASTER_PUSH, self._buffers)

    def decode(
        self, commands: Any, number: int, pushed: np.ndarray, max_workgroups: int = MAX_WORKGROUPS
    ) -> None:
        """Records the decoding of a batch.

        pushed: push constants that do not depend on the batch; max_workgroups: per dispatch.
        """
        pushed = pushed.copy()
        pushed["segments"], pushed["segment_count"] = self.segments(number)
        begin, slots = int(self.batches[number].slot[0]), self.batch_slots(number)
        for index, (step, pipeline) in enumerate(self._passes):
            if index > 0:
                self._device.compute_barrier(commands)
            per_group = step.meshlets // self._spread if step.spread else step.meshlets
            rows = self._streams if step.split else 1
            for first in range(0, slots, max_workgroups * per_group):
                count = min(slots - first, max_workgroups * per_group)
                pushed["first_slot"], pushed["meshlets"] = begin + first, count
                pipeline.dispatch(commands, -(-count // per_group), pushed, rows)

    def segments(self, number: int) -> tuple[int, int]:
        """(address, number) of a batch's segments."""
        first = SEGMENT.itemsize * int(self._first_segments[number])
        return self._buffers["segments"].address + first, len(self.batches[number])

    def batch_slots(self, number: int) -> int:
        """Slots of a batch, empty ones between segments included."""
        return _slots_of(self.batches[number])

    def slot_words(self) -> np.ndarray:
        """uint32[slots, words]: what the slots hold; waits."""
        words = self._buffers["slots"].read()
        return words[: words.size // self.slots * self.slots].reshape(self.slots, -1)

    def summaries(self) -> np.ndarray:
        """uint32[slots]: triangles | vertices << 8 | error << 16 of what they hold; waits."""
        return self._buffers["summaries"].read()[: self.slots]

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


def _slots_of(batch: np.recarray) -> int:
    return int(batch.slot[-1]) + int(batch.meshlets[-1]) - int(batch.slot[0])


def bulk_fits(scene: Scene, layout: SlotLayout, slots: int) -> bool:
    """Whether the bulk passes can decode the scene into slots: see value_place of their shaders.

    All primitives must fit whole. All streams up to the last one that is drawn must be drawn, and
    pairs of words must begin at even words.
    """
    return not layout.floats and all(
        p.meshlets <= slots and _streams_fit(p, layout) for p in scene.primitives
    )


def _streams_fit(primitive: Primitive, layout: SlotLayout) -> bool:
    at = 0
    for role in SHADED[1:]:
        if role in primitive.attributes:
            stream = primitive.attributes[role].stream
            words = packed_field(stream.elements, stream.bits)[1]
            if words == 2 and (at % 2 or layout.attribute_words % 2):
                return False
            at += words
    return primitive.stream_end == len(primitive.attributes)


def _timelines(device: Device) -> tuple[Timeline, Timeline]:
    """The device's timelines of decoding and of drawing."""
    timelines: tuple[Timeline, Timeline] = device.once(
        "ring timelines", lambda: (Timeline(device), Timeline(device))
    )
    return timelines

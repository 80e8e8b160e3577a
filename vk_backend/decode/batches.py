"""The meshlets of all instances in batches that fit the slots, for paths that keep none of them.

shaders/decoders/slot_jobs.glsl describes the decoding of a batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from ..gpu.device import Device
from ..gpu.limits import MAX_WORKGROUPS
from ..gpu.memory import Buffer, Owner
from ..scene.scene import SHADED, Primitive, Scene
from .decoder import Stage
from .slots import SlotLayout, packed_field
from .structures import SEGMENT

BULK_SLOTS = 8  # segments begin at multiples: the meshlets of a workgroup are of one primitive
# The bulk passes are for paths with compute shaders from so many meshlets on. On an H200 they take
# 0.49 ms for sponza_like (5,137 meshlets) and 0.32 for dragon (14,227), the team 0.58 and 0.48; for
# bunny (1,108) it is 0.23 and 0.17.
BULK_MESHLETS = 4000


@dataclass(frozen=True)
class Segment:
    """Meshlets [first, first + meshlets) of an instance, in the slots from `slot` on.

    Same fields as the structure of shaders/decoders/slot_jobs.glsl.
    """

    instance: int
    first: int
    meshlets: int
    slot: int


@dataclass(frozen=True)
class Batch:
    """Jobs of a decoder: segments, and the address of their table."""

    segments: list[Segment]
    address: int

    @property
    def first_slot(self) -> int:
        return self.segments[0].slot

    @property
    def slots(self) -> int:
        """Empty ones between segments included."""
        return _slots_of(self.segments)

    def pushed(self, pushed: np.ndarray) -> np.ndarray:
        """A copy of push constants, with the batch's fields."""
        own: np.ndarray = pushed.copy()
        own["segments"], own["segment_count"] = self.address, len(self.segments)
        own["meshlets"] = self.slots
        return own

    def dispatch(self, commands: Any, stage: Stage, pushed: np.ndarray) -> None:
        """See decoder.Jobs."""
        own, most = self.pushed(pushed), MAX_WORKGROUPS * stage.meshlets
        for first in range(0, self.slots, most):
            count = min(self.slots - first, most)
            own["first_slot"], own["meshlets"] = self.first_slot + first, count
            stage.pipeline.dispatch(commands, -(-count // stage.meshlets), own, stage.rows)


class BatchTable(Owner):
    """Batches and the table of their segments on the device."""

    def __init__(self, device: Device, batches: list[list[Segment]]):
        rows = np.array([astuple(segment) for batch in batches for segment in batch], np.uint32)
        table = Buffer(device, rows.nbytes).write(rows)
        super().__init__(segments=table)
        begin = np.cumsum([0, *map(len, batches)]) * SEGMENT.itemsize
        self.batches = [Batch(batch, table.address + int(at)) for batch, at in zip(batches, begin)]


def meshlets_of(scene: Scene) -> list[int]:
    """Of each instance."""
    return [scene.primitives[i.primitive].meshlets for i in scene.instances]


def slots_of(batches: list[list[Segment]]) -> int:
    """Slots that any batch needs, if all begin at slot 0."""
    return max(map(_slots_of, batches))


def _slots_of(segments: list[Segment]) -> int:
    return segments[-1].slot + segments[-1].meshlets - segments[0].slot


def schedule_whole(meshlets: Sequence[int], slots: int) -> list[list[Segment]]:
    """Batches of at most `slots` slots for the bulk passes: no segment is cut.

    meshlets: of each instance, at most `slots`. Segments begin at multiples of BULK_SLOTS.
    """
    batches: list[list[Segment]] = []
    slot = slots
    for instance, count in enumerate(meshlets):
        if slot + count > slots:
            batches.append([])
            slot = 0
        batches[-1].append(Segment(instance, 0, count, slot))
        slot += -(-count // BULK_SLOTS) * BULK_SLOTS
    return batches


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

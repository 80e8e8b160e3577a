"""The meshlets of all instances in batches that fit the slots, for paths that keep none of them.

shaders/decoders/slot_jobs.glsl describes the decoding of a batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext.ranges import begins

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
class Batch:
    """Jobs of a decoder: SEGMENTs, and the address of their table."""

    segments: np.recarray
    address: int

    @property
    def first_slot(self) -> int:
        return int(self.segments.slot[0])

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

    def __init__(self, device: Device, batches: list[np.recarray]):
        rows = np.concatenate(batches)
        table = Buffer(device, rows.nbytes).write(rows)
        super().__init__(segments=table)
        begin = np.cumsum([0, *map(len, batches)]) * SEGMENT.itemsize
        self.batches = [Batch(batch, table.address + int(at)) for batch, at in zip(batches, begin)]


def slots_of(batches: list[np.recarray]) -> int:
    """Slots that any batch needs, if all begin at slot 0."""
    return max(map(_slots_of, batches))


def _slots_of(segments: np.recarray) -> int:
    return int(segments.slot[-1]) + int(segments.meshlets[-1]) - int(segments.slot[0])


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

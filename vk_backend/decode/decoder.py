"""Decodes meshlets into slots: the one decoder of all paths that keep them there.

A Decoder owns slots and has one call, `decode`, for Jobs: meshlets and the slots that they go into.
Rasterising and ray tracing use the same class with different methods and jobs.
shaders/decoders/slots.glsl describes a slot.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.memory import Buffer, Owner
from ..gpu.pipelines import ComputePipeline, addresses
from ..scene.scene import Scene
from .slots import SlotLayout
from .structures import CONNECTED, PLACES, RASTER_PUSH


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

    @property
    def name(self) -> str:
        return self.shader.partition("_")[0]


@dataclass(frozen=True)
class Method:
    """The passes of a decoder, in order.

    slot_buffers: buffers besides the slots, in which passes leave results for later ones -> bytes
    for each slot.
    """

    passes: tuple[Pass, ...]
    slot_buffers: dict[str, int]


_BETWEEN = {"summaries": CONSTANTS["SUMMARY_BYTES"], "connectivity": CONNECTED.itemsize}
# The team decoder, for any jobs: a workgroup decodes the values of a meshlet.
TEAM = Method(
    (Pass("connect_stream.comp", 32, spread=True), Pass("values_stream.comp", 1)), _BETWEEN
)
# The bulk passes, for jobs that `bulk_fits`: a thread decodes a small part of a meshlet's boundary,
# a workgroup the interior.
BULK = Method(
    (
        Pass("connect_bulk.comp", 32, spread=True),
        Pass("lengths_bulk.comp", 8),
        Pass("corners_bulk.comp", 8, split=True),
        Pass("chains_bulk.comp", 8, split=True),
        Pass("interior_bulk.comp", 1),
    ),
    {**_BETWEEN, "places": PLACES.itemsize},
)
# For ray tracing: a team, or a thread, decodes all of a meshlet.
TRACED = Method((Pass("rt_fill.comp", 1),), {})
TRACED_SERIAL = Method((Pass("rt_fill_serial.comp", 32),), {})
# Threads of connect.comp for a meshlet, of which one works, with fewer slots: threads of a warp
# wait for each other. On an H200 this saves 0.02 of 0.05 ms for 1,100 meshlets, nothing for 5,137.
SPREAD, SPREAD_SLOTS = 16, 4000


@dataclass(frozen=True)
class Stage:
    """A pass on a device: `rows` rows of workgroups of `meshlets` meshlets each."""

    name: str
    pipeline: ComputePipeline
    meshlets: int = 1
    rows: int = 1


class Jobs(Protocol):
    """Meshlets to decode, and their slots: a batch, a list that shaders have written, a part."""

    def dispatch(self, commands: Any, stage: Stage, pushed: np.ndarray) -> None:
        """Records a stage of a decoder.

        pushed: the push constants of the stage with all fields that do not depend on the jobs:
        RASTER_PUSH, or for ray tracing FILL_PUSH.
        """


class Decoder(Owner):
    """The slots that meshlets are decoded into, and the pipelines of a method's passes.

    constants: specialisation constants of the shaders that read slots; those of the layout are
    added. CULLING: the first pass skips meshlets out of view, whose summaries say so.
    """

    def __init__(
        self,
        device: Device,
        layout: SlotLayout,
        slots: int,
        constants: dict[str, int],
        method: Method = TEAM,
    ):
        sizes = {"slots": layout.bytes, **method.slot_buffers}
        super().__init__(**{n: Buffer(device, slots * size) for n, size in sizes.items()})
        self._device, self.slots, self.method = device, slots, method
        self.constants = {**constants, **layout.constants}
        self._stages = [self._stage(p) for p in method.passes]

    def by(self, method: Method) -> Decoder:
        """A decoder into the same slots by another method, which needs no other buffers."""
        other = copy(self)
        other.method, other._stages = method, [self._stage(p) for p in method.passes]
        return other

    def _stage(self, of: Pass) -> Stage:
        spread = SPREAD if of.spread and self.slots < SPREAD_SLOTS else 1
        # Only the first pass culls. The others are the same pipelines with culling and without.
        own = {"SPREAD": spread} if of.spread else {"CULLING": 1}
        pipeline = ComputePipeline.of(self._device, of.shader, {**self.constants, **own})
        rows = self.constants["MAX_STREAMS"] if of.split else 1
        return Stage(of.name, pipeline, of.meshlets // spread, rows)

    @staticmethod
    def slot_bytes(scene: Scene) -> int:
        """Bytes of the buffers of the team decoder for each slot."""
        return SlotLayout.of(scene).bytes + sum(TEAM.slot_buffers.values())

    @property
    def per_connect(self) -> int:
        """Meshlets of a workgroup of the first pass."""
        return self._stages[0].meshlets

    @property
    def addresses(self) -> dict[str, int]:
        """Buffer addresses, by the names of RasterPush in shaders/raster/raster.glsl."""
        return addresses(RASTER_PUSH, self.buffers)

    def slot_words(self) -> np.ndarray:
        """uint32[slots, words]: what the slots hold; waits."""
        words = self.buffers["slots"].read()
        return words[: words.size // self.slots * self.slots].reshape(self.slots, -1)

    def summaries(self) -> np.ndarray:
        """uint32[slots]: triangles | vertices << 8 | error << 16 of what they hold; waits."""
        return self.buffers["summaries"].read()[: self.slots]

    def decode(self, commands: Any, jobs: Jobs, pushed: np.ndarray) -> None:
        """Records the decoding of meshlets into their slots; no barrier after the last pass.

        pushed: see Jobs.dispatch. A malformed meshlet has no triangles; its summary, if the method
        has any, has an error code.
        """
        for number, stage in enumerate(self._stages):
            if number > 0:  # a pass reads what the one before it has written
                self._device.compute_barrier(commands)
            jobs.dispatch(commands, stage, pushed)

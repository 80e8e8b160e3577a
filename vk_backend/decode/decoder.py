"""Compute shaders decode meshlets into slots: the one call of all paths that keep them there.

shaders/decoders/slots.glsl describes a slot.
"""

from __future__ import annotations

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
    """Meshlets to decode, and their slots: a batch, or a list that shaders have written."""

    def dispatch(self, commands: Any, stage: Stage, pushed: np.ndarray) -> None:
        """Records a stage of a decoder.

        pushed: the fields of RASTER_PUSH that do not depend on the jobs.
        """


class Decoder(Owner):
    """The slots that meshlets are decoded into, and the pipelines of a decoder's passes.

    passes: TEAM, which decodes any jobs, or BULK, for jobs that `bulk_fits`. constants:
    specialisation constants of the raster shaders; with those of the slots, all shaders that read
    slots need them. CULLING: the first pass skips meshlets out of view, whose summaries say so.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        slots: int,
        constants: dict[str, int],
        passes: tuple[Pass, ...] = TEAM,
    ):
        layout = SlotLayout.of(scene)
        sizes = self._slot_sizes(layout)
        if passes is BULK:
            sizes["places"] = PLACES.itemsize
        super().__init__(**{n: Buffer(device, slots * size) for n, size in sizes.items()})
        self._device, self.slots, self.passes = device, slots, passes
        self.constants = {**constants, **layout.constants}
        spread = SPREAD if slots < SPREAD_SLOTS else 1
        # Only the first pass culls. The others are the same pipelines with culling and without.
        first, later = {**self.constants, "SPREAD": spread}, {**self.constants, "CULLING": 1}
        self._stages = [
            Stage(
                p.name,
                ComputePipeline.of(device, p.shader, first if p.spread else later),
                p.meshlets // (spread if p.spread else 1),
                scene.max_streams if p.split else 1,
            )
            for p in passes
        ]

    @staticmethod
    def slot_bytes(scene: Scene) -> int:
        """Bytes of the buffers of the team decoder for each slot."""
        return sum(Decoder._slot_sizes(SlotLayout.of(scene)).values())

    @staticmethod
    def _slot_sizes(layout: SlotLayout) -> dict[str, int]:
        """Buffer of the team decoder -> its bytes for each slot."""
        return {
            "slots": layout.bytes,
            "summaries": CONSTANTS["SUMMARY_BYTES"],
            "connectivity": CONNECTED.itemsize,
        }

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

        pushed: see Jobs.dispatch. A malformed meshlet's summary has an error code and no triangles.
        """
        for number, stage in enumerate(self._stages):
            if number > 0:
                self._device.compute_barrier(commands)
            jobs.dispatch(commands, stage, pushed)

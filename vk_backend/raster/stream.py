"""Path `stream`: compute shaders decode batches of meshlets, mesh shaders draw them.

The slots are a ring. With a large scene it has two sections: one queue fills a section while
another draws the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..decode.batches import Batch, BatchTable, schedule
from ..decode.bounds import fill_bounds
from ..decode.decoder import Decoder
from ..decode.slots import SlotLayout, slots_in
from ..decode.structures import RASTER_PUSH
from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device, Timeline
from ..gpu.pipelines import push_record
from ..gpu.targets import Targets
from ..scene.drawing import DEFAULT, Drawing, Options, Step
from ..scene.instances import Run
from ..scene.scene import Scene
from ..scene.view import BLOBS, SceneView
from .graphics import Graphics, parts_of_run, raster_constants, require_team
from .pipeline import MESH

RING = 8192  # slots, unless the scene has fewer meshlets
# From this many meshlets on, filling one half of the ring while the other is drawn was faster on an
# H200; a scene then takes at least TURNS batches.
OVERLAPPED = 4096
TURNS = 3
COMPUTE_STAGE = vk.VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT
MESH_STAGE = vk.VK_PIPELINE_STAGE_2_MESH_SHADER_BIT_EXT
READ = vk.VK_ACCESS_2_SHADER_STORAGE_READ_BIT
WRITE = vk.VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT


def division(meshlets: int, slots: int) -> tuple[int, int]:
    """(sections of the ring, slots of each) for a scene with this many meshlets."""
    if meshlets < OVERLAPPED or slots == 1:
        return 1, slots
    return 2, min(slots, 2 * -(-meshlets // TURNS)) // 2


@dataclass(frozen=True)
class Overlap:
    """Decoding and drawing use a queue each: commands.py. Timelines of what is done."""

    decoded: Timeline
    drawn: Timeline
    sections: int


class StreamDrawing(Drawing):
    """Path `stream`."""

    name, capability = "stream", "mesh"
    targets: ClassVar[Any] = Targets

    def __init__(self, device: Device, scene: Scene, options: Options = DEFAULT):
        device.require(self.capability, self.name)
        require_team(device, scene, self.name, device.limits.compute_shared_bytes)
        slots = RING
        if options.cache is not None:
            slots = slots_in(options.cache, Decoder.slot_bytes(scene))
        slots = min(slots, CONSTANTS["MAX_SLOTS"])
        meshlets = scene.instance_meshlets
        sections, of_section = division(int(meshlets.sum()), slots)
        super().__init__(SceneView(device, scene, BLOBS))
        fill_bounds(self.view)
        self.slots = min(sections * of_section, int(meshlets.sum()))
        constants = raster_constants(scene, options.culling)
        self._run_numbers = scene.instances.run_numbers()
        self.decoder = self.own(Decoder(device, SlotLayout.of(scene), self.slots, constants))
        table = self.own(BatchTable(device, schedule(meshlets, of_section, sections)))
        self.batches = table.batches
        if sections > 1:
            self.overlap = Overlap(*_timelines(device), sections)
        self._graphics = Graphics(
            self.view,
            (("stream.mesh", MESH),),
            self.decoder.constants,
            options.ids,
            numbers=options.ids,
        )

    def frame(self, targets: Targets) -> list[Step]:
        return [
            step
            for number, batch in enumerate(self.batches)
            for step in (self._decoding(batch), self._drawing(batch, targets, number > 0))
        ]

    def _decoding(self, batch: Batch) -> Step:
        """Batches do not depend on the camera: the commands can be recorded once."""

        def record(commands: Any) -> None:
            # The mesh shader has read the slots that are written next; with two queues a semaphore
            # says so.
            if not self.overlap:
                self.device.barrier(commands, MESH_STAGE, 0, COMPUTE_STAGE, 0)
            pushed = push_record(RASTER_PUSH, frame=self.view.frame, **self.decoder.addresses)
            self.decoder.decode(commands, batch, pushed)

        return Step("decode", record)

    def _drawing(self, batch: Batch, targets: Targets, resumed: bool) -> Step:
        """Draws a batch over those before it."""

        def record(commands: Any) -> None:
            # A semaphore between two queues is not enough: NVIDIA's driver leaves stale data in
            # caches.
            self.device.barrier(commands, COMPUTE_STAGE, WRITE, MESH_STAGE, READ)
            pushed = push_record(RASTER_PUSH, frame=self.view.frame, **self.decoder.addresses)
            with self._graphics.rendering(commands, targets, resumed=resumed):
                for segment, count in self._draws_of(batch.segments):
                    self._draw(commands, pushed, segment, count)

        return Step("draw", record)

    def _draw(self, commands: Any, pushed: np.ndarray, segment: Any, count: int) -> None:
        """Records the draws of a segment and of the count - 1 instances after it."""
        first, meshlets, slot = int(segment.first), int(segment.meshlets), int(segment.slot)
        run = Run(int(segment.instance), count)
        self._graphics.set_sides(commands, run.first)
        for part in parts_of_run(run, meshlets):
            pushed["instance"], pushed["first"] = part.first, first
            pushed["first_slot"] = slot + (part.first - run.first) * meshlets
            self._graphics.draw_tasks(commands, pushed, meshlets, part.count, first=1, first_slot=1)

    def _draws_of(self, batch: np.recarray) -> list[tuple[Any, int]]:
        """(segment, number of segments) that one draw takes: whole instances of a run."""
        run = self._run_numbers[batch.instance]
        whole = batch.meshlets == self.scene.instance_meshlets[batch.instance]
        goes_on = (run[1:] == run[:-1]) & whole[1:] & whole[:-1]
        goes_on &= np.diff(batch.instance.astype(np.int64)) == 1  # some have no meshlets
        starts = np.flatnonzero(np.concatenate([[True], ~goes_on]))
        counts = np.diff(np.append(starts, len(batch)))
        return [(batch[start], count) for start, count in zip(starts, counts.tolist())]


def _timelines(device: Device) -> tuple[Timeline, Timeline]:
    """The device's timelines of decoding and of drawing."""
    timelines: tuple[Timeline, Timeline] = device.once(
        "ring timelines", lambda: (Timeline(device), Timeline(device))
    )
    return timelines

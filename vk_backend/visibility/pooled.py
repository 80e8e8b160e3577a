"""Path `visibility` with a pool of decoded meshlets, which stay from frame to frame.

What is new is decoded within the frame. A frame draws what was visible in the last one first, then
what is not hidden behind it. shaders/levels/jobs.glsl describes the structures.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from gltf_ext.ranges import numbers_of

from ..decode.bounds import fill_bounds
from ..decode.decoder import Decoder, Stage
from ..decode.slots import SlotLayout, slots_in
from ..decode.structures import RASTER_PUSH
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.errors import VulkanError
from ..gpu.memory import Buffer, Owner
from ..gpu.pipelines import ComputePipeline, addresses, push_record
from ..gpu.reflection import structure
from ..gpu.targets import pyramid_tiles
from ..levels.choice import Levels
from ..levels.jobs import CUT, JOB, JobList, PoolStatistics, counts_of, rows_of
from ..raster.graphics import raster_constants, require_team
from ..scene.drawing import DEFAULT, Drawing, Options, Step
from ..scene.scene import Scene
from ..scene.view import BLOBS, SceneView
from .batched import SLOTS
from .rasterizer import PIECE_WORKGROUPS, Planes, Rasterizer

FRESH = structure("Fresh")
JOB_BYTES = JOB.itemsize + 12  # with its state and its part of the others' tables
UNDECODED = CONSTANTS["UNDECODED"]
UNUSED = 0xFFFFFFFF  # no stamp, no frame
# Most notes of what was visible: with a quarter of them taken, as many clusters that are hidden are
# drawn without need.
HINTS = 1 << 20
STEPS = {name: CONSTANTS[f"STEP_{name.upper()}"] for name in ("touch", "place", "test", "next")}


# From so many instances of a meshlet on, if they are too many for the slots: keeping it costs 28
# bytes for each, decoding it for each takes most of a frame.
SHARED = 4
MOST_TABLES = 1 << 30  # bytes


def is_shared(scene: Scene) -> bool:
    """Whether frames should keep decoded meshlets although no cache was asked for.

    That is so if batches would decode each of them for many instances, and slots hold them all.
    """
    total, meshlets = int(scene.instance_meshlets.sum()), sum(p.meshlets for p in scene.primitives)
    fits = meshlets <= SLOTS < total <= MOST_TABLES // JOB_BYTES
    return fits and total >= SHARED * meshlets


def slot_bytes(scene: Scene) -> int:
    """Bytes of all buffers for each slot; there is one more, for clusters without a slot."""
    return Decoder.slot_bytes(scene) + FRESH.itemsize + 8


class AllMeshlets(Owner):
    """All meshlets of all instances: the source of clusters of a scene without levels.

    The same interface as levels.choice.Levels.
    """

    step = "cull"

    def __init__(self, device: Device, scene: Scene):
        counts, meshlets = scene.instance_meshlets, sum(p.meshlets for p in scene.primitives)
        most = int(counts.sum())
        if most > CONSTANTS["MAX_SLOTS"]:
            raise VulkanError(
                f"the instances have {most:,} meshlets, too many to keep decoded ones",
                "leave the cache out",
            )
        decoded = Buffer(device, 4 * meshlets).write(np.full(meshlets, UNDECODED, np.uint32))
        super().__init__(decoded=decoded)
        self._device, self._scene = device, scene
        self.most, self.clusters, self.decoded = most, meshlets, decoded
        rows = scene.instances.primitive
        self.table = np.zeros(self.most, JOB)
        self.table["instance"] = np.repeat(np.arange(len(rows)), counts)
        self.table["row"] = np.repeat(rows, counts)
        self.table["meshlet"] = self.table["number"] = numbers_of(np.zeros_like(counts), counts)

    def view(self) -> SceneView:
        view = SceneView(self._device, self._scene, BLOBS)
        fill_bounds(view)
        return view

    def slots(self, wanted: int) -> int:
        """Slots for decoded meshlets: no more than there are."""
        return min(wanted, self.clusters)

    def passes(self, slots: int) -> int:
        """Of a frame; all but the first have work only if the pool is too small for the view."""
        return -(-self.clusters // slots)

    before: ClassVar[list[Step]] = []

    def choose(
        self, commands: Any, frame: int, jobs: JobList, touch: Callable[[Any], None]
    ) -> None:
        # `clear` has reset the counters.
        self._device.compute_barrier(commands)
        touch(commands)

    def after(self, jobs: JobList) -> list[Step]:
        return []


class FreshClusters:
    """Jobs of a decoder: the clusters that touch.comp has given slots to."""

    def __init__(self, jobs: JobList, slots: int):
        self._jobs, self._slots = jobs, slots

    def dispatch(self, commands: Any, stage: Stage, pushed: np.ndarray) -> None:
        """See decoder.Jobs. Only for the team decoder: Cut has arguments for its two passes."""
        own = pushed.copy()
        own["meshlets"] = self._slots
        self._jobs.dispatch(commands, stage, own)


class PooledDrawing(Drawing):
    """Path `visibility` with a cache or levels, or if `is_shared`.

    levels: the source of clusters of a scene with levels. Without, a frame has several passes if
    the meshlets in view do not fit the slots.
    """

    name, capability = "visibility", "atomics64"
    targets: ClassVar[Any] = Planes

    def __init__(self, device: Device, scene: Scene, options: Options = DEFAULT):
        device.require(self.capability, self.name)
        require_team(device, scene, self.name, device.limits.compute_shared_bytes)
        slots = SLOTS
        if options.cache is not None:
            slots = slots_in(options.cache, slot_bytes(scene), spare=1)
        levels = Levels(device, scene, options.pages) if scene.has_levels else None
        source: Any = levels or AllMeshlets(device, scene)
        super().__init__(source.view())
        self.levels, self._occlusion = levels, options.occlusion and options.culling
        self._source = self.own(source)
        self.slots, self.passes = source.slots(slots), source.passes(source.slots(slots))
        # One more, for clusters without a slot.
        constants = raster_constants(scene, options.culling)
        layout = SlotLayout.of(scene)
        self._decoder = self.own(Decoder(device, layout, self.slots + 1, constants))
        self._decoder.buffers["summaries"].write(np.zeros(self.slots + 1, np.uint32))
        self._tables = self.own(self._make_tables()).buffers
        self.jobs = self.own(self._make_jobs())
        self._fresh = FreshClusters(self.jobs, self.slots)
        self._rasterizer = self.own(Rasterizer(self.view, source.most, self._decoder.constants))
        constants = {"CULLING": int(options.culling), "OCCLUSION": int(self._occlusion)}
        self._job_steps = {
            name: ComputePipeline.of(device, "touch.comp", {**constants, "STEP": step})
            for name, step in STEPS.items()
        }
        self._pyramid = ComputePipeline.of(device, "pyramid.comp", {})

    def _make_tables(self) -> Owner:
        """Of Cut, besides the source's: of each slot, of each job, and notes."""
        device, slots, most = self.device, self.slots, self._source.most
        hints = min(HINTS, 1 << (most - 1).bit_length())
        return Owner(
            fresh=Buffer(device, FRESH.itemsize * slots),
            owners=Buffer(device, 4 * slots).write(np.full(slots, UNDECODED, np.uint32)),
            stamps=Buffer(device, 4 * slots).write(np.full(slots, UNUSED, np.uint32)),
            states=Buffer(device, 4 * most),
            hints=Buffer(device, 4 * hints).write(np.full(hints, UNUSED, np.uint32)),
        )

    def _make_jobs(self) -> JobList:
        table = self._source.table
        return JobList(
            self.device,
            self._source.most,
            table,
            **addresses(CUT, {**self._tables, "decoded": self._source.decoded}),
            slots=self.slots,
            hint_mask=self._tables["hints"].size // 4 - 1,
            per_connect=self._decoder.per_connect,
            dispatch=(1, 1, 1, 0),
            small=(*rows_of(0 if table is None else len(table)), 0, 0),
            pieces=(PIECE_WORKGROUPS, 1, 0, 0),
        )

    # --- a frame ---

    def frame(self, targets: Planes) -> list[Step]:
        own = {**self._decoder.addresses, **self._rasterizer.addresses, **targets.addresses}
        jobs = self.jobs.buffer.address
        pushed = push_record(RASTER_PUSH, frame=self.view.frame, jobs=jobs, **own)
        phase, raster = self._phase(pushed), self._rasterizer
        whole = pushed.copy()
        whole["batch"] = CONSTANTS["BATCH_FIRST"] | CONSTANTS["BATCH_LAST"]
        occlusion = Step("occlusion", lambda commands: self._hide(commands, targets, pushed))
        return [
            *self._source.before,
            Step("clear", lambda commands: raster.clear(commands, targets, pushed)),
            Step(self._source.step, lambda commands: self._choose(commands, pushed)),
            *phase,
            *([occlusion, *phase] if self._occlusion else []),
            Step("resolve", lambda commands: raster.resolve(commands, targets, whole)),
            *(step for number in range(1, self.passes) for step in self._pass(number, pushed)),
            *self._source.after(self.jobs),
        ]

    def _phase(self, pushed: np.ndarray) -> list[Step]:
        """Decodes and draws the clusters that wait."""
        raster, jobs = self._rasterizer, self.jobs
        return [
            Step("decode", lambda commands: self._decode(commands, pushed)),
            Step("small", lambda commands: raster.small(commands, jobs, pushed)),
            Step("pieces", lambda commands: raster.pieces(commands, jobs, pushed)),
        ]

    def _pass(self, number: int, pushed: np.ndarray) -> list[Step]:
        """The same for clusters that found no slot in earlier passes, if there are any."""
        own = pushed.copy()
        own["batch"], own["first"] = CONSTANTS["BATCH_LAST"], number
        decode, *others = self._phase(own)

        def begin(commands: Any) -> None:
            self._job_steps["next"].dispatch(commands, 1, own)
            # It has reset the counters.
            self.device.compute_barrier(commands)
            decode.record(commands)

        raster, jobs = self._rasterizer, self.jobs
        resolve = Step("resolve", lambda commands: raster.resolve_rest(commands, jobs, own))
        return [Step("decode", begin), *others, resolve]

    def _choose(self, commands: Any, pushed: np.ndarray) -> None:
        def touch(commands: Any) -> None:
            self._record_jobs(commands, "touch", pushed)
            # The states of jobs and the number of slots are known.
            self.device.compute_barrier(commands)

        self._source.choose(commands, self.view.frame, self.jobs, touch)

    def _decode(self, commands: Any, pushed: np.ndarray) -> None:
        self._record_jobs(commands, "place", pushed)
        # It has written the arguments of the decoder's indirect dispatches.
        self.device.full_barrier(commands)
        self._decoder.decode(commands, self._fresh, pushed)
        # `small` reads the slots.
        self.device.compute_barrier(commands)

    def _hide(self, commands: Any, targets: Planes, pushed: np.ndarray) -> None:
        """Has those wait that the first phase has not drawn and does not hide."""
        columns, rows = pyramid_tiles(targets.width, targets.height)
        self._pyramid.dispatch(commands, columns, pushed, rows)
        # The test reads the pyramid.
        self.device.compute_barrier(commands)
        self._record_jobs(commands, "test", pushed)
        # The states of jobs say which ones wait.
        self.device.compute_barrier(commands)

    def _record_jobs(self, commands: Any, step: str, pushed: np.ndarray) -> None:
        columns, rows = rows_of(-(-self._source.most // CONSTANTS["CUT_THREADS"]))
        self._job_steps[step].dispatch(commands, columns, pushed, rows)

    def counts_of(self, cut: Any) -> dict[str, int]:
        return counts_of(cut)

    @property
    def statistics(self) -> PoolStatistics:
        found: PoolStatistics | None = super().statistics
        return found or PoolStatistics(**counts_of(self.jobs.cut()))

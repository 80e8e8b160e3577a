"""Path `visibility` with a pool of decoded meshlets, which stay from frame to frame.

What is new is decoded within the frame. A frame draws what was visible in the last one first, then
what is not hidden behind it. shaders/levels/jobs.glsl describes the structures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext.ranges import numbers_of

from ..decode.ring import TEAM, Ring
from ..decode.slots import SlotLayout
from ..decode.structures import CONNECTED
from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.errors import VulkanError
from ..gpu.memory import STORAGE, Buffer
from ..gpu.pipelines import ComputePipeline, addresses, push_record
from ..gpu.reflection import structure
from ..gpu.targets import pyramid_tiles
from ..raster.drawing import Mark, no_mark
from ..scene.scene import Scene
from .drawing import PIECE_WORKGROUPS, Planes, VisibilityDrawing

CUT, JOB, FRESH = map(structure, ("Cut", "Job", "Fresh"))
INDIRECT = STORAGE | vk.VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT
UNDECODED = CONSTANTS["UNDECODED"]
UNUSED = 0xFFFFFFFF  # no stamp, no frame
# Most notes of what was visible: with a quarter of them taken, as many clusters that are hidden are
# drawn without need.
HINTS = 1 << 20
STEPS = {name: CONSTANTS[f"STEP_{name.upper()}"] for name in ("touch", "place", "test", "next")}
PHASE = ("decode", "small", "pieces")


@dataclass(frozen=True)
class PoolStatistics:
    """A frame.

    clusters: to draw, with those that face away or are out of view (without levels of detail:
    meshlets of all instances); decoded: those that were not decoded yet, each once for all
    instances; hidden: those that were not drawn because others hide them; triangles: drawn, of
    clusters that are not culled.
    """

    clusters: int
    decoded: int
    hidden: int
    triangles: int

    @staticmethod
    def counts_of(cut: Any) -> dict[str, int]:
        """The fields, of CUT[()] after a frame."""
        return {
            "clusters": int(cut["clusters"]),
            "decoded": int(cut["decoded_total"]) + int(cut["fresh_total"]),
            "hidden": int(cut["hidden"]),
            "triangles": int(cut["triangles"]),
        }


class DecodedPool(Ring):
    """Slots of decoded clusters, and one for clusters without a slot.

    constants: specialisation constants.
    """

    def __init__(self, device: Device, scene: Scene, slots: int, constants: dict[str, int]):
        layout = SlotLayout.of(scene)
        self._device, self.slots, self.bulk, self.sections = device, slots + 1, False, 1
        self.constants = {**constants, **layout.constants}
        self._allocate(layout, scene.max_streams)
        self._buffers["summaries"].write(np.zeros(self.slots, np.uint32))
        self.tables = {  # of Cut
            "fresh": Buffer(device, FRESH.itemsize * slots),
            "owners": Buffer(device, 4 * slots).write(np.full(slots, UNDECODED, np.uint32)),
            "stamps": Buffer(device, 4 * slots).write(np.full(slots, UNUSED, np.uint32)),
        }
        self._buffers |= self.tables

    @staticmethod
    def slot_bytes(scene: Scene) -> int:
        """Bytes of all buffers for each slot."""
        own = CONSTANTS["SUMMARY_BYTES"] + CONNECTED.itemsize + FRESH.itemsize + 8
        return SlotLayout.of(scene).bytes + own

    @property
    def per_connect(self) -> int:
        """Clusters of a workgroup of the first pass."""
        return TEAM[0].meshlets // self._spread

    def decode_fresh(self, commands: Any, jobs: Buffer, pushed: np.ndarray) -> None:
        """Records the decoding of the clusters that `jobs` lists."""
        pushed = pushed.copy()
        pushed["meshlets"] = self.slots - 1
        (_, connect), (_, values) = self._passes
        connect.dispatch_indirect(commands, jobs, offset("connect"), pushed)
        self._device.compute_barrier(commands)
        values.dispatch_indirect(commands, jobs, offset("values"), pushed)


class PooledDrawing(VisibilityDrawing):
    """A scene ready to be drawn by path `visibility` with a pool.

    pool: bytes for decoded meshlets. If those in view do not fit, a frame has several passes.
    occlusion: skip what is hidden; only if culling is on. Raises VulkanError for a pool without a
    slot, or a scene with too many meshlets.
    """

    def __init__(
        self, *arguments: Any, pool: int | None = None, occlusion: bool = True, **options: Any
    ):
        self._pool_bytes = pool
        self._occlusion = occlusion and options.get("culling", True)
        super().__init__(*arguments, **options)
        self._make_jobs()

    # --- what to draw ---

    def _count_slots(self, ring: int) -> int:
        """Slots of the pool, without the last one."""
        meshlets = [p.meshlets for p in self.scene.primitives]
        bytes_ = DecodedPool.slot_bytes(self.scene)
        slots = (self._pool_bytes or 0) // bytes_ - 1
        if slots < 1:
            raise VulkanError(
                f"a pool of {self._pool_bytes} bytes holds no meshlet", f"use {2 * bytes_} or more"
            )
        if self._most_drawn > CONSTANTS["MAX_SLOTS"]:
            raise VulkanError(
                f"the instances have {self._most_drawn:,} meshlets, too many for a pool",
                "leave the pool out",
            )
        return min(slots, sum(meshlets))

    @property
    def _most_drawn(self) -> int:
        return int(self.scene.instance_meshlets.sum())

    @property
    def _passes(self) -> int:
        """Of a frame; all but the first have work only if the pool is too small for the view."""
        assert self.ring is not None
        meshlets = sum(p.meshlets for p in self.scene.primitives)
        return -(-meshlets // (self.ring.slots - 1))

    def _jobs_table(self) -> np.ndarray:
        """JOB[jobs]: all meshlets of all instances, in order."""
        rows, counts = self.scene.instances.primitive, self.scene.instance_meshlets
        jobs = np.zeros(counts.sum(), JOB)
        jobs["instance"], jobs["row"] = (np.repeat(a, counts) for a in (np.arange(len(rows)), rows))
        jobs["meshlet"] = jobs["number"] = numbers_of(np.zeros_like(counts), counts)
        return jobs

    def _make_decoded(self) -> Buffer:
        """The slot of each meshlet."""
        meshlets = sum(p.meshlets for p in self.scene.primitives)
        return Buffer(self.device, 4 * meshlets).write(np.full(meshlets, UNDECODED, np.uint32))

    # --- buffers ---

    def _make_ring(self, slots: int, constants: dict[str, int]) -> DecodedPool:
        return DecodedPool(self.device, self.scene, self._count_slots(slots), constants)

    def _make_jobs(self) -> None:
        assert isinstance(self.ring, DecodedPool)
        device, most = self.device, self._most_drawn
        hints = min(HINTS, 1 << (most - 1).bit_length())
        table = self._jobs_table()
        tables = {
            "decoded": self._make_decoded(),
            "states": Buffer(device, 4 * most),
            "hints": Buffer(device, 4 * hints).write(np.full(hints, UNUSED, np.uint32)),
        }
        cut = push_record(
            CUT,
            **addresses(CUT, {**self.ring.tables, **tables}),
            capacity=most,
            slots=self.ring.slots - 1,
            hint_mask=hints - 1,
            per_connect=self.ring.per_connect,
            dispatch=(1, 1, 1, 0),
            clusters=len(table),
            small=(*_rows(len(table)), 0, 0),
            pieces=(PIECE_WORKGROUPS, 1, 0, 0),
        )
        self._jobs = Buffer(device, CUT.itemsize + JOB.itemsize * most, INDIRECT)
        self._jobs.write(cut.tobytes() + table.tobytes())
        self._own |= {**tables, "jobs": self._jobs}
        constants = {"CULLING": self.ring.constants["CULLING"], "OCCLUSION": int(self._occlusion)}
        self._job_steps = {
            name: ComputePipeline.of(device, "touch.comp", {**constants, "STEP": step})
            for name, step in STEPS.items()
        }
        self._pyramid = ComputePipeline.of(device, "pyramid.comp", {})

    # --- a frame ---

    @property
    def steps(self) -> tuple[str, ...]:
        second = ("occlusion", *PHASE) if self._occlusion else ()
        later = (*PHASE, "resolve") * (self._passes - 1)
        return ("clear", "cull", *PHASE, *second, "resolve", *later)

    def record(self, commands: Any, targets: Planes, mark: Mark = no_mark) -> None:
        data = self._begin_frame(commands, targets, mark)
        self._record_choice(commands, data)
        self._end_step(commands, mark)
        self._record_phase(commands, data, mark)
        if self._occlusion:
            columns, rows = pyramid_tiles(targets.width, targets.height)
            self._pyramid.dispatch(commands, columns, data, rows)
            self.device.compute_barrier(commands)
            self._record_jobs(commands, "test", data)
            self._end_step(commands, mark)
            self._record_phase(commands, data, mark)
        data["batch"] = CONSTANTS["BATCH_FIRST"] | CONSTANTS["BATCH_LAST"]
        self._record_resolve(commands, targets, data)
        self._end_step(commands, mark)
        data["batch"] = CONSTANTS["BATCH_LAST"]
        for number in range(1, self._passes):
            data["first"] = number
            self._job_steps["next"].dispatch(commands, 1, data)
            self.device.compute_barrier(commands)
            self._record_phase(commands, data, mark)
            self._shaders["resolve"].dispatch_indirect(
                commands, self._jobs, offset("resolve"), data
            )
            self._end_step(commands, mark)

    def _record_choice(self, commands: Any, data: np.ndarray) -> None:
        """Records the choice of clusters. data: push constants."""
        self.device.compute_barrier(commands)
        self._record_jobs(commands, "touch", data)

    def _record_jobs(self, commands: Any, step: str, data: np.ndarray) -> None:
        columns, rows = _rows(-(-self._most_drawn // CONSTANTS["CUT_THREADS"]))
        self._job_steps[step].dispatch(commands, columns, data, rows)

    def _record_phase(self, commands: Any, data: np.ndarray, mark: Mark) -> None:
        """Records the decoding and drawing of the clusters that wait."""
        assert isinstance(self.ring, DecodedPool)
        self._record_jobs(commands, "place", data)
        self.device.full_barrier(commands)
        self.ring.decode_fresh(commands, self._jobs, data)
        self._end_step(commands, mark)
        for step in ("small", "pieces"):
            self._shaders[step].dispatch_indirect(commands, self._jobs, offset(step), data)
            self._end_step(commands, mark)

    @property
    def statistics(self) -> PoolStatistics:
        """Of the last frame; waits."""
        return PoolStatistics(**PoolStatistics.counts_of(self._jobs.read(CUT, 1)[0]))


def _rows(workgroups: int) -> tuple[int, int]:
    """(columns, rows) of at least so many workgroups."""
    columns = CONSTANTS["CUT_COLUMNS"]
    return min(workgroups, columns), -(-workgroups // columns)


def offset(member: str) -> int:
    """Of a member of Cut."""
    assert CUT.fields is not None
    return int(CUT.fields[member][1])

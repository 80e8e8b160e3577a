"""Levels of detail: draws what the camera needs, from a pool of fixed size.

The device chooses the clusters of each frame and says which pages it lacks. A thread of the host
reads them while frames are drawn. shaders/levels/levels.glsl describes the structures.
"""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gltf_ext.errors import MeshletError

from ..gpu import vk
from ..gpu.allocator import READBACK
from ..gpu.constants import CONSTANTS
from ..gpu.memory import Buffer
from ..gpu.pipelines import ComputePipeline, addresses, push, push_record
from ..gpu.reflection import structure
from ..levels.hierarchies import Hierarchies
from ..levels.page_pool import UPLOADS, PagePool
from ..levels.residency import Update
from ..raster.drawing import Drawing, Mark, no_mark
from ..raster.mesh import MeshDrawing
from ..scene.buffers import SceneBuffers
from ..scene.camera import Camera
from .pooled import CUT, INDIRECT, JOB, PooledDrawing, PoolStatistics, offset

CUT_PUSH = structure("CutPush")
POOL = 1 << 28  # bytes, at most, unless the user says more
# Clusters of a frame, or twice those of the top groups of all instances. If a view needs more, the
# allowed error grows.
CLUSTERS = 1 << 18
# Pages are asked for from this share of the allowed error on, so that they are there when it is
# reached: in flights of 150 frames (bench vulkan_lod, scenes 1 and 1:4e6, 320 x 200) 99 and 95 % of
# the frames lack no page, 90 and 81 % with 1.0.
AHEAD = 0.7
ROUNDS = 6  # of cut.comp in a frame; the last one chooses top groups only
# The allowed error grows by GROWTH while a frame has more than FULL of the clusters that fit, and
# shrinks by SHRINK while it has less than EMPTY of them. It never shrinks in a view that was too
# full: a camera at rest gets one picture.
GROWTH, SHRINK, FULL, EMPTY = 1.25, 0.95, 0.9, 0.6
ROUND_GROWTH = 4  # of rounds.comp
MOST_GROWTH = 1e6  # in all: top groups alone may fill the slots


@dataclass(frozen=True)
class LevelStatistics(PoolStatistics):
    """A frame, see PoolStatistics.

    allowed_pixels: error that the frame was drawn with; shown_pixels: its largest error, more than
    the allowed one if pages are missing; missing_pages: visible, needed and not resident;
    resident_pages; read_bytes: of the pages that the frame added.
    """

    allowed_pixels: float
    shown_pixels: float
    missing_pages: int
    resident_pages: int
    read_bytes: int


class CutDrawing(Drawing):
    """A scene that was loaded with levels: the choice of its clusters, before a path draws them.

    pool: bytes for compressed pages, rounded down to whole pages; None: POOL, or more if the root
    pages need more. least_pixels: the error that the user allows; set it before each frame. Raises
    VulkanError if the pool does not hold the root pages, MeshletError if one is malformed.
    """

    _pool_bytes: int | None
    _jobs: Buffer

    def _make_buffers(self) -> SceneBuffers:
        self.least_pixels = 1.0
        self.refused: list[MeshletError] = []  # malformed pages
        h = self.hierarchies = Hierarchies(self.scene)
        size = self._pool_bytes
        if size is None:
            size = max(POOL, int(h.sizes[h.is_root].sum()))
        self.pool = PagePool(self.device, self.scene, h, size)
        self._pixels_per_unit = self._crowding = 1.0
        self._update = Update()  # for the next frame
        self._allowed_pixels = 0.0  # by the pool
        self._view = b""
        self._may_shrink = True  # not in a view that was too full
        self._reader = ThreadPoolExecutor(1)
        self._reading: Future[Update] | None = None
        return SceneBuffers(self.device, self.scene, frozenset(), self.pool.rows)

    @property
    def _most_drawn(self) -> int:
        h = self.hierarchies
        return min(max(CLUSTERS, 2 * h.top_clusters), h.all_clusters)

    def _make_tables(self) -> None:
        device, h = self.device, self.hierarchies
        tables = {"groups": h.groups, "runs": h.runs, "hierarchies": h.rows, "blocks": h.blocks}
        self._own |= {name: Buffer(device, t.nbytes).write(t) for name, t in tables.items()}
        self._own["requests"] = Buffer(device, 4 * len(h.sizes))
        # Requests and Cut, for the host.
        self._own["results"] = Buffer(device, 4 * len(h.sizes) + CUT.itemsize, memory=READBACK)
        self._block_total = len(h.blocks)
        self._cut, self._rounds = (
            ComputePipeline.of(device, name, {}) for name in ("cut.comp", "rounds.comp")
        )

    @property
    def resident_bytes(self) -> int:
        return super().resident_bytes + self.pool.resident_bytes

    def look(self, camera: Camera, width: int, height: int) -> None:
        super().look(camera, width, height)
        view = camera.world_to_clip(width, height).tobytes()
        self._may_shrink = self._may_shrink or view != self._view
        self._view = view
        self._pixels_per_unit = camera.pixels_per_unit(width, height)

    # --- a frame ---

    def record(self, commands: Any, targets: Any, mark: Mark = no_mark) -> None:
        """Records a frame with the pages that were read so far. Call finish after it has run."""
        self.pool.record(commands, self._update)
        self.device.compute_barrier(commands)
        mark(commands)
        super().record(commands, targets, mark)
        self._record_results(commands)

    def _record_chosen(self, commands: Any, data: np.ndarray) -> None:
        """Records what counts the slots that the chosen clusters need."""

    def _record_choice(self, commands: Any, data: np.ndarray) -> None:
        columns = CONSTANTS["CUT_COLUMNS"]
        rows = -(-self._block_total // columns)
        state = push_record(
            CUT,
            dispatch=(min(self._block_total, columns), rows, 1, 0),
            max_pixels=self._max_pixels,
        )
        begin, end = offset("dispatch"), offset("used")
        raw = vk.ffi.from_buffer(bytearray(state.tobytes()[begin:end]))
        vk.vkCmdUpdateBuffer(commands, self._jobs.handle, begin, end - begin, raw)
        requests = self._own["requests"]
        vk.vkCmdFillBuffer(commands, requests.handle, 0, requests.size, 0)
        self.device.full_barrier(commands)
        chosen = push_record(
            CUT_PUSH,
            **addresses(CUT_PUSH, self._own),
            frame=self._frame_address,
            pages=self.pool.pages.address,
            pixels_per_unit=self._pixels_per_unit,
            least_pixels=AHEAD * self.least_pixels,
            block_total=self._block_total,
            last_round=ROUNDS - 1,
        )
        for _ in range(ROUNDS):
            self._cut.dispatch_indirect(commands, self._jobs, begin, chosen)
            self.device.compute_barrier(commands)
            self._record_chosen(commands, data)
            self._rounds.dispatch(commands, 1, chosen)
            self.device.full_barrier(commands)

    def _record_results(self, commands: Any) -> None:
        # Shaders have written both by their addresses, which the validation layer does not see.
        self.device.full_barrier(commands)
        requests = self._own["requests"]
        for buffer, place, size in (
            (requests, 0, requests.size),
            (self._jobs, requests.size, CUT.itemsize),
        ):
            region = vk.VkBufferCopy(srcOffset=0, dstOffset=place, size=size)
            vk.vkCmdCopyBuffer(commands, buffer.handle, self._own["results"].handle, 1, [region])
        self.device.host_barrier(commands)

    @property
    def statistics(self) -> LevelStatistics:
        """Of the last frame that finish was called for."""
        return self._statistics

    def finish(self, wait: bool) -> bool:
        """Call after a frame has run: has the pages read that it lacks.

        wait: until they are read; otherwise a later frame gets them. Returns whether another frame
        would be the same.
        """
        requests = self._own["results"].read(np.float32, self._own["requests"].size // 4)
        asked_pixels = self._max_pixels
        self._read_statistics(requests)
        self._update = Update()
        is_older = self._reading is not None
        if self._reading is None:
            self._reading = self._reader.submit(self.pool.residency.update, requests, UPLOADS)
        if wait or self._reading.done():
            self._update, self._reading = self._reading.result(), None
            self._allowed_pixels = self._update.pixels
            self.refused += self._update.refused
        is_same = not self._update.loads and self._max_pixels == asked_pixels
        return is_same and not is_older and self._reading is None

    @property
    def _max_pixels(self) -> float:
        """The error that the next frame is drawn with, if its clusters fit."""
        return max(self.least_pixels, self._allowed_pixels) * self._crowding

    def _counts_of(self, cut: Any) -> dict[str, int]:
        """The fields of PoolStatistics, of CUT[()] after a frame."""
        return PoolStatistics.counts_of(cut)

    def _read_statistics(self, requests: np.ndarray) -> None:
        """Sets the statistics of the frame that has run, and how crowded it was."""
        cut = self._own["results"].read(CUT, 1, requests.nbytes)[0]
        allowed: np.float32 = cut["max_pixels"]
        absent = requests[~self.pool.is_resident]
        self._statistics = LevelStatistics(
            **self._counts_of(cut),
            allowed_pixels=_finite(allowed),
            shown_pixels=_finite(max(allowed, absent.max(initial=0.0))),
            missing_pages=int(np.count_nonzero(absent > allowed)),
            resident_pages=int(np.count_nonzero(self.pool.is_resident)),
            read_bytes=sum(len(blob) for _, _, blob in self._update.loads),
        )
        share = max(
            int(cut["clusters"]) / int(cut["capacity"]), int(cut["used"]) / int(cut["slots"])
        )
        rounds = int(cut["rounds"])
        if rounds > 0 or (share > FULL and self._may_shrink):
            growth = GROWTH * ROUND_GROWTH ** max(rounds - 1, 0)
            self._crowding = min(self._crowding * growth, MOST_GROWTH)
            self._may_shrink = False
        elif share < EMPTY and self._may_shrink:
            self._crowding = max(1.0, self._crowding * SHRINK)

    def chosen(self) -> np.ndarray:
        """uint32[n, 2]: (instance, cluster of its primitive) of the last frame; waits."""
        count = int(self._jobs.read(CUT, 1)["clusters"][0])
        jobs = self._jobs.read(JOB, count, CUT.itemsize)
        return np.stack([jobs["instance"], jobs["number"]], axis=1)

    def free(self) -> None:
        self._reader.shutdown()
        super().free()
        self.pool.free()


class LevelsDrawing(CutDrawing, PooledDrawing):
    """By path visibility. ring: decoded clusters that are kept."""

    def _count_slots(self, ring: int) -> int:
        h = self.hierarchies
        return min(max(ring, h.unique_top_clusters), int(h.clusters.sum()))

    @property
    def _passes(self) -> int:
        return 1  # the allowed error grows until the clusters in view fit

    def _jobs_table(self) -> np.ndarray:
        return np.zeros(0, JOB)  # cut.comp makes the jobs

    def _make_decoded(self) -> Buffer:
        return self.pool.decoded

    def _make_jobs(self) -> None:
        super()._make_jobs()
        self._make_tables()

    def _record_chosen(self, commands: Any, data: np.ndarray) -> None:
        self._record_jobs(commands, "touch", data)
        self.device.compute_barrier(commands)

    @property
    def steps(self) -> tuple[str, ...]:
        return ("upload", *("cut" if step == "cull" else step for step in super().steps))


class MeshLevelsDrawing(CutDrawing, MeshDrawing):
    """By paths mesh and mesh-paper: task workgroups test the clusters of the list of jobs.

    All clusters that are launched are decoded in each frame.
    """

    jobs: ClassVar[bool] = True

    def __init__(self, *arguments: Any, pool: int | None = None, **options: Any):
        self._pool_bytes = pool
        super().__init__(*arguments, **options)
        # A slot, which nothing uses.
        cut = push_record(CUT, capacity=self._most_drawn, slots=1, per_task=self.path.workgroup)
        self._jobs = Buffer(self.device, CUT.itemsize + JOB.itemsize * self._most_drawn, INDIRECT)
        self._own |= {"jobs": self._jobs.write(cut.tobytes()), "decoded": self.pool.decoded}
        self._make_tables()

    @property
    def steps(self) -> tuple[str, ...]:
        return ("upload", "cut", *super().steps)

    def _begin_frame(self, commands: Any, mark: Mark) -> None:
        super()._begin_frame(commands, mark)
        self._record_choice(commands, self._push_constants())
        mark(commands)

    def _draw_all(self, commands: Any, data: np.ndarray) -> None:
        """Records a draw of all jobs for each kind of sides that instances show."""
        draw = self.device.function("vkCmdDrawMeshTasksIndirectEXT")
        for sides, instance in self._instance_of_sides().items():
            self._set_sides(commands, instance)
            data["sides"] = sides
            push(commands, self._layout, data)
            draw(commands, self._jobs.handle, offset("tasks"), 1, CUT["tasks"].itemsize)

    def _instance_of_sides(self) -> dict[int, int]:
        """SIDES_ -> an instance that shows them. As visible_sides of task_tests.glsl."""
        found: dict[int, int] = {}
        for number in (run.first for run in self.scene.instances.runs):
            instance = self.scene.instances[number]
            both = self.scene.materials[instance.material].double_sided
            name = "BOTH" if both else "MIRRORED" if instance.mirrored else "FRONT"
            found.setdefault(CONSTANTS[f"SIDES_{name}"], number)
        return found

    def _counts_of(self, cut: Any) -> dict[str, int]:
        counters = self._counters()
        counts = {name: int(counters[name]) for name in ("hidden", "triangles")}
        return {"clusters": int(cut["clusters"]), "decoded": int(counters["launched"]), **counts}


def _finite(pixels: np.float32) -> float:
    """For JSON: errors are infinite at the eye, and if top groups only fit a frame."""
    return float(min(pixels, np.finfo(np.float32).max))

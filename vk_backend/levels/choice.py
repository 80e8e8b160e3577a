"""Levels of detail: chooses the clusters that the camera needs, from a pool of fixed size.

The device chooses the clusters of each frame and says which pages it lacks. A thread of the host
reads them while frames are drawn. shaders/levels/levels.glsl describes the structures.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext.errors import MeshletError

from ..decode.decoder import Stage
from ..gpu import vk
from ..gpu.allocator import READBACK
from ..gpu.device import Device
from ..gpu.memory import Buffer, Owner
from ..gpu.pipelines import ComputePipeline, addresses, push_record
from ..gpu.reflection import structure
from ..scene.camera import Camera
from ..scene.drawing import Step
from ..scene.scene import Scene
from ..scene.view import SceneView
from .hierarchies import Hierarchies
from .jobs import CUT, JobList, PoolStatistics, offset, rows_of
from .motion import Motion
from .page_pool import UPLOADS, PagePool
from .residency import Update

CUT_PUSH, AHEAD_VIEW = map(structure, ("CutPush", "Ahead"))
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
MOST_PIXELS = float(np.finfo(np.float32).max)  # shaders have the error as a float
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


class Levels(Owner):
    """A scene that was loaded with levels: its pages, and the choice of clusters for each frame.

    A source of clusters for the drawings of several paths. pages: bytes for compressed pages,
    rounded down to whole pages; None: POOL, or more if the root pages need more. most: clusters of
    a frame. statistics: of the last frame that finish was called for. refused: what was wrong with
    malformed pages. Raises VulkanError if the root pages do not fit, MeshletError if one is
    malformed.
    """

    step = "cut"  # the name of the choice among the steps of a frame
    table: np.ndarray | None = None  # cut.comp makes the jobs
    statistics: LevelStatistics

    def __init__(self, device: Device, scene: Scene, pages: int | None = None):
        h = Hierarchies(scene)
        size = max(POOL, int(h.sizes[h.is_root].sum())) if pages is None else pages
        pool = PagePool(device, scene, h, size)
        tables = {"groups": h.groups, "runs": h.runs, "hierarchies": h.rows, "blocks": h.blocks}
        super().__init__(
            **pool.buffers,
            **{name: Buffer(device, table.nbytes).write(table) for name, table in tables.items()},
            # Of each page now, and of each where the camera will be.
            requests=Buffer(device, 8 * len(h.sizes)),
            ahead=Buffer(device, AHEAD_VIEW.itemsize),
            # Requests and Cut, for the host.
            results=Buffer(device, 8 * len(h.sizes) + CUT.itemsize, memory=READBACK),
        )
        self.hierarchies, self.pool, self._block_total = h, pool, len(h.blocks)
        self._requests, self._results = self.buffers["requests"], self.buffers["results"]
        self.most = min(max(CLUSTERS, 2 * h.top_clusters), h.all_clusters)
        self.decoded = pool.decoded
        self.refused: list[MeshletError] = []
        self._device, self._scene = device, scene
        self._cut = Stage("dispatch", ComputePipeline.of(device, "cut.comp", {}))
        self._rounds = ComputePipeline.of(device, "rounds.comp", {})
        self._least_pixels = self._pixels_per_unit = self._crowding = self._near = 1.0
        self._update = Update()  # for the next frame
        self._allowed_pixels = 0.0  # by the pool
        self._view = b""
        self._motion = Motion()
        self._ahead = b""  # AHEAD_VIEW of later frames; empty if the camera stands still
        self._may_shrink = True  # not in a view that was too full
        self._reader = ThreadPoolExecutor(1)
        self._reading: Future[Update] | None = None

    def view(self) -> SceneView:
        """The scene's view, with the resident pages as its table of primitives."""
        return SceneView(self._device, self._scene, frozenset(), self.pool.rows)

    def slots(self, wanted: int) -> int:
        """Slots for decoded clusters: at least those of the top groups, no more than are drawn."""
        h = self.hierarchies
        return max(min(wanted, h.most_at_once), h.unique_top_clusters)

    def passes(self, slots: int) -> int:
        """Of a frame: the allowed error grows until the clusters in view fit."""
        return 1

    def look(self, camera: Camera, width: int, height: int, least_pixels: float) -> None:
        """Sets the camera of later frames, and the error that the user allows."""
        view = camera.world_to_clip(width, height).tobytes()
        self._may_shrink = self._may_shrink or view != self._view
        self._view, self._least_pixels = view, min(least_pixels, MOST_PIXELS)
        self._pixels_per_unit = camera.pixels_per_unit(width, height)
        self._near = camera.near
        later = self._motion.see(camera, time.perf_counter())
        self._ahead = self._ahead_view(later, width, height) if later else b""

    def _ahead_view(self, camera: Camera, width: int, height: int) -> bytes:
        return push_record(
            AHEAD_VIEW,
            world_to_clip=camera.world_to_clip(width, height).T,
            eye=camera.eye,
            requests=self._requests.address + self._requests.size // 2,
        ).tobytes()

    # --- a frame ---

    @property
    def before(self) -> list[Step]:
        """First in a frame: uploads the pages that were read so far."""

        def record(commands: Any) -> None:
            self.pool.record(commands, self._update)
            # Culling reads the bounds of the new pages.
            self._device.compute_barrier(commands)

        return [Step("upload", record)]

    def choose(
        self, commands: Any, frame: int, jobs: JobList, touch: Callable[[Any], None] | None = None
    ) -> None:
        """Records the choice of clusters. frame: address of its record.

        touch: records what counts the slots that the chosen clusters need.
        """
        state = push_record(
            CUT, dispatch=(*rows_of(self._block_total), 1, 0), max_pixels=self._max_pixels
        )
        begin, end = offset("dispatch"), offset("used")
        raw = vk.ffi.from_buffer(bytearray(state.tobytes()[begin:end]))
        vk.vkCmdUpdateBuffer(commands, jobs.buffer.handle, begin, end - begin, raw)
        vk.vkCmdFillBuffer(commands, self._requests.handle, 0, self._requests.size, 0)
        ahead = self.buffers["ahead"]
        if self._ahead:
            raw = vk.ffi.from_buffer(self._ahead)
            vk.vkCmdUpdateBuffer(commands, ahead.handle, 0, len(self._ahead), raw)
        # cut.comp takes its arguments from here, and adds to both.
        self._device.full_barrier(commands)
        pushed = push_record(
            CUT_PUSH,
            **addresses(CUT_PUSH, self.buffers) | {"ahead": ahead.address if self._ahead else 0},
            frame=frame,
            jobs=jobs.buffer.address,
            pixels_per_unit=self._pixels_per_unit,
            least_pixels=AHEAD * self._least_pixels,
            block_total=self._block_total,
            last_round=ROUNDS - 1,
            near=self._near,
        )
        for _ in range(ROUNDS):
            jobs.dispatch(commands, self._cut, pushed)
            # The list is complete, for touch.comp and for rounds.comp.
            self._device.compute_barrier(commands)
            if touch:
                touch(commands)
            self._rounds.dispatch(commands, 1, pushed)
            # It has written the arguments of the next indirect dispatch.
            self._device.full_barrier(commands)

    def after(self, jobs: JobList) -> list[Step]:
        """Last in a frame: copies for the host what was chosen and what lacks."""

        def record(commands: Any) -> None:
            # Shaders have written both by their addresses, which the validation layer does not see.
            self._device.full_barrier(commands)
            size, target = self._requests.size, self._results.handle
            for buffer, place, count in (
                (self._requests, 0, size),
                (jobs.buffer, size, CUT.itemsize),
            ):
                region = vk.VkBufferCopy(srcOffset=0, dstOffset=place, size=count)
                vk.vkCmdCopyBuffer(commands, buffer.handle, target, 1, [region])
            self._device.host_barrier(commands)  # for `finish`

        return [Step("report", record)]

    def finish(self, wait: bool, counts_of: Callable[[Any], dict[str, int]]) -> bool:
        """Call after a frame has run: has the pages read that it lacks.

        wait: until they are read; otherwise a later frame gets them. counts_of: CUT[()] -> the
        fields of PoolStatistics. Returns whether another frame would be the same.
        """
        requests, ahead = self._results.read(np.float32, self._requests.size // 4).reshape(2, -1)
        cut = self._results.read(CUT, 1, self._requests.size)[0]
        asked_pixels = self._max_pixels
        self._read_statistics(requests, cut, counts_of(cut))
        self._update = Update()
        is_older = self._reading is not None
        if self._reading is None:
            update = self.pool.residency.update
            # Nothing moves while one waits.
            later = ahead if self._ahead and not wait else None
            self._reading = self._reader.submit(update, requests, UPLOADS, later)
        if wait or self._reading.done():
            self._update, self._reading = self._reading.result(), None
            self._allowed_pixels = self._update.pixels
            self.refused += self._update.refused
        is_same = not self._update.loads and self._max_pixels == asked_pixels
        return is_same and not is_older and self._reading is None

    @property
    def is_reading(self) -> bool:
        """Whether pages are being read, or not yet uploaded."""
        return self._reading is not None or bool(self._update.loads)

    @property
    def _max_pixels(self) -> float:
        """The error that the next frame is drawn with, if its clusters fit."""
        return min(max(self._least_pixels, self._allowed_pixels) * self._crowding, MOST_PIXELS)

    def _read_statistics(self, requests: np.ndarray, cut: Any, counts: dict[str, int]) -> None:
        """Sets the statistics of the frame that has run, and how crowded it was."""
        allowed: np.float32 = cut["max_pixels"]
        absent = requests[~self.pool.is_resident]
        self.statistics = LevelStatistics(
            **counts,
            allowed_pixels=_finite(allowed),
            shown_pixels=_finite(max(allowed, absent.max(initial=0.0))),
            missing_pages=int(np.count_nonzero(absent > allowed)),
            resident_pages=int(np.count_nonzero(self.pool.is_resident)),
            read_bytes=sum(len(blob) for _, _, blob in self._update.loads),
        )
        share = int(cut["clusters"]) / int(cut["capacity"])
        if int(cut["slots"]) < self.hierarchies.most_at_once:  # else there is always a slot
            share = max(share, int(cut["used"]) / int(cut["slots"]))
        rounds = int(cut["rounds"])
        if rounds > 0 or (share > FULL and self._may_shrink):
            growth = GROWTH * ROUND_GROWTH ** max(rounds - 1, 0)
            self._crowding = min(self._crowding * growth, MOST_GROWTH)
            self._may_shrink = False
        elif share < EMPTY and self._may_shrink:
            self._crowding = max(1.0, self._crowding * SHRINK)

    def free(self) -> None:
        """Ends the reading and frees the memory; a second call does nothing."""
        self._reader.shutdown()
        self.pool.end_reading()
        super().free()


def _finite(pixels: np.float32) -> float:
    """For JSON: errors are infinite at the eye, and if top groups only fit a frame."""
    return min(float(pixels), MOST_PIXELS)

"""Paths `mesh` and `mesh-paper`: task shaders choose meshlets, mesh shaders decode and output them.

shaders/raster/tasks.glsl describes what they share, shaders/raster/task_tests.glsl the choice.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from gltf_ext.ranges import begins

from ..decode.structures import RASTER_PUSH
from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.limits import MAX_WORKGROUPS
from ..gpu.memory import Buffer
from ..gpu.pipelines import ComputePipeline, addresses, push, push_record
from ..gpu.reflection import structure
from ..gpu.targets import DepthTargets, pyramid_tiles
from .drawing import BLOBS, Drawing, Mark, Path, no_mark, parts_of_run
from .pipeline import MESH, TASK

TASK_PUSH, TASK_COUNTERS = map(structure, ("TaskPush", "TaskCounters"))
# Most notes of what was visible, a bit each. With more meshlets, some share a note.
HINTS = 1 << 22


@dataclass(frozen=True)
class TaskStatistics:
    """The meshlets of a frame.

    tested: by task shaders; launched: given to mesh shaders; hidden: in view, but not launched
    because others hide them. All others face away or are out of view.
    """

    tested: int
    launched: int
    hidden: int


class MeshDrawing(Drawing):
    """A scene ready to be drawn by path `mesh` or `mesh-paper`.

    occlusion: skip what is hidden; only if culling is on.
    """

    targets: ClassVar[Any] = DepthTargets
    jobs: ClassVar[bool] = False  # draws clusters from a list, not the meshlets of the instances

    def __init__(self, *arguments: Any, occlusion: bool = True, **options: Any):
        super().__init__(*arguments, **options)
        culling = options.get("culling", True)
        self._occlusion = occlusion and culling
        names = ("FIRST", "SECOND") if self._occlusion else ("VISIBLE",) if culling else ("ALL",)
        self._phases = [CONSTANTS[f"PHASE_{name}"] for name in names]
        workgroups = -(-self._most_drawn // self.path.workgroup)
        self._hints = min(HINTS, 1 << max(self._most_drawn - 1, 31).bit_length())
        # The counters, then a word for each workgroup: what the first phase launches.
        size = TASK_COUNTERS.itemsize + 4 * workgroups
        self._own |= {
            "counters": Buffer(self.device, size),
            "hints": Buffer(self.device, self._hints // 8).write(bytes(self._hints // 8)),
        }
        self._pyramid = ComputePipeline.of(self.device, "pyramid.comp", {"PIXEL_WORDS": 1})

    def _make_pipelines(self, constants: dict[str, int]) -> None:
        # The phase says whether to cull: the same pipeline with culling and without.
        own = {"CULLING": 1, "JOBS": int(self.jobs), "PIXEL_WORDS": 1}
        super()._make_pipelines({**constants, **own})

    @property
    def _reads_numbers(self) -> bool:
        return self.ids or self.jobs

    @cached_property
    def _first_workgroups(self) -> np.ndarray:
        """int64[instances + 1]: number of each instance's first task workgroup."""
        return begins(-(-self.scene.instance_meshlets // self.path.workgroup))

    @property
    def _most_drawn(self) -> int:
        """Places of meshlets that are drawn at a time, at most."""
        return self.path.workgroup * int(self._first_workgroups[-1])

    # --- a frame ---

    @property
    def steps(self) -> tuple[str, ...]:
        return ("draw", "occlusion", "draw") if self._occlusion else ("draw",)

    def record(self, commands: Any, targets: DepthTargets, mark: Mark = no_mark) -> None:
        self._begin_frame(commands, mark)
        for number, phase in enumerate(self._phases):
            if number > 0:
                self._record_pyramid(commands, targets)
                mark(commands)
            self._begin(commands, targets, resumed=number > 0)
            pixels = targets.pixels.address
            self._draw_all(commands, self._push_constants(phase=phase, pixels=pixels))
            vk.vkCmdEndRendering(commands)
            mark(commands)

    def _begin_frame(self, commands: Any, mark: Mark) -> None:
        """Records what comes before the draws."""
        counters = self._own["counters"]
        vk.vkCmdFillBuffer(commands, counters.handle, 0, counters.size, 0)
        self.device.full_barrier(commands)

    def _record_pyramid(self, commands: Any, targets: DepthTargets) -> None:
        targets.copy_depths(commands)
        self.device.full_barrier(commands)
        pixels = targets.pixels.address
        data = push_record(RASTER_PUSH, frame=self._frame_address, pixels=pixels)
        columns, rows = pyramid_tiles(targets.width, targets.height)
        self._pyramid.dispatch(commands, columns, data, rows)
        self.device.full_barrier(commands)

    def _draw_all(self, commands: Any, data: np.ndarray) -> None:
        """Records the draws of all meshlets. data: push constants."""
        draw = self.device.function("vkCmdDrawMeshTasksEXT")
        begin, meshlets = self._first_workgroups, self.path.workgroup
        for run in self.scene.instances.runs:
            self._set_sides(commands, run.first)
            workgroups = int(begin[run.first + 1] - begin[run.first])
            for part in parts_of_run(run, workgroups):
                data["instance"] = part.first
                # Every device can draw MAX_WORKGROUPS of them, with 32 mesh workgroups each.
                for first in range(0, workgroups, MAX_WORKGROUPS):
                    data["first"] = meshlets * first
                    data["first_place"] = meshlets * (begin[part.first] + first)
                    push(commands, self._layout, data)
                    draw(commands, min(workgroups - first, MAX_WORKGROUPS), part.count, 1)

    def _push_constants(self, **fields: Any) -> np.ndarray:
        drawn = self._own["counters"].address + TASK_COUNTERS.itemsize
        return push_record(
            TASK_PUSH,
            frame=self._frame_address,
            hint_mask=self._hints - 1,
            drawn=drawn,
            **addresses(TASK_PUSH, self._own),
            **fields,
        )

    def _counters(self) -> Any:
        """TASK_COUNTERS[()] of the last frame; waits."""
        return self._own["counters"].read(TASK_COUNTERS, 1)[0]

    @property
    def tasks(self) -> TaskStatistics:
        """Of the last frame; waits."""
        counters = self._counters()
        return TaskStatistics(*(int(counters[name]) for name in ("tested", "launched", "hidden")))


def _path(name: str, meshlets: int, words: int, threads: int) -> Path:
    """meshlets: of a task workgroup; words: passed on for each; threads: that decode one."""
    constants = {"TASK_MESHLETS": meshlets, "PAYLOAD_WORDS": words, "MESH_THREADS": threads}
    return Path(
        name,
        BLOBS,
        (("mesh.task", TASK), ("mesh.mesh", MESH)),
        MeshDrawing,
        "mesh",
        workgroup=meshlets,
        teams="mesh_shared_bytes",
        payload=4 * (1 + meshlets * words),
        constants=tuple(constants.items()),
    )


MESH_PATHS = (
    # 32 meshlets, as usual on GPUs for drawing. On an H200, which runs graphics on few of its
    # multiprocessors, 16, 8 or 4 take 0.87, 0.76, 0.74 times the time for the dragon, and 0.99 to
    # 1.10 times for bunny and suzanne.
    _path("mesh", 32, 1, 32),
    # Fewer, because the payload is large: there, 32, 16 or 4 take 1.85, 1.43, 0.88 times the time
    # of 8 for the dragon. The paper has 16 threads in the mesh stage; 32 take 0.88 times the time.
    _path("mesh-paper", 8, CONSTANTS["PAPER_WORDS"], 16),
)

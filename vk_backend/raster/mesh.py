"""Paths `mesh` and `mesh-paper`: task shaders choose meshlets, mesh shaders decode and output them.

shaders/raster/tasks.glsl describes what they share, shaders/raster/task_tests.glsl the choice.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gltf_ext.ranges import begins

from ..decode.bounds import fill_bounds
from ..decode.structures import RASTER_PUSH
from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.limits import Limits
from ..gpu.memory import Buffer, Owner
from ..gpu.pipelines import ComputePipeline, addresses, push_record
from ..gpu.reflection import structure
from ..gpu.targets import DepthTargets, pyramid_tiles
from ..levels.choice import Levels
from ..levels.jobs import CUT, JobList, offset
from ..scene.buffers import require_payload
from ..scene.drawing import DEFAULT, Drawing, Options, Step
from ..scene.scene import Scene
from ..scene.view import BLOBS, SceneView
from .graphics import Graphics, parts_of_run, raster_constants, require_team
from .pipeline import MESH, TASK

TASK_PUSH, TASK_COUNTERS = map(structure, ("TaskPush", "TaskCounters"))
STAGES = (("mesh.task", TASK), ("mesh.mesh", MESH))
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


@dataclass(frozen=True)
class MeshPath:
    """meshlets: of a task workgroup; words: passed on for each; threads: that decode one."""

    name: str
    meshlets: int
    words: int
    threads: int

    @property
    def payload(self) -> int:
        """Bytes that a task workgroup passes to mesh workgroups."""
        return 4 * (1 + self.meshlets * self.words)

    def shared_bytes(self, limits: Limits) -> int:
        """Shared memory that a team may use: the payload takes some of a mesh workgroup's."""
        return min(limits.mesh_shared_bytes, limits.mesh_total_bytes - self.payload)

    @property
    def constants(self) -> dict[str, int]:
        """Specialisation constants by name."""
        return {
            "TASK_MESHLETS": self.meshlets,
            "PAYLOAD_WORDS": self.words,
            "MESH_THREADS": self.threads,
        }


MESH_PATHS = (
    # 32 meshlets, as usual on GPUs for drawing. On an H200, which runs graphics on few of its
    # multiprocessors, 16, 8 or 4 take 0.87, 0.76, 0.74 times the time for the dragon, and 0.99 to
    # 1.10 times for bunny and suzanne.
    MeshPath("mesh", 32, 1, 32),
    # Fewer, because the payload is large: there, 32, 16 or 4 take 1.85, 1.43, 0.88 times the time
    # of 8 for the dragon. The paper has 16 threads in the mesh stage; 32 take 0.88 times the time.
    MeshPath("mesh-paper", 8, CONSTANTS["PAPER_WORDS"], 16),
)


class MeshDrawing(Drawing):
    """Path `mesh` or `mesh-paper`. All meshlets that are launched are decoded in each frame.

    levels: the source of clusters of a scene with levels.
    """

    capability = "mesh"
    targets: ClassVar[Any] = DepthTargets

    def __init__(self, path: MeshPath, device: Device, scene: Scene, options: Options = DEFAULT):
        device.require(self.capability, path.name)
        require_payload(device, path.name, path.payload)
        require_team(device, scene, path.name, path.shared_bytes(device.limits))
        levels = Levels(device, scene, options.pages) if scene.has_levels else None
        super().__init__(levels.view() if levels else SceneView(device, scene, BLOBS))
        self._path, self.levels = path, levels
        if levels:
            self.own(levels)
            most = levels.most
            # A slot, which nothing uses.
            self.jobs = self.own(JobList(device, most, slots=1, per_task=path.meshlets))
        else:
            fill_bounds(self.view)
            # The number of each instance's first task workgroup.
            self._begin = begins(-(-scene.instance_meshlets // path.meshlets))
            most = path.meshlets * int(self._begin[-1])
        phases = ("FIRST", "SECOND") if options.occlusion else ("VISIBLE",)
        names = phases if options.culling else ("ALL",)
        self._phases = [CONSTANTS[f"PHASE_{name}"] for name in names]
        self.hints = min(HINTS, 1 << max(most - 1, 31).bit_length())
        # The counters, then a word for each workgroup: what the first phase launches.
        size = TASK_COUNTERS.itemsize + 4 * -(-most // path.meshlets)
        notes = Buffer(device, self.hints // 8).write(bytes(self.hints // 8))
        self._own = self.own(Owner(counters=Buffer(device, size), hints=notes)).buffers
        numbers = options.ids or levels is not None
        # The phase says whether to cull: the same pipeline with culling and without.
        constants = raster_constants(scene, culling=True) | path.constants
        constants |= {"JOBS": int(levels is not None), "PIXEL_WORDS": 1}
        self._graphics = Graphics(self.view, STAGES, constants, options.ids, numbers=numbers)
        self._pyramid = ComputePipeline.of(device, "pyramid.comp", {"PIXEL_WORDS": 1})

    # --- a frame ---

    def frame(self, targets: DepthTargets) -> list[Step]:
        def draw(phase: int) -> Step:
            return Step("draw", lambda commands: self._draw(commands, targets, phase))

        steps = [draw(self._phases[0])]
        if len(self._phases) > 1:
            steps += [
                Step("occlusion", lambda commands: self._make_pyramid(commands, targets)),
                draw(self._phases[1]),
            ]
        if not (levels := self.levels):
            return steps
        cut = Step("cut", lambda commands: levels.choose(commands, self.view.frame, self.jobs))
        return [*levels.before, cut, *steps, *levels.after(self.jobs)]

    def _draw(self, commands: Any, targets: DepthTargets, phase: int) -> None:
        """Records the draws of a phase."""
        is_first = phase == self._phases[0]
        if is_first:
            counters = self._own["counters"]
            vk.vkCmdFillBuffer(commands, counters.handle, 0, counters.size, 0)
            # Task shaders add to the counters.
            self.device.full_barrier(commands)
        data = push_record(
            TASK_PUSH,
            **addresses(TASK_PUSH, self._own),
            frame=self.view.frame,
            hint_mask=self.hints - 1,
            drawn=self._own["counters"].address + TASK_COUNTERS.itemsize,
            pixels=targets.pixels.address,
            phase=phase,
        )
        with self._graphics.rendering(commands, targets, resumed=not is_first):
            if self.levels:
                self._draw_jobs(commands, data)
            else:
                self._draw_instances(commands, data)

    def _draw_instances(self, commands: Any, data: np.ndarray) -> None:
        meshlets = self._path.meshlets
        for run in self.scene.instances.runs:
            self._graphics.set_sides(commands, run.first)
            count = int(self._begin[run.first + 1] - self._begin[run.first])
            for part in parts_of_run(run, count):
                data["instance"] = part.first
                data["first_place"] = meshlets * self._begin[part.first]
                # Every device can draw so many, with 32 mesh workgroups each.
                self._graphics.draw_tasks(
                    commands, data, count, part.count, first=meshlets, first_place=meshlets
                )

    def _draw_jobs(self, commands: Any, data: np.ndarray) -> None:
        """Records a draw of all jobs for each kind of sides that instances show."""
        draw = self.device.function("vkCmdDrawMeshTasksIndirectEXT")
        jobs = self.jobs.buffer
        data["jobs"] = jobs.address
        for sides, instance in self._instance_of_sides().items():
            self._graphics.set_sides(commands, instance)
            data["sides"] = sides
            self._graphics.push(commands, data)
            draw(commands, jobs.handle, offset("tasks"), 1, CUT["tasks"].itemsize)

    def _instance_of_sides(self) -> dict[int, int]:
        """SIDES_ -> an instance that shows them. As visible_sides of task_tests.glsl."""
        found: dict[int, int] = {}
        for number in (run.first for run in self.scene.instances.runs):
            instance = self.scene.instances[number]
            both = self.scene.materials[instance.material].double_sided
            name = "BOTH" if both else "MIRRORED" if instance.mirrored else "FRONT"
            found.setdefault(CONSTANTS[f"SIDES_{name}"], number)
        return found

    def _make_pyramid(self, commands: Any, targets: DepthTargets) -> None:
        targets.copy_depths(commands)
        # pyramid.comp reads the depths.
        self.device.full_barrier(commands)
        data = push_record(RASTER_PUSH, frame=self.view.frame, pixels=targets.pixels.address)
        columns, rows = pyramid_tiles(targets.width, targets.height)
        self._pyramid.dispatch(commands, columns, data, rows)
        # Task shaders read the pyramid.
        self.device.full_barrier(commands)

    # --- after a frame ---

    def counts_of(self, cut: Any) -> dict[str, int]:
        counters = self._counters()
        counts = {name: int(counters[name]) for name in ("hidden", "triangles")}
        return {"clusters": int(cut["clusters"]), "decoded": int(counters["launched"]), **counts}

    def _counters(self) -> Any:
        """TASK_COUNTERS[()] of the last frame; waits."""
        return self._own["counters"].read(TASK_COUNTERS, 1)[0]

    @property
    def tasks(self) -> TaskStatistics:
        counters = self._counters()
        return TaskStatistics(*(int(counters[name]) for name in ("tested", "launched", "hidden")))

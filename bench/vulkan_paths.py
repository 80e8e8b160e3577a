"""Paths for comparison, beside those of vk_backend: uncompressed, and with the cache of the paper.

mesh-plain draws uncompressed meshlets with a mesh shader; visibility-pool is path visibility with a
pool of decoded meshlets. rt-paper has one box around each meshlet,
and rays decode meshlets that the cache lacks. rt-triangles traces the triangles of vertex and index
buffers in the driver's acceleration structure. Their shaders are in bench/shaders.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

import bench.compiled_shaders  # noqa: F401  before their structures
from vk_backend.decode.bounds import Bounds
from vk_backend.decode.decoder import Decoder, Method, Pass, Stage
from vk_backend.decode.slots import SlotLayout
from vk_backend.decode.structures import RASTER_PUSH
from vk_backend.frame_commands import FrameCommands
from vk_backend.gpu import vk
from vk_backend.gpu.constants import CONSTANTS
from vk_backend.gpu.device import Device
from vk_backend.gpu.limits import MAX_WORKGROUPS
from vk_backend.gpu.memory import Buffer
from vk_backend.gpu.pipelines import push_record
from vk_backend.gpu.reflection import structure
from vk_backend.gpu.targets import Targets
from vk_backend.raster.graphics import Graphics, parts_of_run, raster_constants
from vk_backend.raster.pipeline import MESH, TASK
from vk_backend.raytrace.acceleration import Shape
from vk_backend.raytrace.commands import MESHLET_LEVELS, FrameSubmissions
from vk_backend.raytrace.geometry import Geometry, Piece, pieces_of
from vk_backend.raytrace.pipeline import RayPipeline
from vk_backend.raytrace.rays import Tracer
from vk_backend.raytrace.tracer import BOX_TRIANGLES, RayTracer, ray_constants, require
from vk_backend.renderer import PATHS
from vk_backend.scene.buffers import SceneBuffers
from vk_backend.scene.camera import Camera
from vk_backend.scene.decoded import Decoded
from vk_backend.scene.drawing import DEFAULT, Drawing, Options, Step
from vk_backend.scene.scene import Scene
from vk_backend.scene.view import SceneView

PLAIN_PRIMITIVE, PLAIN_MESHLET, CACHED_MESHLET, PAPER_PUSH = (
    structure(name, "bench")
    for name in ("PlainPrimitive", "PlainMeshlet", "CachedMeshlet", "PaperPush")
)
NO_SLOT = 0xFFFFFFFF
PAPER_HIT = {
    "closestHitShader": "bench:paper.rchit",
    "anyHitShader": "bench:paper.rahit",
    "intersectionShader": "bench:paper.rint",
}
TRIANGLES_HIT = {
    "closestHitShader": "bench:triangles.rchit",
    "anyHitShader": "bench:triangles.rahit",
}


def plain_meshlets(decoded: Decoded) -> tuple[np.ndarray, np.ndarray]:
    """(PLAIN_MESHLET[M], uint32 words) of uncompressed meshlets.

    The words of a meshlet: its vertex numbers, then its triangles as a | b << 8 | v << 16.
    """
    counts = decoded.meshlet_triangles
    meshlet = np.repeat(np.arange(len(counts), dtype=np.uint64), 3 * counts)
    keys, local = np.unique(
        meshlet << np.uint64(32) | decoded.triangles.ravel(), return_inverse=True
    )
    first_key = np.searchsorted(keys, np.arange(len(counts) + 1, dtype=np.uint64) << np.uint64(32))
    vertex_counts = np.diff(first_key)
    corners = (local.reshape(-1, 3) - np.repeat(first_key[:-1], counts)[:, None]).astype(np.uint32)
    rows = np.zeros(len(counts), PLAIN_MESHLET)
    rows["first"] = np.cumsum(vertex_counts + counts) - (vertex_counts + counts)
    rows["counts"] = vertex_counts | counts << 8
    words = np.empty(len(keys) + len(corners), np.uint32)
    triangles_before = np.repeat(np.cumsum(counts) - counts, vertex_counts)
    words[np.arange(len(keys)) + triangles_before] = keys & np.uint64(0xFFFFFFFF)
    vertices_before = np.repeat(first_key[1:], counts)  # those of the own meshlet included
    packed = corners[:, 0] | corners[:, 1] << 8 | corners[:, 2] << 16
    words[np.arange(len(corners)) + vertices_before] = packed
    return rows, words


class PlainModel:
    """Where the shaders find the uncompressed model. address: of a PLAIN_PRIMITIVE for each."""

    def __init__(self, buffers: SceneBuffers, *, meshlets: bool):
        device, scene = buffers.device, buffers.scene
        rows = np.zeros(len(scene.primitives), PLAIN_PRIMITIVE)
        self._buffers: list[Buffer] = []
        for number, (row, primitive) in enumerate(zip(rows, scene.primitives)):
            first_index, first_vertex, _ = buffers.index_range(number)
            row["vertices"] = buffers.vertices.address + 4 * scene.vertex_floats * first_vertex
            if buffers.index_buffer:
                row["indices"] = buffers.index_buffer.address + 4 * first_index
            if meshlets:
                made = [
                    Buffer(device, data.nbytes).write(data)
                    for data in plain_meshlets(primitive.decoded())
                ]
                row["meshlets"], row["words"] = (buffer.address for buffer in made)
                self._buffers += made
        self.table = Buffer(device, rows.nbytes).write(rows)
        self._buffers.append(self.table)

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of the tables and meshlets."""
        return sum(buffer.allocated for buffer in self._buffers)

    def free(self) -> None:
        for buffer in self._buffers:
            buffer.free()


class PlainDrawing(Drawing):
    """Path mesh-plain."""

    name, capability = "mesh-plain", "mesh"
    targets: ClassVar[Any] = Targets

    def __init__(self, device: Device, scene: Scene, options: Options = DEFAULT):
        device.require(self.capability, self.name)
        super().__init__(SceneView(device, scene, frozenset({"blobs", "bounds", "vertices"})))
        buffers = self.view.buffers
        Bounds(buffers).fill()
        buffers.blobs.free()  # only the culling bounds needed them
        self._model = self.own(PlainModel(buffers, meshlets=True))
        stages = (("bench:plain.task", TASK), ("bench:plain.mesh", MESH))
        constants = raster_constants(scene, options.culling)
        self._graphics = Graphics(self.view, stages, constants, options.ids, numbers=options.ids)

    @property
    def resident_bytes(self) -> int:
        return super().resident_bytes - self.view.buffers.blobs.allocated

    def frame(self, targets: Targets) -> list[Step]:
        return [Step("draw", lambda commands: self._draw(commands, targets))]

    def _draw(self, commands: Any, targets: Targets) -> None:
        slots = self._model.table.address
        with self._graphics.rendering(commands, targets):
            data = push_record(RASTER_PUSH, frame=self.view.frame, slots=slots)
            for run, instance in self._graphics.runs(commands, data):
                meshlets = self.scene.primitives[instance.primitive].meshlets
                count = -(-meshlets // PLAIN_MESHLETS)
                for part in parts_of_run(run, count):
                    data["instance"] = part.first
                    self._graphics.draw_tasks(
                        commands, data, count, part.count, first=PLAIN_MESHLETS
                    )


POOLED = "visibility-pool"
PLAIN_MESHLETS = 32  # of a task workgroup
RASTER_PATHS = (*PATHS, PlainDrawing.name, POOLED)


def drawing_of(device: Device, scene: Scene, path: str, options: Options) -> Drawing:
    """A drawing of one of RASTER_PATHS."""
    if path == PlainDrawing.name:
        return PlainDrawing(device, scene, options)
    make, _ = PATHS["visibility" if path == POOLED else path]
    return make(device, scene, options)


class TimedDrawing:
    """One picture with one path: recorded once, run and timed any number of times.

    path: one of RASTER_PATHS. cache: see Options. targets: what it is drawn into.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        camera: Camera,
        path: str,
        width: int,
        height: int,
        *,
        cache: int | None = None,
    ):
        self.drawing = drawing_of(device, scene, path, Options(ids=False, cache=cache))
        self._size = width, height
        self.look(camera)
        self.targets = self.drawing.targets(device, width, height, ids=False)
        self._frame = FrameCommands(self.drawing, self.targets)
        self._steps = FrameCommands(self.drawing, self.targets, steps=True)

    def look(self, camera: Camera) -> None:
        """Sets the camera of later pictures."""
        self.drawing.look(camera, *self._size)

    def run(self) -> float:
        """Draws the picture; milliseconds on the GPU."""
        return self._frame.run()

    def run_steps(self) -> dict[str, float]:
        """Draws the picture; step -> milliseconds on the GPU."""
        return self._steps.run_steps()

    def free(self) -> None:
        """Frees the commands, the buffers and the targets."""
        self._frame.free()
        self._steps.free()
        self.drawing.free()
        self.targets.free()


PAPER = Method((Pass("bench:paper_fill.comp", 1),), {})


@dataclass(frozen=True)
class Listed:
    """Jobs of a decoder: the first `count` of the list in the buffer `items`."""

    count: int

    def dispatch(self, commands: Any, stage: Stage, pushed: np.ndarray) -> None:
        """See decoder.Jobs."""
        own = pushed.copy()
        own["count"] = self.count
        stage.pipeline.dispatch(commands, min(self.count, MAX_WORKGROUPS), own)


class PaperTracer(Tracer):
    """Path rt-paper: between frames, the slots go to the meshlets that most rays tested.

    cache: 0 is possible, too.
    """

    def __init__(self, device: Device, scene: Scene, *, cache: int, **light: Any):
        require(device, scene, "rt-paper")
        layout = SlotLayout.of(scene, traced=True)
        meshlets = sum(p.meshlets for p in scene.primitives)
        slots = min(cache // layout.bytes, meshlets)
        constants = ray_constants(scene, layout, CONSTANTS["MESHLET_TRIANGLES"])
        with device.free_on_error():
            view = SceneView(device, scene, frozenset({"blobs"}), matrices=False)
            rays = RayPipeline(view, PAPER_HIT, constants)
            geometry = Geometry(view, constants=constants, part_meshlets=meshlets)
            super().__init__(view, geometry, rays, **light)
            self.slots, self._missing = slots, 0
            self._decoder = Decoder(device, layout, slots, constants, PAPER)
            table = np.zeros(meshlets, CACHED_MESHLET)
            table["slot"] = np.arange(meshlets)
            table["slot"][slots:] = NO_SLOT
            self._own |= {
                "cache": self._decoder.buffers["slots"],
                "records": Buffer(device, table.nbytes).write(table),
                "items": Buffer(device, 8 * slots).write(_items(np.arange(slots), table)),
            }
            with device.commands() as commands:
                self._record_fill(commands, slots)

    def meshlet_ids(self, hits: np.ndarray) -> np.ndarray:
        return self.scene.drawn_ids(hits)

    def cached(self) -> np.ndarray:
        """CACHED_MESHLET[meshlets]: the slots, and how many rays tested each meshlet."""
        return self._own["records"].read(CACHED_MESHLET)

    def time(self, camera: Camera, width: int, height: int) -> float:
        """As Tracer.time; the time does not contain the choice of meshlets on the host."""
        self._missing = self._choose()
        return super().time(camera, width, height)

    def _choose(self) -> int:
        """Lists the meshlets that are to be decoded, and their slots; returns their number."""
        table = self.cached().copy()
        slots, tests = table["slot"], table["tests"].astype(np.int64)
        wanted = np.argsort(-tests, kind="stable")[: self.slots]
        missing = wanted[slots[wanted] == NO_SLOT]
        evicted = np.setdiff1d(np.flatnonzero(slots != NO_SLOT), wanted)
        slots[missing], slots[evicted] = slots[evicted], NO_SLOT
        table["tests"] = 0
        self._own["items"].write(_items(missing, table))
        self._own["records"].write(table)
        return len(missing)

    def record(self, submissions: FrameSubmissions, camera: Camera) -> None:
        if self._missing:
            commands = submissions.room_for(self._missing * MESHLET_LEVELS)
            self._record_fill(commands, self._missing)
        super().record(submissions, camera)

    def _record_fill(self, commands: Any, count: int) -> None:
        """Records the decoding of the first `count` items."""
        self._decoder.decode(commands, Listed(count), self.pushed(PAPER_PUSH))
        self.device.full_barrier(commands)


def _items(meshlets: np.ndarray, table: np.ndarray) -> np.ndarray:
    """uint32[n, 2]: meshlets and their slots. table: CACHED_MESHLET[meshlets]."""
    return np.column_stack([meshlets, table["slot"][meshlets]]).astype(np.uint32)


@dataclass(frozen=True)
class Triangles:
    """`count` triangles with 32-bit indices.

    vertices, indices: device addresses; stride: bytes between positions of three floats.
    """

    vertices: int
    vertex_count: int
    stride: int
    indices: int
    count: int

    def describe(self) -> tuple[int, Any]:
        data = vk.VkAccelerationStructureGeometryTrianglesDataKHR(
            vertexFormat=vk.VK_FORMAT_R32G32B32_SFLOAT,
            vertexData=vk.VkDeviceOrHostAddressConstKHR(deviceAddress=self.vertices),
            vertexStride=self.stride,
            maxVertex=self.vertex_count - 1,
            indexType=vk.VK_INDEX_TYPE_UINT32,
            indexData=vk.VkDeviceOrHostAddressConstKHR(deviceAddress=self.indices),
        )
        return vk.VK_GEOMETRY_TYPE_TRIANGLES_KHR, vk.VkAccelerationStructureGeometryDataKHR(
            triangles=data
        )


class TriangleGeometry(Geometry):
    """The triangles of each primitive in place of boxes."""

    _on_grid = False

    def _shapes(self, rows: np.ndarray, part_meshlets: int) -> tuple[list[Piece], Sequence[Shape]]:
        shapes = []
        for decoded in (primitive.decoded() for primitive in self._scene.primitives):
            positions = self._input(np.asarray(decoded.positions, np.float32))
            triangles = self._input(np.asarray(decoded.triangles, np.uint32))
            count = len(decoded.triangles)
            shapes.append(Triangles(positions, len(decoded.positions), 12, triangles, count))
        return pieces_of(rows, len(rows)), shapes


class TrianglesTracer(Tracer):
    """Path rt-triangles: nothing is compressed, and there is no cache."""

    def __init__(self, device: Device, scene: Scene, *, cache: int | None = None, **light: Any):
        device.require("raytracing", "rt-triangles")
        constants = ray_constants(scene, SlotLayout.of(scene, traced=True), BOX_TRIANGLES)
        constants["ATTRIBUTES"] = scene.attributes
        meshlets = sum(p.meshlets for p in scene.primitives)
        with device.free_on_error():
            needs = frozenset({"vertices", "indices"})
            view = SceneView(device, scene, needs, matrices=False)
            rays = RayPipeline(view, TRIANGLES_HIT, constants)
            geometry = TriangleGeometry(view, constants=constants, part_meshlets=meshlets)
            super().__init__(view, geometry, rays, **light)
            self._own["records"] = PlainModel(view.buffers, meshlets=False).table

    def meshlet_ids(self, hits: np.ndarray) -> np.ndarray:
        return self.scene.meshlet_ids(hits)


TRACERS = {"rt": RayTracer, "rt-paper": PaperTracer, "rt-triangles": TrianglesTracer}

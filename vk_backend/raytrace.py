"""Ray tracing of compressed meshlets with a cache of decoded ones, or of the uncompressed model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from . import acceleration, vk
from .acceleration import BOTTOM, BOX_BYTES, INPUT, TOP, Boxes, Instances, Structures, Triangles
from .camera import Camera
from .constants import CONSTANTS
from .device import Device
from .errors import VulkanError
from .memory import STORAGE, Buffer
from .pipelines import MAX_GROUPS, ComputePipeline, Timestamps, push, push_record, stage
from .raytrace_layout import BOXES_PUSH, CACHE_PUSH, CACHE_STATE, LISTS, RAYS_PUSH, ROUND, TRACED
from .scene import Primitive, Scene
from .scene_buffers import FRAME, SceneBuffers, require_room
from .slot_layout import SlotLayout
from .textures import TextureArray, array_size, textures_layout

PATHS = ("rt", "rt-plain", "rt-triangles")
GROUPS = (4, 8, 16, 32, 64)  # triangles behind one box

# Of shaders/raytrace/rt_constants.h, which says what they are.
MESHLET_TRIANGLES = CONSTANTS["MESHLET_TRIANGLES"]
NO_SLOT = CONSTANTS["NO_SLOT"]
REQUESTED = CONSTANTS["REQUESTED"]
COUNTED_RAY = CONSTANTS["COUNTED_RAY"]
CHOOSE_THREADS = CONSTANTS["CHOOSE_THREADS"]
BOXES_THREADS = CONSTANTS["BOXES_THREADS"]
FILL_GROUPS = CONSTANTS["FILL_GROUPS"]
NEIGHBOURS = CONSTANTS["NEIGHBOURS"]
REQUESTS = CONSTANTS["REQUESTS"]
SPREAD = CONSTANTS["SPREAD"]
SPREAD_PATHS = CONSTANTS["SPREAD_PATHS"]
PATH_BYTES = 4 * CONSTANTS["PATH_WORDS"]
MESHLET_BOX_BYTES = CONSTANTS["MESHLET_BOX_BYTES"]
HIT_WORDS = CONSTANTS["HIT_WORDS"]
INSTANCE_MASKED = CONSTANTS["INSTANCE_MASKED"]
MAX_BOUNCES = (1 << CONSTANTS["BOUNCE_BITS"]) - 1
MAX_SAMPLES = (1 << CONSTANTS["SAMPLE_BITS"]) - 1

NEVER = 1 << 31  # initial value of CacheState.seen: longer ago than any class reaches
VISIBLE = 0xFF000000  # visibility mask of an instance, in the upper 8 bits of its custom index
SHADER_GROUPS = 3  # of a pipeline: ray generation, miss, hit

# Defaults, tuned on an H200. docs/vulkan-raytracing.md describes what they control and has the
# measurements that comments here name; no record of the others was kept.

# Scratch slots, as a share of the meshlets that the cache has no room for.
SCRATCH_SHARE = 2 / 3
# At least this many, about 1 MB: models of some thousand meshlets are then cached completely.
MIN_SCRATCH = 768
# Share of all slots that a frame may reuse even if rays need their meshlets. When all could be
# reused, far more paths waited in the next frame.
ROTATING_SHARE = 1 / 2
# From this share of meshlets with slots on, one round is enough. A round without work costs 12 us.
MANY_SLOTS = 0.78
ROUNDS_WITH_MANY_SLOTS = 1
ROUNDS_WITH_FEW_SLOTS = 4
# Bounces add rounds; with requests for all meshlets on the way, 5 rounds had work instead of 8.
ROUNDS_PER_BOUNCE = 3
ROUNDED_BOUNCES = 2
# Below this share of meshlets with slots the picture is traced in about 1 / share strips.
FEW_SLOTS = 0.45
MAX_STRIPS = 16
# Prefetch rays per pixel. 1/32 took 45 us more for materialball.
AHEAD_SHARE = 1 / 64
AHEAD_FRAMES = 16
# No prefetch from this share of meshlets with slots on: little is missing.
MOST_SLOTS = 0.93
# Paths per pixel, with bounces.
DEFAULT_SAMPLES = 16
# Records of waiting paths per round: a share of the pixels, in at most a share of the slots' bytes.
RECORDS_PER_PIXEL = 1 / 128
MAX_RECORD_BYTES_SHARE = 1 / 4


@dataclass
class TracedPicture:
    """A ray-traced picture, with the first hit of each pixel's first path.

    color: uint8[height, width, 4], sRGB.
    ids: uint32[height, width, 2], instance and meshlet * 64 + triangle; 0xFFFFFFFF for a miss.
    t: float32[height, width], distance in world units; infinite for a miss.
    barycentrics: float32[height, width, 2], weights of the second and third vertex.
    milliseconds: on the GPU, including the upkeep of the cache.
    """

    color: np.ndarray
    ids: np.ndarray
    t: np.ndarray
    barycentrics: np.ndarray
    milliseconds: float


class RayTracer:
    """Renders a scene by tracing rays.

    path: "rt" (compressed), "rt-plain" (the same boxes over uncompressed meshlets) or
    "rt-triangles" (triangles that the driver intersects). cache: share of the meshlets that may
    stay decoded, 0 to 1; cache_bytes: the limit in bytes instead. bounces: diffuse bounces;
    shadows: trace shadow rays; samples: paths per pixel (None: 1, or 16 with bounces). group:
    triangles behind one box, 4 to 64, a power of two.

    If the cache does not hold all meshlets, there are scratch slots besides (scratch: share of the
    meshlets; None: 2/3 of those that do not fit the cache, at least 768). If then every meshlet
    has a slot, all are cached. Otherwise a path that needs a meshlet without a slot waits: the
    meshlet is decoded and the path goes on, up to `rounds` times. In the last round paths decode
    missing meshlets by themselves, which takes much longer.

    strips: parts of the picture, traced one after the other so that the slots suffice for each.
    predict: decode meshlets near those that rays needed ahead of time, during the first launch,
    into slots of meshlets that are less likely to be needed.
    ahead: prefetch rays as a share of the pixels, from the camera's predicted position in 16
    frames (None: 1/64 if less than 93 % of the meshlets have slots, else none).
    bounds: keep a box around each meshlet, so that a path requests the nearest missing meshlet;
    without, it requests the first one that it meets.
    paths: records of waiting paths as a share of the pixels (None: 1/128, in at most a quarter of
    the slots' memory); paths without a record start again.
    counted: keep statistics even if the cache does not need them. marked: time a frame's steps.
    Raises VulkanError if the device lacks ray tracing or memory; ValueError for an unknown group
    or a negative number.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        path: str = "rt",
        *,
        cache: float = 0.25,
        cache_bytes: int | None = None,
        bounces: int = 0,
        shadows: bool = True,
        samples: int | None = None,
        group: int = 4,
        scratch: float | None = None,
        rounds: int | None = None,
        strips: int | None = None,
        predict: bool = True,
        bounds: bool = True,
        paths: float | None = None,
        ahead: float | None = None,
        counted: bool = False,
        marked: bool = False,
    ):
        if path not in PATHS:
            raise VulkanError(
                f"there is no path {path}", f"the ray-traced ones are {', '.join(PATHS)}"
            )
        if not 0 <= cache <= 1 or (cache_bytes or 0) < 0:
            raise VulkanError(
                "the cache is a share from 0 to 1, or a number of bytes", "for example 0.25"
            )
        if group not in GROUPS:
            raise ValueError("group is 4, 8, 16, 32 or 64")
        if any((number or 0) < 0 for number in (scratch, rounds, strips, paths, ahead)):
            raise ValueError("scratch, rounds, strips, paths and ahead are not negative")
        _check_length(bounces, samples or 0)
        device.require("raytracing", path)
        if path == "rt":
            require_room(
                device,
                scene,
                path,
                device.limits.compute_shared_bytes,
                "choose --path rt-triangles or geometry",
            )
        self.device, self.scene, self.path = device, scene, path
        self.bounces, self.shadows, self.group = bounces, shadows, group
        self.predict, self.bounds, self.marked = predict, bounds, marked
        self.paths, self.ahead = paths, ahead
        self._last_place: np.ndarray | None = None
        self.samples = samples or (DEFAULT_SAMPLES if bounces else 1)
        self.buffers = SceneBuffers(
            device, scene, {"blobs"} if path == "rt" else {"vertices", "indices"}
        )
        counts = np.array([p.meshlets for p in scene.primitives], np.int64)
        self._first_meshlet, self.meshlets = np.cumsum(counts) - counts, int(counts.sum())
        self._slots = SlotLayout.of(scene, traced=True)
        self.slot_bytes = self._slots.bytes
        self._plan_cache(cache, cache_bytes, scratch, counted)
        self._plan_rounds(rounds, strips)
        self._own: dict[str, list[Buffer]] = {"tables": [], "cache": [], "lists": []}
        self._upload()
        self._build()
        self._textures = TextureArray(device, scene.textures)
        self._layout = textures_layout(device, array_size(scene.textures))
        self._waiting_rays = self._make_rays(deferred=True) if self.rounds else None
        self._rays = self._make_rays(deferred=False)
        self._make_cache()
        self._picture_size: tuple[int, int] | None = None
        self._waiting: Buffer | None = None
        self._times = Timestamps(device, 2)
        self._steps: list[str] = []
        self._pictures: list[Buffer] = []

    # --- use ---

    def render(self, camera: Camera, width: int, height: int) -> TracedPicture:
        """Renders one frame. The next one begins by updating the cache from this frame's rays."""
        milliseconds = self.time(camera, width, height)
        hits = self._hits.read().reshape(height, width, HIT_WORDS)
        ids = np.ascontiguousarray(hits[..., :2])
        if self.path == "rt-triangles":
            self._number_triangles(ids)
        floats = np.ascontiguousarray(hits[..., 2:]).view(np.float32)
        color = self._colors.read(np.uint8).reshape(height, width, 4)
        ids = self.scene.whole_ids(ids)
        return TracedPicture(color, ids, floats[..., 0], floats[..., 1:], milliseconds)

    def frames(self, cameras: Sequence[Camera], width: int, height: int) -> Iterator[TracedPicture]:
        """Renders a picture with each camera, in order."""
        for camera in cameras:
            yield self.render(camera, width, height)

    def time(self, camera: Camera, width: int, height: int) -> float:
        """Renders one frame without copying it to the host; milliseconds on the GPU."""
        if self._picture_size != (width, height):
            self._prepare(width, height)
        frames = [
            self.buffers.frame_record(camera, width, height, 0),
            self._frame_ahead(camera, width, height),
        ]
        self._frame_host.write(b"".join(frame.tobytes() for frame in frames))
        self.device.submit(self._commands)
        return float(self._times.milliseconds().sum())

    def steps(self) -> dict[str, float]:
        """Milliseconds of the last frame's steps, summed over all strips. Needs `marked`.

        Steps: choose (the meshlets for the slots), keep (decode them), rays (first launch), and
        "decode n" and "rays n" of each later round.
        """
        found = dict.fromkeys(self._steps, 0.0)
        for name, milliseconds in zip(self._steps, self._times.milliseconds()):
            found[name] += float(milliseconds)
        return found

    def statistics(self) -> dict[str, Any]:
        """Counts of the last frame.

        asked: approximate number of times that rays, including prefetch rays, needed a meshlet.
        needed: meshlets that they needed. Both are 0 if all are cached, unless `counted` is set.
        resident: meshlets that have a slot now; slots, meshlets: how many there are.
        kept: meshlets decoded before the first launch; coming: during the first launch.
        requested, waiting, restarted: lists with an item per round: meshlets that paths waited for,
        the waiting paths, and those of them that had to start again.
        """
        counts = self._counters.read() // COUNTED_RAY if self.counted else np.zeros(1, np.uint32)
        table = self._slot_table.read() if self.path == "rt" else np.zeros(0, np.uint32)
        found = {
            "asked": int(counts.sum(dtype=np.int64)),
            "needed": int(np.count_nonzero(counts)),
            "resident": int(np.count_nonzero(table < REQUESTED)),
            "slots": self.capacity + self.scratch,
            "meshlets": self.meshlets,
        }
        if self._selects:
            raw = self._state.read(np.uint8)
            state = raw[: CACHE_STATE.itemsize].view(CACHE_STATE)[0]
            rounds = raw[CACHE_STATE.itemsize :].view(ROUND)
            later = rounds[:-1].reshape(self.strips, self._round_records)[:, 1 : self.rounds + 1]
            found.update({"kept": int(state["kept"]), "coming": int(rounds[-1]["requested"])})
            found["requested"] = np.minimum(later["requested"], state["ring"]).sum(axis=0).tolist()
            found["waiting"] = (
                (np.minimum(later["waiting"], state["path_limit"]) + later["restarted"])
                .sum(axis=0)
                .tolist()
            )
            found["restarted"] = later["restarted"].sum(axis=0).tolist()
        return found

    def resident_bytes(self) -> dict[str, int]:
        """Allocated bytes of device memory by part, without pictures and textures."""
        parts = {
            "model": self.buffers.resident_bytes,
            "acceleration": self.bottom.allocated + self.top.allocated,
        }
        parts.update(
            {name: sum(b.allocated for b in buffers) for name, buffers in self._own.items()}
        )
        if self.rounds and self._picture_size and self._waiting:
            parts["lists"] += self._waiting.allocated + self._paths.allocated
        return parts

    def set_light(self, *, bounces: int, shadows: bool) -> None:
        """Changes bounces and shadows from the next frame on."""
        _check_length(bounces, self.samples)
        self.bounces, self.shadows = bounces, shadows
        if self._picture_size is not None:
            self._prepare(*self._picture_size)

    def free(self) -> None:
        """Frees the device memory; the tracer cannot be used afterwards."""
        self.buffers.free()
        self.bottom.free()
        self.top.free()
        self._textures.free()
        self._forget_pictures()
        for part in self._own.values():
            for buffer in part:
                buffer.free()
        self._frame.free()
        self._frame_host.free()

    @property
    def pipelines(self) -> list[Any]:
        """The VkPipelines that trace rays, for pipeline_statistics."""
        return [rays[0] for rays in (self._waiting_rays, self._rays) if rays]

    @property
    def rounds(self) -> int:
        """Rounds in which waiting paths go on; 0 if there are no scratch slots."""
        return self._first_rounds + self._bounce_rounds * min(self.bounces, ROUNDED_BOUNCES)

    # --- setup ---

    def _plan_cache(
        self, cache: float, cache_bytes: int | None, scratch: float | None, counted: bool
    ) -> None:
        """Decides the numbers of slots, and whether rays are counted."""
        self.capacity = self.scratch = 0
        self.all_cached = self._selects = self.counted = False
        if self.path != "rt":
            return
        wanted = (
            round(cache * self.meshlets) if cache_bytes is None else cache_bytes // self.slot_bytes
        )
        self.capacity = min(wanted, self.meshlets)
        if scratch is None:
            self.scratch = max(int(SCRATCH_SHARE * (self.meshlets - self.capacity)), MIN_SCRATCH)
        else:
            self.scratch = int(scratch * self.meshlets)
        self.all_cached = self.capacity + self.scratch >= self.meshlets
        if self.all_cached:
            self.capacity, self.scratch = self.meshlets, 0
        slots = self.capacity + self.scratch
        self._rotating = min(self.scratch, max(int(ROTATING_SHARE * slots), 1))
        self._selects = not self.all_cached and slots > 0
        self.counted = counted or self._selects

    def _plan_rounds(self, rounds: int | None, strips: int | None) -> None:
        """Decides the number of rounds and of strips."""
        share = (self.capacity + self.scratch) / max(self.meshlets, 1)
        if not self.scratch:
            self.strips, self._first_rounds, self._bounce_rounds = 1, 0, 0
        else:
            few = share < FEW_SLOTS
            fitting = min(int(1 / max(share, 1 / MAX_STRIPS)), MAX_STRIPS) if few else 1
            self.strips = strips or fitting
            usual = ROUNDS_WITH_MANY_SLOTS if share >= MANY_SLOTS else ROUNDS_WITH_FEW_SLOTS
            self._first_rounds = usual if rounds is None else rounds
            self._bounce_rounds = ROUNDS_PER_BOUNCE if rounds is None else 0
        # Of a strip, at most.
        self._round_records = self._first_rounds + self._bounce_rounds * ROUNDED_BOUNCES + 1

    def _keep(self, part: str, data: np.ndarray | int, usage: int = STORAGE) -> Buffer:
        """A buffer that stays allocated and counts as resident, in the given part."""
        size = data if isinstance(data, int) else data.nbytes
        buffer = Buffer(self.device, max(size, 4), usage)
        self._own[part].append(buffer)
        return buffer if isinstance(data, int) else buffer.write(data)

    def _upload(self) -> None:
        """Makes all buffers that the path needs, apart from pictures."""
        rows = np.zeros(len(self.scene.primitives), TRACED)
        for row, record, first in zip(rows, self.buffers.primitives, self._first_meshlet):
            row["blob"], row["blob_words"], row["first_meshlet"] = (
                record["blob"],
                record["blob_words"],
                first,
            )
            row["indices"], row["vertices"] = record["index_data"], record["vertex_data"]
        self._traced = self._keep("tables", rows)
        # Two records: of the picture, and of the prefetch picture.
        self._frame = Buffer(self.device, 2 * FRAME.itemsize)
        self._frame_host = Buffer(self.device, 2 * FRAME.itemsize, host=True)
        self._first_triangles = 0
        if self.path == "rt-plain":
            counts = np.concatenate([p.decoded().meshlet_triangles for p in self.scene.primitives])
            self._first_triangles = self._keep(
                "tables", np.concatenate([[0], np.cumsum(counts)]).astype(np.uint32)
            ).address
        self._owners = self._stamps = self._seen = None
        if self.path == "rt":
            self._slot_table = self._keep("lists", np.full(self.meshlets, NO_SLOT, np.uint32))
            self._counters = self._keep(
                "lists", np.zeros(self.meshlets if self.counted else 1, np.uint32)
            )
            self._cache = self._keep("cache", (self.capacity + self.scratch) * self.slot_bytes)
        if self._selects:
            self._seen = self._keep("lists", np.full(self.meshlets, NEVER, np.uint32))
        if self._selects and self.predict:
            self._owners = self._keep("lists", 4 * NEIGHBOURS * self.meshlets)
            self._stamps = self._keep("lists", np.zeros(self.meshlets, np.uint32))
        self._bounds = (
            self._keep("lists", self.meshlets * MESHLET_BOX_BYTES)
            if self.rounds and self.bounds
            else None
        )

    def _constants(self, elements: int, deferred: bool = False) -> dict[str, int]:
        """Specialisation constants by name.

        elements: that the stage decodes; deferred: paths wait for missing meshlets.
        """
        return {
            "MAX_STREAMS": self.scene.max_streams,
            "MAX_ELEMENTS": elements,
            "GROUP_TRIANGLES": self.group,
            "ALL_CACHED": int(self.all_cached),
            "VERTEX_FLOATS": self.scene.vertex_floats,
            "ATTRIBUTES": self.scene.attributes,
            "DEFERRED": int(deferred),
            "RESUMES": int(self.rounds > 0 and self.paths != 0),
            "COUNTED": int(self.counted),
            **self._slots.constants,
        }

    def _build(self) -> None:
        """Builds the acceleration structures: a bottom level per primitive, one top level."""
        start = Camera.fit_box(self.scene.low, self.scene.high, 1, 1)
        self._frame.write(self.buffers.frame_record(start, 1, 1, 0).tobytes())
        temporary: list[Buffer] = []
        geometries = (
            self._triangles(temporary) if self.path == "rt-triangles" else self._boxes(temporary)
        )
        self.bottom = Structures(self.device, BOTTOM, geometries)
        rows = self._instance_rows()
        self.any_masked = bool((rows["index_mask"] & INSTANCE_MASKED).any())
        placed = Buffer(self.device, rows.nbytes, INPUT).write(rows)
        temporary.append(placed)
        self.top = Structures(self.device, TOP, [Instances(placed.address, len(rows))])
        for buffer in temporary:
            buffer.free()

    def _instance_rows(self) -> np.ndarray:
        """acceleration.INSTANCE[instances]"""
        rows = np.zeros(len(self.scene.instances), acceleration.INSTANCE)
        for row, instance in zip(rows, self.scene.instances):
            primitive = self.scene.primitives[instance.primitive]
            matrix = (
                instance.matrix
                if self._in_object_space
                else instance.matrix @ _grid_to_object(primitive)
            )
            masked = self.scene.materials[instance.material].flags & (
                CONSTANTS["MATERIAL_MASK"] | CONSTANTS["MATERIAL_BLEND"]
            )
            with np.errstate(over="ignore"):
                row["transform"] = matrix[:3].astype(np.float32)
            # A flattened instance has no inverse transform, so rays cannot hit it.
            seen = (
                np.isfinite(row["transform"]).all()
                and np.linalg.matrix_rank(row["transform"][:, :3].astype(np.float64)) == 3
            )
            if not seen:
                row["transform"] = np.eye(4, dtype=np.float32)[:3]
            row["index_mask"] = (
                instance.primitive | (INSTANCE_MASKED if masked else 0) | (VISIBLE if seen else 0)
            )
            flag = (
                vk.VK_GEOMETRY_INSTANCE_FORCE_NO_OPAQUE_BIT_KHR
                if masked
                else vk.VK_GEOMETRY_INSTANCE_FORCE_OPAQUE_BIT_KHR
            )
            row["offset_flags"] = flag << 24
            row["structure"] = self.bottom.addresses[instance.primitive]
        return rows

    @property
    def _in_object_space(self) -> bool:
        """Whether rays are traced in object coordinates instead of grid coordinates."""
        return self._slots.floats or self.path != "rt"

    def _triangles(self, temporary: list[Buffer]) -> list[Triangles]:
        geometries = []
        for primitive in self.scene.primitives:
            decoded = primitive.decoded()
            positions = np.ascontiguousarray(decoded.positions, np.float32)
            triangles = np.ascontiguousarray(decoded.triangles, np.uint32)
            inputs = [
                Buffer(self.device, data.nbytes, INPUT).write(data)
                for data in (positions, triangles)
            ]
            temporary += inputs
            geometries.append(
                Triangles(inputs[0].address, len(positions), 12, inputs[1].address, len(triangles))
            )
        return geometries

    def _boxes(self, temporary: list[Buffer]) -> list[Boxes]:
        groups = MESHLET_TRIANGLES // self.group
        boxes = Buffer(self.device, self.meshlets * groups * BOX_BYTES, INPUT)
        temporary.append(boxes)
        module = "boxes.comp" if self.path == "rt" else "boxes_plain.comp"
        pipeline = ComputePipeline.of(self.device, module, self._constants(3))
        geometries = []
        with self.device.commands() as commands:
            for number, (primitive, first) in enumerate(
                zip(self.scene.primitives, self._first_meshlet)
            ):
                address = boxes.address + int(first) * groups * BOX_BYTES
                data = push_record(
                    BOXES_PUSH,
                    frame=self._frame.address,
                    traced=self._traced.address,
                    first_triangles=self._first_triangles,
                    boxes=address,
                    primitive=number,
                    meshlets=primitive.meshlets,
                    bounds=_address(self._bounds),
                    owners=_address(self._owners),
                )
                rows_of_groups = -(-primitive.meshlets // (BOXES_THREADS * MAX_GROUPS))
                count = -(-primitive.meshlets // (BOXES_THREADS * rows_of_groups))
                pipeline.dispatch(commands, count, data, rows_of_groups)
                geometries.append(Boxes(address, primitive.meshlets * groups))
        return geometries

    def _ray_stages(self, deferred: bool) -> tuple[list[Any], dict[str, int]]:
        """(stages of a pipeline, role -> index of the stages that a hit runs).

        The first stage is ray generation, the second one handles misses.
        """
        suffix = {"rt": "", "rt-plain": "_plain", "rt-triangles": "_triangles"}[self.path]
        shading = self._constants(self.scene.max_elements, deferred)
        stages = [
            stage(self.device, "rt_camera.rgen", vk.VK_SHADER_STAGE_RAYGEN_BIT_KHR, shading),
            stage(self.device, "rt_miss.rmiss", vk.VK_SHADER_STAGE_MISS_BIT_KHR, shading),
        ]
        hit = dict.fromkeys(
            ("closestHitShader", "anyHitShader", "intersectionShader"), vk.VK_SHADER_UNUSED_KHR
        )

        def add(role: str, name: str, bit: int, constants: dict[str, int]) -> None:
            hit[role] = len(stages)
            stages.append(stage(self.device, name, bit, constants))

        add(
            "closestHitShader",
            f"rt_surface{suffix}.rchit",
            vk.VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR,
            shading,
        )
        if self.path != "rt-triangles":
            name = "rt_meshlets.rint" if self.path == "rt" else "rt_plain.rint"
            add(
                "intersectionShader",
                name,
                vk.VK_SHADER_STAGE_INTERSECTION_BIT_KHR,
                self._constants(3, deferred),
            )
        if self.any_masked:
            add(
                "anyHitShader",
                f"rt_alpha{suffix}.rahit",
                vk.VK_SHADER_STAGE_ANY_HIT_BIT_KHR,
                shading,
            )
        return stages, hit

    def _make_rays(self, deferred: bool) -> tuple[Any, list[Any]]:
        """(VkPipeline, regions of its shader binding table). Tracers share equal pipelines."""
        constants = self._constants(self.scene.max_elements, deferred)
        key = (
            self.path,
            self.any_masked,
            array_size(self.scene.textures),
            self.device.pipeline_flags,
            *sorted(constants.items()),
        )
        pipeline = self.device.once(key, lambda: self._make_pipeline(deferred))
        return pipeline, self._make_binding_table(pipeline)

    def _make_pipeline(self, deferred: bool) -> Any:
        """A pipeline with three shader groups: ray generation, miss, hit."""
        device = self.device
        stages, hit = self._ray_stages(deferred)
        general = vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR
        procedural = vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_KHR
        triangles = vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR
        unused = vk.VK_SHADER_UNUSED_KHR
        group_info = vk.VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR
        none = dict.fromkeys(hit, unused)
        kind = triangles if self.path == "rt-triangles" else procedural
        groups = [
            vk.VkRayTracingShaderGroupCreateInfoKHR(
                sType=group_info, type=general, generalShader=0, **none
            ),
            vk.VkRayTracingShaderGroupCreateInfoKHR(
                sType=group_info, type=general, generalShader=1, **none
            ),
            vk.VkRayTracingShaderGroupCreateInfoKHR(
                sType=group_info, type=kind, generalShader=unused, **hit
            ),
        ]
        info = vk.VkRayTracingPipelineCreateInfoKHR(
            sType=vk.VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR,
            flags=device.pipeline_flags,
            stageCount=len(stages),
            pStages=stages,
            groupCount=SHADER_GROUPS,
            pGroups=groups,
            maxPipelineRayRecursionDepth=1,
            layout=self._layout,
        )
        pipeline = device.function("vkCreateRayTracingPipelinesKHR")(
            device.handle, None, None, 1, [info], None
        )[0]
        device.at_close(lambda: vk.vkDestroyPipeline(device.handle, pipeline, None))
        return pipeline

    def _make_binding_table(self, pipeline: Any) -> list[Any]:
        """The four regions of a shader binding table with one record, a handle, per group."""
        limits = self.device.limits
        size = limits.handle_bytes
        step = -(-size // limits.base_alignment) * limits.base_alignment
        handles = vk.ffi.new(f"char[{size * SHADER_GROUPS}]")
        get = self.device.function("vkGetRayTracingShaderGroupHandlesKHR")
        get(self.device.handle, pipeline, 0, SHADER_GROUPS, size * SHADER_GROUPS, handles)
        raw = bytes(vk.ffi.buffer(handles))
        usage = STORAGE | vk.VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR
        table = self._keep("tables", step * (SHADER_GROUPS + 1), usage)
        begin = -(-table.address // step) * step
        data = b"".join(
            raw[size * i : size * (i + 1)].ljust(step, b"\0") for i in range(SHADER_GROUPS)
        )
        table.write(data, begin - table.address)
        regions = [
            vk.VkStridedDeviceAddressRegionKHR(
                deviceAddress=begin + step * i, stride=step, size=step
            )
            for i in range(SHADER_GROUPS)
        ]
        return [*regions, vk.VkStridedDeviceAddressRegionKHR()]

    # --- the cache ---

    def _make_cache(self) -> None:
        """Makes the cache's state and pipelines and fills all slots.

        If all meshlets are cached, the state is freed again.
        """
        slots = self.capacity + self.scratch
        if self.path != "rt" or slots == 0:
            return
        self._coming_round = self.strips * self._round_records
        self._state = self._keep(
            "lists", self._first_state(), STORAGE | vk.VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT
        )
        self._lists = self._keep("lists", 0 if self.all_cached else self._first_lists())
        self._slot_meshlets = self._keep("lists", np.full(slots, NO_SLOT, np.uint32))
        constants = self._constants(self.scene.max_elements)
        steps = ("fill",) if self.all_cached else ("cache", "fill")
        self._cache_pipelines = {
            step: ComputePipeline.of(self.device, f"rt_{step}.comp", constants) for step in steps
        }
        with self.device.commands() as commands:
            self._record_fill(commands, 0)
        for buffer in (self._state, self._lists, self._slot_meshlets) if self.all_cached else ():
            self._own["lists"].remove(buffer)
            buffer.free()

    def _first_lists(self) -> np.ndarray:
        """uint32[LISTS, slots] that give each slot a meshlet, spread evenly over the model."""
        slots = self.capacity + self.scratch
        lists = np.zeros((LISTS, slots), np.uint32)
        # Slots of the lowest class go to meshlets of the highest.
        lists[0], lists[-1] = np.arange(slots), np.arange(slots) * self.meshlets // slots
        return lists

    def _first_state(self) -> np.ndarray:
        """uint8[bytes]: CacheState before the first frame: decode a meshlet for every slot."""
        state, rounds = np.zeros((), CACHE_STATE), np.zeros(self._coming_round + 1, ROUND)
        slots = self.capacity + self.scratch
        state["stable"], state["rotating"] = slots - self._rotating, self._rotating
        state["waits"], state["bounds"] = self.rounds > 0, _address(self._bounds)
        state["owners"], state["stamps"], state["seen"] = map(
            _address, (self._owners, self._stamps, self._seen)
        )
        state["ahead"] = self._frame.address + FRAME.itemsize
        state["meshlets"], state["primitives"] = self.meshlets, len(self.scene.primitives)
        state["coming_round"] = self._coming_round
        state["listed"][0, [0, -1]] = slots
        rounds["requested"][0] = slots
        rounds["fill_groups"][0] = min(slots, FILL_GROUPS), 1, 1
        return np.frombuffer(state.tobytes() + rounds.tobytes(), np.uint8)

    def _cache_data(self, record: int) -> np.ndarray:
        """Push constants of the cache's shaders. record: index of a round in CacheState."""
        return push_record(
            CACHE_PUSH,
            frame=self._frame.address,
            traced=self._traced.address,
            slot_table=self._slot_table.address,
            cache=self._cache.address,
            counters=self._counters.address,
            state=self._state.address,
            lists=self._lists.address,
            slot_meshlets=self._slot_meshlets.address,
            round=record,
        )

    def _round_offset(self, record: int, field: str) -> int:
        """Byte offset in CacheState of a field of a round."""
        return CACHE_STATE.itemsize + record * ROUND.itemsize + _offset(ROUND, field)

    def _record_fill(self, commands: Any, record: int) -> None:
        """Records the decoding of a round's meshlets."""
        fill = self._cache_pipelines["fill"]
        vk.vkCmdBindPipeline(commands, vk.VK_PIPELINE_BIND_POINT_COMPUTE, fill.handle)
        push(commands, fill.layout, self._cache_data(record))
        vk.vkCmdDispatchIndirect(
            commands, self._state.handle, self._round_offset(record, "fill_groups")
        )

    def _record_selection(self, commands: Any) -> None:
        """Records the update of the cache from the last frame's rays."""
        groups = -(-self.meshlets // CHOOSE_THREADS)
        self._cache_pipelines["cache"].dispatch(commands, groups, self._cache_data(0))
        self._barrier(commands)
        self._mark(commands, "choose")
        self._record_fill(commands, 0)
        self._barrier(commands)
        self._mark(commands, "keep")

    def _mark(self, commands: Any, name: str) -> None:
        """Records a timestamp at the end of a step, if steps are timed."""
        if self.marked:
            self._steps.append(name)
            self._times.mark(commands, len(self._steps))

    def _barrier(self, commands: Any) -> None:
        """Makes writes of shaders visible to later shaders and indirect commands."""
        shaders = (
            vk.VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT
            | vk.VK_PIPELINE_STAGE_2_RAY_TRACING_SHADER_BIT_KHR
        )
        written = vk.VK_ACCESS_2_SHADER_WRITE_BIT
        self.device.barrier(
            commands,
            shaders,
            written,
            shaders | vk.VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT,
            written | vk.VK_ACCESS_2_SHADER_READ_BIT | vk.VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT,
        )

    # --- frames ---

    def _prepare(self, width: int, height: int) -> None:
        """Makes the buffers of a picture of this size, and records its commands."""
        self._forget_pictures()
        self._strip_rows = -(-height // self.strips)
        self._plan_ahead(width, height)
        self._check_launches(width, height)
        self._make_pictures(width, height)
        marks = 2 + 2 * self._selects + self.strips * (1 + 2 * self.rounds) if self.marked else 2
        if self._times.count != marks:
            self._times = Timestamps(self.device, marks)
        self._picture_size = (width, height)
        self._commands = self._record_frame()

    def _plan_ahead(self, width: int, height: int) -> None:
        """Decides the size of the prefetch picture and the rows of the first launch for it."""
        share = self.ahead
        if share is None:
            few = self.capacity + self.scratch < MOST_SLOTS * self.meshlets
            share = AHEAD_SHARE if few else 0.0
        side = np.sqrt(share if self.rounds else 0.0)
        self._ahead_size = int(np.ceil(width * side)), int(np.ceil(height * side))
        self._ahead_rows = -(-self._ahead_size[0] * self._ahead_size[1] // width)
        self._last_place = None

    def _frame_ahead(self, camera: Camera, width: int, height: int) -> np.ndarray:
        """FRAME[()] of the prefetch picture, from the camera's extrapolated position.

        All zero if the camera does not move.
        """
        last, self._last_place = self._last_place, camera.to_world.copy()
        if self._ahead_rows == 0 or last is None or np.array_equal(last, camera.to_world):
            return np.zeros((), FRAME)
        with np.errstate(over="ignore", invalid="ignore"):
            motion = camera.to_world @ np.linalg.inv(last)
            to_world = np.linalg.matrix_power(motion, AHEAD_FRAMES) @ camera.to_world
            if not np.isfinite(to_world.astype(np.float32)).all():
                return np.zeros((), FRAME)
        # The projection of the whole picture, with fewer pixels.
        moved = replace(camera, to_world=to_world)
        record = self.buffers.frame_record(moved, width, height, 0)
        record["width"], record["height"] = self._ahead_size
        return record

    def _forget_pictures(self) -> None:
        for buffer in self._pictures:
            buffer.free()
        self._pictures = []
        if self._picture_size is not None:
            vk.vkFreeCommandBuffers(self.device.handle, self.device.pool, 1, [self._commands])
        self._picture_size = None

    def _check_launches(self, width: int, height: int) -> None:
        """Raises VulkanError if the picture is too large for one launch.

        Launches of later rounds have one dimension: shaders/raytrace/rt_paths.glsl.
        """
        first, limits = width * (self._strip_rows + self._ahead_rows), self.device.limits
        later = (
            width * self._strip_rows
            + SPREAD_PATHS * (SPREAD - 1)
            + self._saved_paths(width * height)
            if self.rounds
            else width
        )
        if max(first, later) > limits.launch_invocations or max(width, later) > limits.launch_width:
            raise VulkanError(
                f"the device cannot trace a picture of {width} x {height} pixels",
                "ask for a smaller one",
            )

    def _make_pictures(self, width: int, height: int) -> None:
        """Makes the output buffers, and the records of waiting paths."""

        def picture(size: int) -> Buffer:
            self._pictures.append(Buffer(self.device, size))
            return self._pictures[-1]

        self._colors = picture(4 * width * height)
        self._hits = picture(4 * HIT_WORDS * width * height)
        self._waiting = None
        if not self.rounds:
            return
        waiting = np.zeros(-(-width * height // 32), np.uint32)
        limit = self._saved_paths(width * height)
        self._waiting = picture(waiting.nbytes).write(waiting)
        self._paths = picture(2 * limit * PATH_BYTES)
        self._state.write(np.array([self._paths.address], np.uint64), _offset(CACHE_STATE, "paths"))
        self._state.write(np.array([limit], np.uint32), _offset(CACHE_STATE, "path_limit"))

    def _saved_paths(self, pixels: int) -> int:
        """Records of waiting paths per round: a multiple of 32."""
        if self.paths is None:
            most = MAX_RECORD_BYTES_SHARE * self._cache.size / (2 * PATH_BYTES)
            wanted = min(RECORDS_PER_PIXEL * pixels, most)
        else:
            wanted = self.paths * pixels
        return -(-int(wanted) // 32) * 32

    def _record_frame(self) -> Any:
        """The command buffer of a picture."""
        commands = self.device.record()
        self._steps = []
        self._times.reset(commands)
        copy = vk.VkBufferCopy(0, 0, 2 * FRAME.itemsize)
        vk.vkCmdCopyBuffer(commands, self._frame_host.handle, self._frame.handle, 1, [copy])
        self.device.full_barrier(commands)
        self._times.mark(commands, 0)
        if self._selects:
            self._record_selection(commands)
        elif self.counted:
            vk.vkCmdFillBuffer(commands, self._counters.handle, 0, self._counters.size, 0)
            self.device.full_barrier(commands)
        for strip in range(self.strips):
            self._record_strip(commands, strip)
        self._times.mark(commands, len(self._steps) + 1)
        vk.vkEndCommandBuffer(commands)
        return commands

    def _record_strip(self, commands: Any, strip: int) -> None:
        """Traces all pixels of a strip, then its rounds: decode requested meshlets, resume paths.

        In the last round paths decode by themselves.
        """
        if self._selects and strip == 0:
            self._record_fill(commands, self._coming_round)  # concurrent with the rays: no barrier
        self._record_rays(commands, self._waiting_rays or self._rays, strip, 0)
        self._mark(commands, "rays")
        for number in range(1, self.rounds + 1):
            self._barrier(commands)
            self._record_fill(commands, strip * self._round_records + number)
            self._barrier(commands)
            self._mark(commands, f"decode {number}")
            rays = self._waiting_rays if number < self.rounds else None
            self._record_rays(commands, rays or self._rays, strip, number)
            self._mark(commands, f"rays {number}")
        if self._selects:
            self._barrier(commands)

    def _record_rays(
        self, commands: Any, rays: tuple[Any, list[Any]], strip: int, number: int
    ) -> None:
        """Launches the rays of a strip's round: all pixels in round 0, later the waiting paths."""
        pipeline, regions = rays
        bind_point = vk.VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR
        vk.vkCmdBindPipeline(commands, bind_point, pipeline)
        vk.vkCmdBindDescriptorSets(
            commands, bind_point, self._layout, 0, 1, [self._textures.set], 0, []
        )
        record = strip * self._round_records + number
        push(commands, self._layout, self._rays_data(strip, number, record))
        if number == 0:
            rows = self._strip_rows + (self._ahead_rows if strip == 0 else 0)
            assert self._picture_size is not None
            width = self._picture_size[0]
            self.device.function("vkCmdTraceRaysKHR")(commands, *regions, width, rows, 1)
        else:
            place = self._state.address + self._round_offset(record, "launch")
            self.device.function("vkCmdTraceRaysIndirectKHR")(commands, *regions, place)

    def _rays_data(self, strip: int, number: int, record: int) -> np.ndarray:
        """Push constants of the ray-tracing stages. record: index of the round in CacheState."""
        fields: dict[str, int] = {}
        if self.path == "rt":
            fields["slot_table"] = self._slot_table.address
            fields["cache"] = self._cache.address
            fields["counters"] = self._counters.address
        if self.rounds:
            list_bytes = 4 * (self.capacity + self.scratch)
            fields["state"] = self._state.address
            fields["requests"] = self._lists.address + REQUESTS * list_bytes
        return push_record(
            RAYS_PUSH,
            frame=self._frame.address,
            structure=self.top.addresses[0],
            traced=self._traced.address,
            first_triangles=self._first_triangles,
            colors=self._colors.address,
            hits=self._hits.address,
            bounces=self.bounces,
            samples=self.samples,
            first_row=strip * self._strip_rows,
            shadows=int(self.shadows),
            round=number,
            record=record,
            waiting=_address(self._waiting),
            strip_rows=self._strip_rows,
            **fields,
        )

    def _number_triangles(self, ids: np.ndarray) -> None:
        """Replaces numbers of triangles in their primitive by meshlet * 64 + triangle."""
        for number, instance in enumerate(self.scene.instances):
            mine = ids[..., 0] == number
            if mine.any():
                ids[..., 1][mine] = (
                    self.scene.primitives[instance.primitive].decoded().ids()[ids[..., 1][mine]]
                )


def _offset(dtype: np.dtype, field: str) -> int:
    """The byte offset of a field."""
    assert dtype.fields is not None
    return dtype.fields[field][1]


def _address(buffer: Buffer | None) -> int:
    """The buffer's device address, or 0."""
    return buffer.address if buffer else 0


def _check_length(bounces: int, samples: int) -> None:
    """Raises VulkanError if the record of a waiting path cannot hold the numbers."""
    if not 0 <= bounces <= MAX_BOUNCES or not 0 <= samples <= MAX_SAMPLES:
        raise VulkanError(
            f"at most {MAX_BOUNCES} bounces and {MAX_SAMPLES} samples can be traced",
            "ask for fewer",
        )


def _grid_to_object(primitive: Primitive) -> np.ndarray:
    """float64[4, 4] from a primitive's position grid to object coordinates."""
    position = primitive.attributes["POSITION"]
    matrix = np.diag([position.stream.step * position.scale] * 3 + [1.0])
    matrix[:3, 3] = np.array(position.stream.offset[:3]) * position.scale
    return matrix

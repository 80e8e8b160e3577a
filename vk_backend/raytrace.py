"""Ray tracing of compressed meshlets, with a cache of decoded ones, and of the same model uncompressed."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import vulkan as vk

from . import acceleration
from .acceleration import BOTTOM, BOX_BYTES, INPUT, TOP, Boxes, Instances, Structures, Triangles
from .camera import Camera
from .constants import CONSTANTS
from .device import Device
from .errors import VulkanError
from .memory import STORAGE, Buffer
from .pipelines import MAX_GROUPS, ComputePipeline, Timestamps, push, stage
from .scene import Primitive, Scene
from .scene_buffers import FRAME, SceneBuffers, require_room
from .slots import SlotLayout
from .textures import TextureArray, array_size, textures_layout

PATHS = ("rt", "rt-plain", "rt-triangles")
MESHLET_TRIANGLES = CONSTANTS["MESHLET_TRIANGLES"]
NO_SLOT, REQUESTED = 0xFFFFFFFF, 0xFFFFFFFE  # of shaders/rt_common.glsl
LONG_AGO = 1 << 31  # frames are numbered in 32 bits
CHOOSE_GROUP, BOXES_GROUP = 512, 32  # workgroups of shaders/rt_cache.comp, boxes.comp
CLASSES, FILL_GROUPS, NEIGHBOURS = 13, 32768, 6  # of shaders/rt_cache.glsl, rt_common.glsl
REQUESTS, LISTS, COUNTED_RAY = (
    CLASSES,
    2 * CLASSES,
    2,
)  # its lists, and what each ray adds to a counter
SPREAD, SPREAD_PATHS = 32, 4096  # of shaders/rt_paths.glsl
SCRATCH, LEAST_SCRATCH = (
    2 / 3,
    768,
)  # slots beside the cache: a share of the meshlets that it has no room for, or so many
ROTATING = (
    1 / 2
)  # of all slots: what can be given away during a frame even if all are needed, at most
MANY_SLOTS, ROUNDS = (
    0.78,
    {True: 1, False: 4},
)  # share of the meshlets that have slots; rounds if it is that large, or is not,
BOUNCE_ROUNDS, LONG_PATH = 3, 2  # and so many more for each bounce, up to that one
FEW_SLOTS, MOST_STRIPS = (
    0.45,
    16,
)  # with a smaller share a picture is traced in strips, the more the smaller it is
AHEAD, AHEAD_FRAMES, MOST_SLOTS = (
    1 / 64,
    16,
    0.93,
)  # rays that look ahead, a share of the pixels, and so many frames; none where few slots lack
SAMPLES = 16  # paths per pixel, where they bounce
SAVED_PATHS, SAVED_BYTES = (
    1 / 128,
    1 / 4,
)  # records of paths that wait: a share of the pixels, twice; at most a share of the slots' bytes
MOST_BOUNCES, MOST_SAMPLES = 2047, (1 << 20) - 1  # what a record holds
BOUNDS_BYTES, PATH_BYTES = (
    24,
    64,
)  # of a meshlet's box and of a record, in shaders/rt_cache.glsl and rt_paths.glsl
SHADER_GROUPS = 3  # of shaders in a pipeline: the camera's, for misses, for hits
HIT_WORDS = 5  # of shaders/rt_common.glsl
INSTANCE_MASKED = 1 << 23  # of shaders/rt_hit.glsl
# From the Vulkan registry, since the package vulkan has wrong values: VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR,
# VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR and VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR.
PIPELINE_INFO, GROUP_INFO, BIND_POINT = 1000150015, 1000150016, 1000165000
OPAQUE, TRANSPARENT = 4, 8  # VK_GEOMETRY_INSTANCE_FORCE_OPAQUE_BIT_KHR, FORCE_NO_OPAQUE

# Structures of shaders/rt_common.glsl and rt_cache.glsl.
TRACED = np.dtype(
    [
        ("blob", "<u4", 2),
        ("blob_words", "<u4"),
        ("first_meshlet", "<u4"),
        ("indices", "<u4", 2),
        ("vertices", "<u4", 2),
    ]
)
ROUND = np.dtype(
    [
        ("fill_groups", "<u4", 3),
        ("requested", "<u4"),
        ("launch", "<u4", 3),
        ("restarted", "<u4"),
        ("waiting", "<u4"),
        ("filled", "<u4"),
    ]
)
STATE = np.dtype(
    [
        ("bounds", "<u8"),
        ("paths", "<u8"),
        ("owners", "<u8"),
        ("stamps", "<u8"),
        ("seen", "<u8"),
        ("ahead", "<u8"),
        ("stable", "<u4"),
        ("rotating", "<u4"),
        ("meshlets", "<u4"),
        ("primitives", "<u4"),
        ("waits", "<u4"),
        ("path_limit", "<u4"),
        ("coming_round", "<u4"),
        ("frame", "<u4"),
        ("kept", "<u4"),
        ("ring", "<u4"),
        ("cursor", "<u4"),
        ("finished", "<u4"),
        ("listed", "<u4", (2, LISTS)),
    ]
)


@dataclass
class Picture:
    """What rays saw first, and the colour that came of it.

    color: uint8[height, width, 4]; ids: uint32[height, width, 2], instance and meshlet * 64 + triangle, 0xFFFFFFFF where there is
    nothing; t: float32[height, width], along directions of unit length, infinite where there is nothing; barycentrics:
    float32[height, width, 2], weights of the second and third vertex; milliseconds: of the GPU, the cache's upkeep included.
    """

    color: np.ndarray
    ids: np.ndarray
    t: np.ndarray
    barycentrics: np.ndarray
    milliseconds: float


class RayTracer:
    """Renders a scene by tracing rays.

    path: "rt" (compressed), "rt-plain" (the same boxes over uncompressed meshlets) or "rt-triangles" (the driver's triangles).
    cache: share of the meshlets that may be kept decoded, 0 to 1; cache_bytes: the same limit in bytes, instead. bounces: how often light
    is followed from surface to surface; shadows: whether surfaces shade one another; samples: paths per pixel (None: 1, or with bounces
    16); group: triangles behind one box, 4 to 64, a power of two.

    Where the cache does not hold everything, there are further slots (scratch: share of the meshlets; None: 2/3 of those that the cache
    has no room for, at least 768). If that makes a slot for every meshlet, everything is cached. Else paths that need a meshlet without a
    slot wait: it is decoded into one and they go on, up to `rounds` times; the last time they decode for themselves what they still lack,
    which takes much longer. strips: parts of the picture that are traced one after the other, so that the slots suffice for each. predict:
    meshlets near those that rays needed are decoded ahead, beside the first launch, into slots of what is less likely to be needed.
    ahead: rays, as a share of the pixels, from where the camera will be in 16 frames if it goes on as it does; what they need counts, too
    (None: 1/64 where there are slots for less than 93 % of the meshlets, else none).
    bounds: keep a box around each meshlet, up to which a path that waits knows that there is nothing; without it a path asks for whatever
    it comes across first. paths: records of paths that wait, a share of the pixels (None: 1/128, in at most a quarter of the slots'
    memory); those without one start again. counted: keep statistics where the cache does not need them. marked: measure the steps
    of a frame, too.
    Raises VulkanError; ValueError for a group that there is not, or a negative number.
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
        if group not in (4, 8, 16, 32, 64):
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
        self.predict, self.bounds, self.paths, self.ahead, self.marked = (
            predict,
            bounds,
            paths,
            ahead,
            marked,
        )
        self._last_place: np.ndarray | None = None
        self.samples = samples or (SAMPLES if bounces else 1)
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
        self._times: Timestamps | None = None
        self._steps: list[str] = []
        self._pictures: list[Buffer] = []

    # --- use -------------------------------------------------------------------------------------------------------------------------

    def render(self, camera: Camera, width: int, height: int) -> Picture:
        """One frame, after which the cache follows what its rays needed."""
        milliseconds = self.time(camera, width, height)
        hits = self._hits.read().reshape(height, width, HIT_WORDS)
        ids = np.ascontiguousarray(hits[..., :2])
        if self.path == "rt-triangles":
            self._number_triangles(ids)
        floats = np.ascontiguousarray(hits[..., 2:]).view(np.float32)
        color = self._colors.read(np.uint8).reshape(height, width, 4)
        return Picture(color, ids, floats[..., 0], floats[..., 1:], milliseconds)

    def frames(self, cameras: Sequence[Camera], width: int, height: int) -> Iterator[Picture]:
        """A picture from each camera, in their order."""
        for camera in cameras:
            yield self.render(camera, width, height)

    def time(self, camera: Camera, width: int, height: int) -> float:
        """Milliseconds of the GPU for one frame, whose picture stays on the device."""
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
        """Milliseconds of the last frame's steps, if it was `marked`: choose (what the slots hold), keep (decode it), rays, and of each
        round decode and rays, all strips together."""
        found = dict.fromkeys(self._steps, 0.0)
        for name, milliseconds in zip(self._steps, self._times.milliseconds()):
            found[name] += float(milliseconds)
        return found

    def statistics(self) -> dict[str, Any]:
        """Of the last frame. asked: how often rays, those that look ahead included, needed a meshlet, about; needed: meshlets that they
        needed; resident: meshlets that have a slot now, of slots; kept: meshlets decoded before the first ray; coming: meshlets decoded
        during the first launch; requested: meshlets that paths waited for before each round; waiting: these paths; restarted: those of
        them that had to start again. Where everything is cached, asked and needed are 0 unless `counted` was given."""
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
            state, rounds = raw[: STATE.itemsize].view(STATE)[0], raw[STATE.itemsize :].view(ROUND)
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
        """Device memory that the path keeps, by part; pictures and textures apart."""
        parts = {
            "model": self.buffers.resident_bytes,
            "acceleration": self.bottom.allocated + self.top.allocated,
        }
        parts.update(
            {name: sum(b.allocated for b in buffers) for name, buffers in self._own.items()}
        )
        if self.rounds and self._picture_size:
            parts["lists"] += self._waiting.allocated + self._paths.allocated
        return parts

    def set_light(self, *, bounces: int, shadows: bool) -> None:
        """Other bounces and shadows from the next frame on."""
        _check_length(bounces, self.samples)
        self.bounces, self.shadows = bounces, shadows
        if self._picture_size is not None:
            self._prepare(*self._picture_size)

    def free(self) -> None:
        """Gives the memory back before the device is closed; the tracer is of no use afterwards."""
        self.buffers.free()
        self.bottom.free()
        self.top.free()
        self._textures.free()
        self._forget_pictures()
        for buffer in [b for part in self._own.values() for b in part] + [
            self._frame,
            self._frame_host,
        ]:
            buffer.free()

    @property
    def pipelines(self) -> list:
        """The ray-tracing pipelines, for vk_backend.statistics."""
        return [rays[0] for rays in (self._waiting_rays, self._rays) if rays]

    @property
    def rounds(self) -> int:
        """How often paths that wait go on; never where everything is cached or no slots are beside the cache."""
        return self._first_rounds + self._bounce_rounds * min(self.bounces, LONG_PATH)

    # --- making ----------------------------------------------------------------------------------------------------------------------

    def _plan_cache(
        self, cache: float, cache_bytes: int | None, scratch: float | None, counted: bool
    ) -> None:
        """Numbers of slots, and whether meshlets count what rays need of them."""
        self.capacity = self.scratch = 0
        self.all_cached = self._selects = self.counted = False
        if self.path != "rt":
            return
        wanted = (
            int(round(cache * self.meshlets))
            if cache_bytes is None
            else cache_bytes // self.slot_bytes
        )
        self.capacity = min(wanted, self.meshlets)
        beside = max(int(SCRATCH * (self.meshlets - self.capacity)), LEAST_SCRATCH)
        self.scratch = beside if scratch is None else int(scratch * self.meshlets)
        self.all_cached = self.capacity + self.scratch >= self.meshlets
        if self.all_cached:
            self.capacity, self.scratch = self.meshlets, 0
        self._rotating = min(self.scratch, max(int(ROTATING * (self.capacity + self.scratch)), 1))
        self._selects = not self.all_cached and self.capacity + self.scratch > 0
        self.counted = counted or self._selects

    def _plan_rounds(self, rounds: int | None, strips: int | None) -> None:
        """How often paths that wait may go on, and in how many parts the picture is traced."""
        share = (self.capacity + self.scratch) / max(self.meshlets, 1)
        fitting = (
            1 if share >= FEW_SLOTS else min(int(1 / max(share, 1 / MOST_STRIPS)), MOST_STRIPS)
        )
        self.strips = (strips or fitting) if self.scratch else 1
        self._first_rounds = (
            (ROUNDS[share >= MANY_SLOTS] if rounds is None else rounds) if self.scratch else 0
        )
        self._bounce_rounds = BOUNCE_ROUNDS if rounds is None and self.scratch else 0
        self._round_records = (
            self._first_rounds + self._bounce_rounds * LONG_PATH + 1
        )  # of a strip, at most

    def _keep(self, part: str, data: np.ndarray | int, usage: int = STORAGE) -> Buffer:
        """A buffer that stays, and is counted."""
        size = data if isinstance(data, int) else data.nbytes
        buffer = Buffer(self.device, max(size, 4), usage)
        self._own[part].append(buffer)
        return buffer if isinstance(data, int) else buffer.write(data)

    def _upload(self) -> None:
        rows = np.zeros(len(self.scene.primitives), TRACED)
        for row, record, first in zip(rows, self.buffers.primitives, self._first_meshlet):
            row["blob"], row["blob_words"], row["first_meshlet"] = (
                record["blob"],
                record["blob_words"],
                first,
            )
            row["indices"], row["vertices"] = record["index_data"], record["vertex_data"]
        self._traced = self._keep("tables", rows)
        self._frame = Buffer(
            self.device, 2 * FRAME.itemsize
        )  # the picture's, and that of the one that looks ahead
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
            self._seen = self._keep("lists", np.full(self.meshlets, LONG_AGO, np.uint32))
        if self._selects and self.predict:
            self._owners = self._keep("lists", 4 * NEIGHBOURS * self.meshlets)
            self._stamps = self._keep("lists", np.zeros(self.meshlets, np.uint32))
        self._bounds = (
            self._keep("lists", self.meshlets * BOUNDS_BYTES)
            if self.rounds and self.bounds
            else None
        )

    def _constants(self, elements: int, deferred: bool = False) -> dict[int, int]:
        """Of shaders/rt_common.glsl and slots.glsl; elements: components that the stage decodes; deferred: paths wait for meshlets."""
        return {
            0: self.scene.max_streams,
            1: elements,
            2: self.group,
            5: int(self.all_cached),
            6: self.scene.vertex_floats,
            7: self.scene.attributes,
            9: int(deferred),
            10: int(self.rounds > 0 and self.paths != 0),
            11: int(self.counted),
            **self._slots.constants,
        }

    def _build(self) -> None:
        """The acceleration structures: a bottom level per primitive, and the instances over them."""
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
        """VkAccelerationStructureInstanceKHR of each instance."""
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
            # What a flattened node shows cannot be traced in its own coordinates.
            seen = (
                np.isfinite(row["transform"]).all()
                and np.linalg.matrix_rank(row["transform"][:, :3].astype(np.float64)) == 3
            )
            if not seen:
                row["transform"] = np.eye(4, dtype=np.float32)[:3]
            row["index_mask"] = (
                instance.primitive
                | (INSTANCE_MASKED if masked else 0)
                | (0xFF000000 if seen else 0)
            )
            row["offset_flags"] = (TRANSPARENT if masked else OPAQUE) << 24
            row["structure"] = self.bottom.addresses[instance.primitive]
        return rows

    @property
    def _in_object_space(self) -> bool:
        """Whether rays meet positions in the primitive's coordinates rather than on its grid."""
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
                data = struct.pack(
                    "<4Q2I2Q",
                    self._frame.address,
                    self._traced.address,
                    self._first_triangles,
                    address,
                    number,
                    primitive.meshlets,
                    _address(self._bounds),
                    _address(self._owners),
                )
                rows_of_groups = -(-primitive.meshlets // (BOXES_GROUP * MAX_GROUPS))
                count = -(-primitive.meshlets // (BOXES_GROUP * rows_of_groups))
                pipeline.dispatch(commands, count, np.frombuffer(data, np.uint8), rows_of_groups)
                geometries.append(Boxes(address, primitive.meshlets * groups))
        return geometries

    def _ray_stages(self, deferred: bool) -> tuple[list, dict[str, int]]:
        """The shaders of a pipeline, the camera's first and the one for misses second, and which of them a hit runs."""
        suffix = {"rt": "", "rt-plain": "_plain", "rt-triangles": "_triangles"}[self.path]
        shading = self._constants(self.scene.max_elements, deferred)
        stages = [
            stage(self.device, "rt_camera.rgen", vk.VK_SHADER_STAGE_RAYGEN_BIT_KHR, shading),
            stage(self.device, "rt_miss.rmiss", vk.VK_SHADER_STAGE_MISS_BIT_KHR),
        ]
        hit = dict.fromkeys(
            ("closestHitShader", "anyHitShader", "intersectionShader"), vk.VK_SHADER_UNUSED_KHR
        )

        def add(role: str, name: str, bit: int, constants: dict[int, int]) -> None:
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

    def _make_rays(self, deferred: bool) -> tuple[Any, list]:
        """A pipeline, which tracers share where theirs would be the same, and the regions of its shader binding table."""
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

    def _make_pipeline(self, deferred: bool):
        """Its groups: the camera's shader, the one for misses, and those of a hit."""
        device = self.device
        stages, hit = self._ray_stages(deferred)
        general = vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR
        procedural = vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_KHR
        triangles = vk.VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR
        unused = vk.VK_SHADER_UNUSED_KHR
        none = dict.fromkeys(hit, unused)
        kind = triangles if self.path == "rt-triangles" else procedural
        groups = [
            vk.VkRayTracingShaderGroupCreateInfoKHR(
                sType=GROUP_INFO, type=general, generalShader=0, **none
            ),
            vk.VkRayTracingShaderGroupCreateInfoKHR(
                sType=GROUP_INFO, type=general, generalShader=1, **none
            ),
            vk.VkRayTracingShaderGroupCreateInfoKHR(
                sType=GROUP_INFO, type=kind, generalShader=unused, **hit
            ),
        ]
        info = vk.VkRayTracingPipelineCreateInfoKHR(
            sType=PIPELINE_INFO,
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

    def _make_binding_table(self, pipeline) -> list:
        """A record of a handle alone for each group, where its region may begin."""
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

    # --- the cache -------------------------------------------------------------------------------------------------------------------

    def _make_cache(self) -> None:
        """Lists and pipelines of the cache, whose slots are all filled; a cache for everything needs neither afterwards."""
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
        """uint32[LISTS, slots]: a meshlet for every slot, spread evenly over the model, since what rays will need is not known yet."""
        slots = self.capacity + self.scratch
        lists = np.zeros((LISTS, slots), np.uint32)
        # Slots of the lowest class are given to meshlets of the highest.
        lists[0], lists[-1] = np.arange(slots), np.arange(slots) * self.meshlets // slots
        return lists

    def _first_state(self) -> np.ndarray:
        """uint8[...]: CacheState before the first frame, with as many meshlets to decode as there are slots."""
        state, rounds = np.zeros((), STATE), np.zeros(self._coming_round + 1, ROUND)
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
        """Push constants of the cache's shaders. record: which of the frame's rounds."""
        lists = (self._state, self._lists, self._slot_meshlets)
        buffers = (self._frame, self._traced, self._slot_table, self._cache, self._counters, *lists)
        return np.frombuffer(struct.pack("<8QI", *(b.address for b in buffers), record), np.uint8)

    def _round_offset(self, record: int, field: str) -> int:
        """Bytes from the beginning of CacheState to a field of one of its rounds."""
        return STATE.itemsize + record * ROUND.itemsize + ROUND.fields[field][1]

    def _record_fill(self, commands, record: int) -> None:
        fill = self._cache_pipelines["fill"]
        vk.vkCmdBindPipeline(commands, vk.VK_PIPELINE_BIND_POINT_COMPUTE, fill.handle)
        push(commands, fill.layout, self._cache_data(record))
        vk.vkCmdDispatchIndirect(
            commands, self._state.handle, self._round_offset(record, "fill_groups")
        )

    def _record_selection(self, commands) -> None:
        """What the slots hold when the frame begins, by what was needed in the last one."""
        groups = -(-self.meshlets // CHOOSE_GROUP)
        self._cache_pipelines["cache"].dispatch(commands, groups, self._cache_data(0))
        self._barrier(commands)
        self._mark(commands, "choose")
        self._record_fill(commands, 0)
        self._barrier(commands)
        self._mark(commands, "keep")

    def _mark(self, commands, name: str) -> None:
        """The end of a step of the frame, if its steps are measured."""
        if self.marked:
            self._steps.append(name)
            self._times.mark(commands, len(self._steps))

    def _barrier(self, commands) -> None:
        """Between the steps of a frame: what shaders wrote can be read by shaders and indirect commands."""
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

    # --- frames ----------------------------------------------------------------------------------------------------------------------

    def _prepare(self, width: int, height: int) -> None:
        """Buffers for a picture of this size, and the commands that make it."""
        self._forget_pictures()
        self._strip_rows = -(-height // self.strips)
        self._plan_ahead(width, height)
        self._check_launches(width, height)
        self._make_pictures(width, height)
        marks = 2 + 2 * self._selects + self.strips * (1 + 2 * self.rounds) if self.marked else 2
        if self._times is None or self._times.count != marks:
            self._times = Timestamps(self.device, marks)
        self._picture_size = (width, height)
        self._commands = self._record_frame()

    def _plan_ahead(self, width: int, height: int) -> None:
        """The size of the picture that looks ahead, and the rows of the first launch that trace it."""
        share = self.ahead
        if share is None:
            share = AHEAD if self.capacity + self.scratch < MOST_SLOTS * self.meshlets else 0.0
        side = np.sqrt(share if self.rounds else 0.0)
        self._ahead_size = int(np.ceil(width * side)), int(np.ceil(height * side))
        self._ahead_rows = -(-self._ahead_size[0] * self._ahead_size[1] // width)
        self._last_place = None

    def _frame_ahead(self, camera: Camera, width: int, height: int) -> np.ndarray:
        """FRAME[()] of the picture that looks ahead: from where the camera will be if it goes on as since the last frame."""
        last, self._last_place = self._last_place, camera.to_world.copy()
        if self._ahead_rows == 0 or last is None or np.array_equal(last, camera.to_world):
            return np.zeros((), FRAME)
        with np.errstate(over="ignore", invalid="ignore"):
            motion = camera.to_world @ np.linalg.inv(last)
            to_world = np.linalg.matrix_power(motion, AHEAD_FRAMES) @ camera.to_world
            if not np.isfinite(to_world.astype(np.float32)).all():
                return np.zeros((), FRAME)
        record = self.buffers.frame_record(
            replace(camera, to_world=to_world), width, height, 0
        )  # of the same shape
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
        """Raises VulkanError for a picture that the device cannot trace in one launch; later ones have one dimension (shaders/rt_paths.glsl)."""
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
        def picture(size: int) -> Buffer:
            self._pictures.append(Buffer(self.device, size))
            return self._pictures[-1]

        self._colors = picture(4 * width * height)
        self._hits = picture(4 * HIT_WORDS * width * height)
        self._waiting = None
        if not self.rounds:
            return
        waiting, limit = (
            np.zeros(-(-width * height // 32), np.uint32),
            self._saved_paths(width * height),
        )
        self._waiting = picture(waiting.nbytes).write(waiting)
        self._paths = picture(2 * limit * PATH_BYTES)
        self._state.write(np.array([self._paths.address], np.uint64), STATE.fields["paths"][1])
        self._state.write(np.array([limit], np.uint32), STATE.fields["path_limit"][1])

    def _saved_paths(self, pixels: int) -> int:
        """Records of paths that wait, for a round."""
        most = SAVED_BYTES * self._cache.size / (2 * PATH_BYTES)
        wanted = min(SAVED_PATHS * pixels, most) if self.paths is None else self.paths * pixels
        return -(-int(wanted) // 32) * 32

    def _record_frame(self):
        """The commands that make a picture."""
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

    def _record_strip(self, commands, strip: int) -> None:
        """Traces all its pixels; then what paths wait for is decoded, and they go on; in the last round they decode for themselves."""
        if self._selects and strip == 0:
            self._record_fill(commands, self._coming_round)  # at the same time as the rays
        self._record_rays(commands, self._waiting_rays or self._rays, strip, 0)
        self._mark(commands, "rays")
        for number in range(1, self.rounds + 1):
            self._barrier(commands)
            self._record_fill(commands, strip * self._round_records + number)
            self._barrier(commands)
            self._mark(commands, f"decode {number}")
            self._record_rays(
                commands, self._waiting_rays if number < self.rounds else self._rays, strip, number
            )
            self._mark(commands, f"rays {number}")
        if self._selects:
            self._barrier(commands)

    def _record_rays(self, commands, rays: tuple[Any, list], strip: int, number: int) -> None:
        """Of a strip's round. Round 0: all pixels; later rounds: those that wait, if there are any."""
        pipeline, regions = rays
        vk.vkCmdBindPipeline(commands, BIND_POINT, pipeline)
        vk.vkCmdBindDescriptorSets(
            commands, BIND_POINT, self._layout, 0, 1, [self._textures.set], 0, []
        )
        compressed, width = self.path == "rt", self._picture_size[0]
        record = strip * self._round_records + number
        data = struct.pack(
            "<9Q6I3QI",
            self._frame.address,
            self.top.addresses[0],
            self._traced.address,
            self._slot_table.address if compressed else 0,
            self._cache.address if compressed else 0,
            self._counters.address if compressed else 0,
            self._first_triangles,
            self._colors.address,
            self._hits.address,
            self.bounces,
            self.samples,
            strip * self._strip_rows,
            int(self.shadows),
            number,
            record,
            self._state.address if self.rounds else 0,
            self._lists.address + 4 * REQUESTS * (self.capacity + self.scratch)
            if self.rounds
            else 0,
            _address(self._waiting),
            self._strip_rows,
        )
        push(commands, self._layout, np.frombuffer(data, np.uint8))
        if number == 0:
            rows = self._strip_rows + (self._ahead_rows if strip == 0 else 0)
            self.device.function("vkCmdTraceRaysKHR")(commands, *regions, width, rows, 1)
        else:
            place = self._state.address + self._round_offset(record, "launch")
            self.device.function("vkCmdTraceRaysIndirectKHR")(commands, *regions, place)

    def _number_triangles(self, ids: np.ndarray) -> None:
        """Replaces triangle numbers of primitives by meshlet * 64 + number in the meshlet."""
        for number, instance in enumerate(self.scene.instances):
            mine = ids[..., 0] == number
            if mine.any():
                ids[..., 1][mine] = (
                    self.scene.primitives[instance.primitive].decoded().ids()[ids[..., 1][mine]]
                )


def _address(buffer: Buffer | None) -> int:
    """Where a shader finds a buffer, or 0."""
    return buffer.address if buffer else 0


def _check_length(bounces: int, samples: int) -> None:
    """Raises VulkanError for more than the record of a waiting path holds."""
    if not 0 <= bounces <= MOST_BOUNCES or not 0 <= samples <= MOST_SAMPLES:
        raise VulkanError(
            f"at most {MOST_BOUNCES} bounces and {MOST_SAMPLES} samples can be traced",
            "ask for fewer",
        )


def _grid_to_object(primitive: Primitive) -> np.ndarray:
    """float64[4, 4] from a primitive's grid of positions to its coordinates."""
    position = primitive.attributes["POSITION"]
    matrix = np.diag([position.stream.step * position.scale] * 3 + [1.0])
    matrix[:3, 3] = np.array(position.stream.offset[:3]) * position.scale
    return matrix

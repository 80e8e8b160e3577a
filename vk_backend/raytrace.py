"""Ray tracing of compressed meshlets with a cache of decoded ones, or of the uncompressed model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import vk
from .camera import Camera
from .constants import CONSTANTS
from .device import Device
from .errors import VulkanError
from .memory import STORAGE, Buffer
from .pipelines import ComputePipeline, Timestamps, push, push_record
from .raytrace_geometry import Geometry
from .raytrace_layout import CACHE_PUSH, CACHE_STATE, PASS, RAYS_PUSH
from .raytrace_pipeline import HIT_SHADERS, RayPipeline
from .scene import Scene
from .scene_buffers import FRAME, SceneBuffers, require_room
from .slot_layout import SlotLayout
from .textures import TextureArray, array_size, textures_layout

PATHS = tuple(HIT_SHADERS)
GROUPS = (4, 8, 16, 32, 64)  # triangles behind one box
MAX_PARTS = 64  # of the model: the slots hold one at a time
MAX_PASSES = 1 << 16  # of a frame
MAX_BOUNCES = (1 << CONSTANTS["BOUNCE_BITS"]) - 1
MAX_SAMPLES = (1 << CONSTANTS["SAMPLE_BITS"]) - 1
DEFAULT_SAMPLES = 16  # paths per pixel, with bounces
# Passes in which waiting paths get the few meshlets that they lack. More for bounces, up to two.
ROUNDS, ROUNDS_PER_BOUNCE = 3, 2
FIRST_RAYS, RESUME, SWEEP, LOADING = (
    CONSTANTS[name] for name in ("FIRST_RAYS", "RESUME", "SWEEP", "LOADING")
)
NO_SLOT, TURNS, HIT_WORDS = (CONSTANTS[name] for name in ("NO_SLOT", "TURNS", "HIT_WORDS"))
RECORD_BYTES = CONSTANTS["RECORD_BYTES"]


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

    path: "rt" (compressed), "rt-paper" (the same with the paper's cache), "rt-plain" (the boxes of
    rt over uncompressed meshlets) or "rt-triangles" (triangles that the driver intersects).
    cache: share of the meshlets that may be decoded at any moment, 0 to 1 (whole meshlets, up);
    cache_bytes: the limit in bytes instead. bounces: diffuse bounces; shadows: trace shadow rays;
    samples: paths per pixel (None: 1, or 16 with bounces). group: triangles behind one box, 4 to
    64, a power of two (None: 4, or 64 for rt-paper).

    If the cache does not hold all meshlets, paths of "rt" that need a missing one wait: the
    meshlets are decoded in place of others, and the paths go on, up to `rounds` times. If the
    cache has no room for all that they need, they sweep over the model: part by part is decoded.
    In "rt-paper" rays decode missing meshlets by themselves.

    marked: time the steps of a frame. Raises VulkanError if the device lacks ray tracing or
    memory, or the cache holds less than 1/64 of the meshlets; ValueError for an unknown group or
    negative rounds.
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
        group: int | None = None,
        rounds: int | None = None,
        marked: bool = False,
    ):
        group = group or (64 if path == "rt-paper" else 4)
        _check(path, cache, cache_bytes, group, rounds)
        device.require("raytracing", path)
        compressed = path in ("rt", "rt-paper")
        if compressed:
            shared = device.limits.compute_shared_bytes
            require_room(
                device, scene, path, shared, "choose --path rt-triangles or geometry"
            )
        self.device, self.scene, self.path, self.group = device, scene, path, group
        self.samples = samples or (DEFAULT_SAMPLES if bounces else 1)
        self._rounds, self._marked = rounds, marked
        self._slots = SlotLayout.of(scene, traced=True)
        self.slot_bytes = self._slots.bytes
        self.meshlets = sum(p.meshlets for p in scene.primitives)
        self.slots = self._count_slots(cache, cache_bytes) if compressed else 0
        self.all_cached = self.slots == self.meshlets
        self.partial = path == "rt" and not self.all_cached
        self._picture: dict[str, Buffer] = {}
        self._size: tuple[int, int] | None = None
        self.set_light(bounces=bounces, shadows=shadows)

        needs = {"blobs"} if compressed else {"vertices", "indices"}
        self.buffers = SceneBuffers(device, scene, needs)
        self._frame = Buffer(device, FRAME.itemsize)
        self._frame_host = Buffer(device, FRAME.itemsize, host=True)
        start = Camera.fit_box(scene.low, scene.high, 1, 1)
        self._frame.write(self.buffers.frame_record(start, 1, 1, 0).tobytes())
        self._own: dict[str, Buffer] = {}
        self.geometry = Geometry(
            device,
            scene,
            path,
            frame=self._frame.address,
            constants=self._constants(3),
            part_meshlets=self.slots if self.partial else None,
        )
        self._textures = TextureArray(device, scene.textures)
        textures = array_size(scene.textures)
        self._layout = textures_layout(device, textures)
        self._rays = RayPipeline(
            device,
            path,
            any_masked=self.geometry.any_masked,
            shading=self._constants(scene.max_elements),
            positions=self._constants(3),
            layout=self._layout,
            key=(textures,),
        )
        self._times = Timestamps(device, 2)
        if compressed:
            self._make_cache()

    # --- use ---

    def render(self, camera: Camera, width: int, height: int) -> TracedPicture:
        """Renders one frame. The next one begins by updating the cache from this frame's rays."""
        milliseconds = self.time(camera, width, height)
        hits = self._picture["hits"].read().reshape(height, width, HIT_WORDS)
        ids = np.ascontiguousarray(hits[..., :2])
        if self.path == "rt-triangles":
            self._number_triangles(ids)
        floats = np.ascontiguousarray(hits[..., 2:]).view(np.float32)
        color = self._picture["colors"].read(np.uint8).reshape(height, width, 4)
        ids = self.scene.whole_ids(ids)
        return TracedPicture(color, ids, floats[..., 0], floats[..., 1:], milliseconds)

    def frames(self, cameras: Sequence[Camera], width: int, height: int) -> Iterator[TracedPicture]:
        """Renders a picture with each camera, in order."""
        for camera in cameras:
            yield self.render(camera, width, height)

    def time(self, camera: Camera, width: int, height: int) -> float:
        """Renders one frame without copying it to the host; milliseconds on the GPU.

        Path rt-paper chooses the meshlets of the cache on the host: that is not in the time.
        """
        if self._size != (width, height):
            self._prepare(width, height)
        if self.path == "rt-paper":
            self._choose_as_paper()
        self._frame_host.write(self.buffers.frame_record(camera, width, height, 0).tobytes())
        self.device.submit(self._commands)
        return float(self._times.milliseconds().sum())

    def steps(self) -> dict[str, float]:
        """Milliseconds of the last frame's steps, summed over all passes. Needs `marked`.

        Steps: choose (what the slots hold), then decode and rays of each kind of pass: "first",
        "resume", "sweep".
        """
        found = dict.fromkeys(self._steps, 0.0)
        for name, milliseconds in zip(self._steps, self._times.milliseconds()):
            found[name] += float(milliseconds)
        return found

    def statistics(self) -> dict[str, int]:
        """Counts of the last frame. Empty for paths without a cache.

        slots, meshlets: how many there are. If not all are cached: needed: meshlets that rays
        needed (rt-paper: tested); parts: of the model; waiting: paths that waited; resumed,
        swept: launches in which paths went on after single meshlets or a part were decoded.
        """
        if not self.slots:
            return {}
        found = {"slots": self.slots, "meshlets": self.meshlets}
        if self.all_cached:
            return found
        state, passes = self._read_state()
        found["parts"] = self.geometry.parts
        counters = self._own["counters"].read()
        found["needed"] = int((counters == state["frame"] if self.partial else counters > 0).sum())
        worked = passes["launch"][:, 0] > 0
        found["waiting"] = int(state["records"].sum())
        for name, kind in (("resumed", RESUME), ("swept", SWEEP)):
            found[name] = sum(bool(w) for w, p in zip(worked, self._plan) if p[0] == kind)
        return found

    def resident_bytes(self) -> dict[str, int]:
        """Allocated bytes of device memory by part, without pictures and textures.

        cache: everything that is decoded. records: of waiting paths; they grow with the picture,
        all other parts with the model.
        """
        own = {name: buffer.allocated for name, buffer in self._own.items()}
        tables = sum(b.allocated for b in (*self.geometry.tables, self._rays.table))
        return {
            "model": self.buffers.resident_bytes,
            "acceleration": self.geometry.resident_bytes,
            "cache": own.pop("cache", 0),
            "tables": tables + sum(own.values()),
            "records": self._picture["records"].allocated if "records" in self._picture else 0,
        }

    def set_light(self, *, bounces: int, shadows: bool) -> None:
        """Changes bounces and shadows from the next frame on."""
        if not 0 <= bounces <= MAX_BOUNCES or not 0 <= self.samples <= MAX_SAMPLES:
            raise VulkanError(
                f"at most {MAX_BOUNCES} bounces and {MAX_SAMPLES} samples can be traced",
                "ask for fewer",
            )
        self.bounces, self.shadows = bounces, shadows
        self._forget_picture()

    def free(self) -> None:
        """Frees the device memory; the tracer cannot be used afterwards."""
        self._forget_picture()
        self.buffers.free()
        self.geometry.free()
        self._textures.free()
        for buffer in (*self._own.values(), self._rays.table, self._frame, self._frame_host):
            buffer.free()

    @property
    def pipelines(self) -> list[Any]:
        """The VkPipelines that trace rays, for pipeline_statistics."""
        return [self._rays.handle]

    # --- setup ---

    def _count_slots(self, cache: float, cache_bytes: int | None) -> int:
        """Raises VulkanError for path rt if sweeps would need more than MAX_PARTS parts."""
        least = -(-self.meshlets // MAX_PARTS) if self.path == "rt" else 0
        if cache_bytes is None:
            slots = int(np.ceil(cache * self.meshlets))
        else:
            slots = cache_bytes // self.slot_bytes
        if slots < least:
            raise VulkanError(
                f"the cache holds {slots} of {self.meshlets} meshlets, fewer than one in "
                f"{MAX_PARTS}",
                f"give it {least * self.slot_bytes} bytes or more, or choose --path rt-paper",
            )
        return min(slots, self.meshlets)

    def _constants(self, elements: int) -> dict[str, int]:
        """Specialisation constants by name. elements: that the stage decodes."""
        return {
            "MAX_STREAMS": self.scene.max_streams,
            "MAX_ELEMENTS": elements,
            "GROUP_TRIANGLES": self.group,
            "ALL_CACHED": int(self.all_cached),
            "VERTEX_FLOATS": self.scene.vertex_floats,
            "ATTRIBUTES": self.scene.attributes,
            "PARTIAL": int(self.partial),
            **self._slots.constants,
        }

    def _make_cache(self) -> None:
        """Makes the cache's buffers and pipelines, and decodes the first meshlets into it."""
        sizes = {"cache": self.slots * self.slot_bytes}
        if not self.all_cached:
            lists = {"slot_table": self.meshlets, "counters": self.meshlets}
            lists |= {"victims": self.slots, "missing": self.slots}
            sizes |= {name: max(4 * count, 4) for name, count in lists.items()}
        self._own |= {name: Buffer(self.device, size) for name, size in sizes.items()}
        constants = self._constants(self.scene.max_elements)
        self._cache, self._fill = (
            ComputePipeline.of(self.device, f"rt_{name}.comp", constants)
            for name in ("cache", "fill")
        )
        if not self.all_cached:
            table = np.arange(self.meshlets, dtype=np.uint32)
            table[self.slots :] = NO_SLOT
            self._own["slot_table"].write(table)
            self._own["counters"].write(np.zeros_like(table))
            self._own["state"] = self._new_state(self._first_state(), 2)
        with self.device.commands() as commands:
            data = push_record(
                CACHE_PUSH, **self._addresses(), kind=LOADING, meshlets=self.slots
            )
            self._fill.dispatch(commands, max(min(self.slots, CONSTANTS["FILL_GROUPS"]), 1), data)

    def _first_state(self) -> np.ndarray:
        """CACHE_STATE[()] before the first frame: the slots hold the first part."""
        names = {"victims": self._own, "missing": self._own}
        state = push_record(
            CACHE_STATE,
            slots=self.slots,
            meshlets=self.meshlets,
            parts=self.geometry.parts,
            frame=CONSTANTS["FIRST_FRAME"],
            **{name: own[name].address for name, own in names.items()},
        )
        if self.partial:
            assert self.geometry.bounds and self.geometry.part_structures
            state["bounds"] = self.geometry.bounds.address
            state["structures"] = self.geometry.part_structures.address
        return state

    def _new_state(self, state: np.ndarray, passes: int) -> Buffer:
        """A buffer of CacheState with this many passes."""
        usage = STORAGE | vk.VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT
        data = state.tobytes() + bytes(passes * PASS.itemsize)
        return Buffer(self.device, len(data), usage).write(data)

    def _read_state(self) -> tuple[np.ndarray, np.ndarray]:
        """(CACHE_STATE[()], PASS[passes])"""
        raw = self._own["state"].read(np.uint8)
        size = CACHE_STATE.itemsize
        return raw[:size].view(CACHE_STATE)[0], raw[size:].view(PASS)

    def _choose_as_paper(self) -> None:
        """Gives the slots to the meshlets that most rays tested in the last frame."""
        if self.all_cached or not self.slots:
            return
        counts, table = (self._own[name].read() for name in ("counters", "slot_table"))
        wanted = np.argsort(-counts.astype(np.int64), kind="stable")[: self.slots]
        missing = wanted[table[wanted] == NO_SLOT]
        victims = np.setdiff1d(np.flatnonzero(table != NO_SLOT), wanted)
        self._own["missing"].write(missing.astype(np.uint32))
        self._own["victims"].write(victims.astype(np.uint32))
        self._own["counters"].write(np.zeros_like(counts))
        state, passes = (part.copy() for part in self._read_state())
        passes[0] = np.zeros((), PASS)
        state["idle"] = state["free"] = passes[0]["requested"] = len(missing)
        self._own["state"].write(state.tobytes() + passes.tobytes())

    # --- frames ---

    def _plan_passes(self) -> list[tuple[int, int, int]]:
        """(kind, turn, step of its sweep) of a frame's passes."""
        if not self.partial:
            return [(FIRST_RAYS, 0, 0)]
        rounds = self._rounds
        if rounds is None:
            rounds = ROUNDS + ROUNDS_PER_BOUNCE * min(self.bounces, 2)
        sweep = [(SWEEP, step) for step in range(self.geometry.parts)]
        sweeps = self.samples * (self.bounces + 1 + self.shadows)
        turn = [(FIRST_RAYS, 0), *[(RESUME, 0)] * rounds, *sweep * sweeps]
        turns = 1 if self._single else TURNS
        return [(kind, n, step) for n in range(turns) for kind, step in turn]

    @property
    def _single(self) -> bool:
        """Whether paths have one ray: their records are shorter."""
        return not self.bounces and not self.shadows and self.samples == 1

    def _prepare(self, width: int, height: int) -> None:
        """Makes the buffers of a picture of this size, and records its commands."""
        self._forget_picture()
        pixels, limits = width * height, self.device.limits
        passes = self.samples * (self.bounces + 2) * self.geometry.parts
        if pixels > limits.launch_invocations or pixels > limits.launch_width:
            raise VulkanError(
                f"the device cannot trace a picture of {width} x {height} pixels",
                "ask for a smaller one",
            )
        if self.partial and passes > MAX_PASSES:
            raise VulkanError(
                f"{self.samples} samples of {self.bounces} bounces take too many passes",
                "ask for fewer or for a larger cache",
            )
        self._plan = self._plan_passes()
        sizes = {"colors": 4 * pixels, "hits": 4 * HIT_WORDS * pixels}
        room = pixels if self._single else -(-pixels // TURNS)
        if self.partial:
            sizes["records"] = room * RECORD_BYTES * (1 if self._single else 2)
        self._picture = {name: Buffer(self.device, size) for name, size in sizes.items()}
        if self.partial:
            state = self._read_state()[0].copy()
            found = self._picture["records"].address
            state["room"], state["found"] = room, found
            state["levels"] = 0 if self._single else found + room * RECORD_BYTES
            self._own["state"].free()
            self._own["state"] = self._new_state(state, len(self._plan) + 1)
        self._size = (width, height)
        self._commands = self._record_frame()

    def _forget_picture(self) -> None:
        for buffer in self._picture.values():
            buffer.free()
        self._picture = {}
        if self._size is not None:
            vk.vkFreeCommandBuffers(self.device.handle, self.device.pool, 1, [self._commands])
        self._size = None

    def _record_frame(self) -> Any:
        """The command buffer of a picture."""
        passes = self._plan
        fills = bool(self.slots) and not self.all_cached
        marks = 2 + (1 + 2 * len(passes)) * self._marked
        if self._times.count != marks:
            self._times = Timestamps(self.device, marks)
        commands = self.device.record()
        self._steps: list[str] = []
        self._times.reset(commands)
        copy = vk.VkBufferCopy(0, 0, FRAME.itemsize)
        vk.vkCmdCopyBuffer(commands, self._frame_host.handle, self._frame.handle, 1, [copy])
        self.device.full_barrier(commands)
        self._times.mark(commands, 0)
        if self.partial:
            self._record_choice(commands)
        bind_point = vk.VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR
        vk.vkCmdBindPipeline(commands, bind_point, self._rays.handle)
        vk.vkCmdBindDescriptorSets(
            commands, bind_point, self._layout, 0, 1, [self._textures.set], 0, []
        )
        for number, (kind, turn, step) in enumerate(passes):
            name = {FIRST_RAYS: "first", RESUME: "resume", SWEEP: "sweep"}[kind]
            if fills:
                self._record_fill(commands, number)
                self._barrier(commands)
                self._mark(commands, f"{name} decode")
            self._record_rays(commands, number)
            self._mark(commands, f"{name} rays")
        for mark in range(len(self._steps) + 1, marks):
            self._times.mark(commands, mark)
        vk.vkEndCommandBuffer(commands)
        return commands

    def _record_choice(self, commands: Any) -> None:
        """Records the comparison of the slots with what rays needed in the last frame."""
        state, cleared = self._own["state"], _offset(CACHE_STATE, "idle")
        vk.vkCmdFillBuffer(commands, state.handle, cleared, state.size - cleared, 0)
        self.device.full_barrier(commands)
        groups = -(-self.meshlets // CONSTANTS["CHOOSE_THREADS"])
        self._cache.dispatch(commands, groups, push_record(CACHE_PUSH, **self._addresses()))
        self._barrier(commands)
        self._mark(commands, "choose")

    def _addresses(self) -> dict[str, int]:
        """Fields that RaysPush and CachePush share: 0 for what the path does not have."""
        names = ("slot_table", "cache", "counters", "state")
        return {
            "frame": self._frame.address,
            "sources": self.geometry.sources.address,
            **{name: self._own[name].address for name in names if name in self._own},
        }

    def _pass_fields(self, number: int) -> dict[str, int]:
        kind, turn, step = self._plan[number]
        return {"kind": kind, "pass": number, "turn": turn, "step": step}

    def _record_fill(self, commands: Any, number: int) -> None:
        """Records the decoding of a pass's meshlets."""
        fields = {**self._addresses(), **self._pass_fields(number)}
        groups = max(min(self.slots, CONSTANTS["FILL_GROUPS"]), 1)
        self._fill.dispatch(commands, groups, push_record(CACHE_PUSH, **fields))

    def _record_rays(self, commands: Any, number: int) -> None:
        """Records the launch of a pass: all pixels, then the paths that wait."""
        passes = self._plan
        turn = passes[number][1]
        geometry, picture = self.geometry, self._picture
        data = push_record(
            RAYS_PUSH,
            **self._addresses(),
            structure=geometry.top,
            placed=geometry.placed.address,
            first_triangles=geometry.first_triangles.address if geometry.first_triangles else 0,
            colors=picture["colors"].address,
            hits=picture["hits"].address,
            bounces=self.bounces,
            samples=self.samples,
            shadows=int(self.shadows),
            next_turn=(turn + 1) * len(passes) // (1 if self._single else TURNS),
            **self._pass_fields(number),
        )
        push(commands, self._layout, data)
        if number == 0:
            assert self._size is not None
            trace = self.device.function("vkCmdTraceRaysKHR")
            trace(commands, *self._rays.regions, *self._size, 1)
        else:
            place = CACHE_STATE.itemsize + number * PASS.itemsize
            trace = self.device.function("vkCmdTraceRaysIndirectKHR")
            trace(commands, *self._rays.regions, self._own["state"].address + place)
        self._barrier(commands)

    def _mark(self, commands: Any, name: str) -> None:
        """Records a timestamp at the end of a step, if steps are timed."""
        if self._marked:
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


def _check(
    path: str, cache: float, cache_bytes: int | None, group: int, rounds: int | None
) -> None:
    """Raises VulkanError or ValueError for options of RayTracer that are out of range."""
    if path not in PATHS:
        raise VulkanError(f"there is no path {path}", f"the ray-traced ones are {', '.join(PATHS)}")
    if not 0 <= cache <= 1 or (cache_bytes or 0) < 0:
        raise VulkanError(
            "the cache is a share from 0 to 1, or a number of bytes", "for example 0.25"
        )
    if group not in GROUPS or (rounds or 0) < 0:
        raise ValueError("group is 4, 8, 16, 32 or 64, and rounds are not negative")

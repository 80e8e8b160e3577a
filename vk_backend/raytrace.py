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
from .pipelines import MAX_GROUPS, ComputePipeline, Timestamps, push, push_record
from .raytrace_geometry import Geometry
from .raytrace_layout import FILL_PUSH, RAYS_PUSH, VIEW
from .raytrace_pipeline import HIT_SHADERS, RayPipeline
from .scene import Scene
from .scene_buffers import FRAME, SceneBuffers, require_room
from .slot_layout import SlotLayout
from .textures import TextureArray, array_size, textures_layout

PATHS = tuple(HIT_SHADERS)
GROUPS = (4, 8, 16, 32, 64)  # triangles behind one box
MAX_PARTS = 64  # of the model: the slots hold one at a time
MAX_PASSES = 1 << 16  # of a frame
MAX_BOUNCES = 254  # RaysPush.level
MAX_SAMPLES = 1 << 16
DEFAULT_SAMPLES = 16  # paths per pixel, with bounces
RECORD_BYTES = CONSTANTS["RECORD_BYTES"]
MARGIN = 2  # pixels around the rectangle in which the scene is
MAX_PIXEL_BYTES = 32  # of records, per pixel of the picture
HIT_WORDS, NO_SLOT = CONSTANTS["HIT_WORDS"], CONSTANTS["NO_SLOT"]
VIEW_OFFSET = -(-FRAME.itemsize // 16) * 16  # in the buffer that starts with FRAME
VIEW_BYTES = VIEW.itemsize + 12 * 64  # with the sizes of 64 launches
INDIRECT = STORAGE | vk.VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT
FIRST_PART, LAST_PART = CONSTANTS["FIRST_PART"], CONSTANTS["LAST_PART"]
BACKGROUND = CONSTANTS["BACKGROUND"]
GEOMETRY_BUFFERS = ("sources", "placed", "first_triangles")


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

    If the cache does not hold all meshlets, paths of "rt" sweep over the model for each ray: part
    by part is decoded into the cache, and the nearest hit is kept. In "rt-paper" rays decode
    missing meshlets by themselves.

    Raises VulkanError if the device lacks ray tracing or memory, or the cache of "rt" holds less
    than 1/64 of the meshlets; ValueError for an unknown group.
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
    ):
        group = group or (64 if path == "rt-paper" else 4)
        _check(path, cache, cache_bytes, group)
        device.require("raytracing", path)
        compressed = path in ("rt", "rt-paper")
        if compressed:
            shared = device.limits.compute_shared_bytes
            require_room(device, scene, path, shared, "choose --path rt-triangles or geometry")
        self.device, self.scene, self.path, self.group = device, scene, path, group
        self.samples = samples or (DEFAULT_SAMPLES if bounces else 1)
        self._slots = SlotLayout.of(scene, traced=True)
        self.slot_bytes = self._slots.bytes
        self.meshlets = sum(p.meshlets for p in scene.primitives)
        self.slots = self._count_slots(cache, cache_bytes) if compressed else 0
        self.all_cached = self.slots == self.meshlets
        self.sweeps = path == "rt" and not self.all_cached
        self._part = 0  # that the slots hold
        self._passes: list[tuple[int, int, int]] = []
        self._picture: dict[str, Buffer] = {}
        self._commands: dict[tuple[int, int], Any] = {}
        self._size: tuple[int, int] | None = None
        self.set_light(bounces=bounces, shadows=shadows)

        needs = {"blobs"} if compressed else {"vertices", "indices"}
        self.buffers = SceneBuffers(device, scene, needs)
        self._frame = Buffer(device, VIEW_OFFSET + VIEW_BYTES, INDIRECT)
        self._frame_host = Buffer(device, self._frame.size, host=True)
        start = Camera.fit_box(scene.low, scene.high, 1, 1)
        self._frame.write(self.buffers.frame_record(start, 1, 1, 0).tobytes())
        self._own: dict[str, Buffer] = {}
        self.geometry = Geometry(
            device,
            scene,
            path,
            frame=self._frame.address,
            constants=self._constants(3),
            part_meshlets=self.slots if self.sweeps else None,
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
        if self.path == "rt-paper" and 0 < self.slots < self.meshlets:
            self._choose_as_paper()
        frame = self.buffers.frame_record(camera, width, height, 0).tobytes()
        view, strips = self._view_record(camera)
        self._frame_host.write(frame.ljust(VIEW_OFFSET, b"\0") + view)
        self._passes = self._plan_passes(strips)
        key = strips, self._part
        if key not in self._commands:
            self._commands[key] = self._record_frame(strips)
        self.device.submit(self._commands[key])
        if self._passes:
            self._part = self._passes[-1][0]
        return float(self._times.milliseconds().sum())

    def statistics(self) -> dict[str, int]:
        """Counts of the last frame. Empty for paths without a cache.

        slots, meshlets: how many there are; parts: of the model; passes: launches of rays that met
        one part each.
        """
        found = {"slots": self.slots, "meshlets": self.meshlets}
        found |= {"parts": self.geometry.parts, "passes": len(self._passes)}
        return found if self.slots else {}

    def resident_bytes(self) -> dict[str, int]:
        """Allocated bytes of device memory by part, without pictures and textures.

        cache: everything that is decoded. records: of paths that sweep; they grow with the picture,
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
            "VERTEX_FLOATS": self.scene.vertex_floats,
            "ATTRIBUTES": self.scene.attributes,
            "SWEEPS": int(self.sweeps),
            **self._slots.constants,
        }

    def _make_cache(self) -> None:
        """Makes the cache and decodes the first meshlets into it."""
        self._own["cache"] = Buffer(self.device, self.slots * self.slot_bytes)
        self._fill = ComputePipeline.of(
            self.device, "rt_fill.comp", self._constants(self.scene.max_elements)
        )
        if self.path == "rt-paper":
            table = np.arange(self.meshlets, dtype=np.uint32)
            table[self.slots :] = NO_SLOT
            self._own["slot_table"] = Buffer(self.device, table.nbytes).write(table)
            self._own["counters"] = Buffer(self.device, table.nbytes).write(np.zeros_like(table))
            self._own["items"] = Buffer(self.device, 8 * max(self.slots, 1))
        with self.device.commands() as commands:
            self._record_fill(commands, 0, self.slots, listed=False)

    def _choose_as_paper(self) -> None:
        """Gives the slots to the meshlets that most rays tested in the last frame."""
        counts, table = (self._own[name].read() for name in ("counters", "slot_table"))
        wanted = np.argsort(-counts.astype(np.int64), kind="stable")[: self.slots]
        missing = wanted[table[wanted] == NO_SLOT]
        evicted = np.setdiff1d(np.flatnonzero(table != NO_SLOT), wanted)
        items = np.full((self.slots, 2), CONSTANTS["NO_ITEM"], np.uint32)
        items[: len(missing), 0], items[: len(missing), 1] = missing, table[evicted]
        table = table.copy()
        table[missing], table[evicted] = table[evicted], NO_SLOT
        for name, data in (("items", items), ("slot_table", table), ("counters", 0 * counts)):
            self._own[name].write(data)

    # --- frames ---

    def _plan_passes(self, strips: int) -> list[tuple[int, int, int]]:
        """(part, level as in RaysPush, strip) of the passes of a frame's sweeps.

        A sweep begins with the part that the slots hold. There is one for each ray of a path,
        where a shadow ray takes the sweep of the next ray.
        """
        if not self.sweeps:
            return []
        last = self.geometry.parts - 1
        sweep = list(range(last + 1))
        if self._part == last:
            sweep.reverse()
        passes = []
        for strip in range(strips):
            for sample in range(self.samples):
                for bounce in range(self.bounces + 1 + self.shadows):
                    passes += [(part, bounce | sample << 8, strip) for part in sweep]
                    sweep.reverse()
        return passes

    @property
    def _pixel_bytes(self) -> int:
        """Of the records of a pixel. Those of paths with one ray are shorter."""
        single = not self.bounces and not self.shadows and self.samples == 1
        return RECORD_BYTES if single else 2 * RECORD_BYTES

    def _prepare(self, width: int, height: int) -> None:
        """Makes the buffers of a picture of this size."""
        self._forget_picture()
        pixels, limits = width * height, self.device.limits
        if pixels > limits.launch_invocations or width > limits.launch_width:
            raise VulkanError(
                f"the device cannot trace a picture of {width} x {height} pixels",
                "ask for a smaller one",
            )
        if len(self._plan_passes(2)) > MAX_PASSES:
            raise VulkanError(
                f"{self.samples} samples of {self.bounces} bounces take too many passes",
                "ask for fewer or for a larger cache",
            )
        sizes = {"colors": 4 * pixels, "hits": 4 * HIT_WORDS * pixels}
        if self.sweeps:
            sizes["records"] = max(MAX_PIXEL_BYTES * pixels, self._pixel_bytes * width)
        self._picture = {name: Buffer(self.device, size) for name, size in sizes.items()}
        self._size = (width, height)

    def _forget_picture(self) -> None:
        for buffer in self._picture.values():
            buffer.free()
        for commands in self._commands.values():
            vk.vkFreeCommandBuffers(self.device.handle, self.device.pool, 1, [commands])
        self._picture, self._commands, self._size = {}, {}, None

    def _view_record(self, camera: Camera) -> tuple[bytes, int]:
        """(View of shaders/raytrace/rt_paths.glsl with the sizes of launches, number of strips)"""
        if not self.sweeps:
            return b"", 0
        assert self._size is not None
        left, top, right, bottom = self._rectangle(camera)
        room = self._picture["records"].size // self._pixel_bytes
        rows = max(min(room // max(right - left, 1), bottom - top), 1)
        found = self._picture["records"].address
        single = self._pixel_bytes == RECORD_BYTES
        view = push_record(
            VIEW,
            found=found,
            levels=0 if single else found + room * RECORD_BYTES,
            left=left,
            top=top,
            width=right - left,
            height=bottom - top,
            rows=rows,
        )
        launches = [
            (right - left, min(rows, bottom - first), 1) for first in range(top, bottom, rows)
        ]
        return view.tobytes() + np.array(launches, np.uint32).tobytes(), len(launches)

    def _rectangle(self, camera: Camera) -> tuple[int, int, int, int]:
        """Left, top, right and bottom of the pixels that may show the scene."""
        assert self._size is not None
        size = np.array(self._size)
        corners = self.geometry.corners
        with np.errstate(all="ignore"):
            matrix = camera.world_to_clip(*self._size)
            clip = corners @ matrix[:, :3].T + matrix[:, 3]
            places = (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * size
        # Behind the camera, or not numbers.
        if not (clip[:, 3] > 0).all() or not np.isfinite(places).all():
            return 0, 0, *self._size
        low = np.clip(np.floor(places.min(axis=0)) - MARGIN, 0, size - 1).astype(int)
        high = np.clip(np.ceil(places.max(axis=0)) + MARGIN, low + 1, size).astype(int)
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

    def _record_frame(self, strips: int) -> Any:
        """The command buffer of a picture."""
        passes, part = self._passes, self._part
        commands = self.device.record()
        self._times.reset(commands)
        copy = vk.VkBufferCopy(0, 0, self._frame.size)
        vk.vkCmdCopyBuffer(commands, self._frame_host.handle, self._frame.handle, 1, [copy])
        self.device.full_barrier(commands)
        self._times.mark(commands, 0)
        if self.path == "rt-paper" and 0 < self.slots < self.meshlets:
            self._record_fill(commands, 0, self.slots, listed=True)
        bind_point = vk.VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR
        vk.vkCmdBindPipeline(commands, bind_point, self._rays.handle)
        vk.vkCmdBindDescriptorSets(
            commands, bind_point, self._layout, 0, 1, [self._textures.set], 0, []
        )
        self._record_rays(commands, part=BACKGROUND if passes else 0)
        for number, (new, level, strip) in enumerate(passes):
            if new != part:
                # Beside the last part, which may be smaller, the slots keep some of the one before.
                larger, first = max(new, part) * self.slots, new * self.slots
                count = min(self.slots, self.meshlets - larger)
                self._record_fill(commands, first, count, listed=False)
                part = new
            ends = FIRST_PART * (number % self.geometry.parts == 0)
            ends |= LAST_PART * ((number + 1) % self.geometry.parts == 0)
            place = VIEW_OFFSET + VIEW.itemsize + 12 * strip
            fields = {"first": new * self.slots, "level": level, "strip": strip}
            self._record_rays(commands, place, part=ends, structure=new, **fields)
        self._times.mark(commands, 1)
        vk.vkEndCommandBuffer(commands)
        return commands

    def _pushed(self, dtype: np.dtype, **fields: int) -> np.ndarray:
        """Push constants: the given fields, and the addresses of all buffers that it has."""
        buffers = {**self._own, **self._picture, "frame": self._frame}
        buffers |= {name: getattr(self.geometry, name) for name in GEOMETRY_BUFFERS}
        assert dtype.names is not None
        found = {name: b.address for name, b in buffers.items() if b and name in dtype.names}
        return push_record(dtype, **{**found, **fields})

    def _record_fill(self, commands: Any, first: int, count: int, *, listed: bool) -> None:
        """Records the decoding of `count` meshlets from number `first` on, or of the list."""
        data = self._pushed(FILL_PUSH, first=first, count=count)
        if not listed:
            data["items"] = 0
        self._fill.dispatch(commands, max(min(count, MAX_GROUPS), 1), data)
        self.device.full_barrier(commands)

    def _record_rays(self, commands: Any, launch: int = 0, structure: int = 0, **own: int) -> None:
        """Records a launch of rays that meet a part.

        launch: where its size is in the buffer of the frame; 0: all pixels.
        """
        data = self._pushed(
            RAYS_PUSH,
            view=self._frame.address + VIEW_OFFSET,
            structure=self.geometry.tops.addresses[structure],
            bounces=self.bounces,
            samples=self.samples,
            shadows=int(self.shadows),
            **own,
        )
        push(commands, self._layout, data)
        if launch:
            trace = self.device.function("vkCmdTraceRaysIndirectKHR")
            trace(commands, *self._rays.regions, self._frame.address + launch)
        else:
            assert self._size is not None
            trace = self.device.function("vkCmdTraceRaysKHR")
            trace(commands, *self._rays.regions, *self._size, 1)
        self.device.full_barrier(commands)

    def _number_triangles(self, ids: np.ndarray) -> None:
        """Replaces numbers of triangles in their primitive by meshlet * 64 + triangle."""
        for number, instance in enumerate(self.scene.instances):
            mine = ids[..., 0] == number
            if mine.any():
                ids[..., 1][mine] = (
                    self.scene.primitives[instance.primitive].decoded().ids()[ids[..., 1][mine]]
                )


def _check(path: str, cache: float, cache_bytes: int | None, group: int) -> None:
    """Raises VulkanError or ValueError for options of RayTracer that are out of range."""
    if path not in PATHS:
        raise VulkanError(f"there is no path {path}", f"the ray-traced ones are {', '.join(PATHS)}")
    if not 0 <= cache <= 1 or (cache_bytes or 0) < 0:
        raise VulkanError(
            "the cache is a share from 0 to 1, or a number of bytes", "for example 0.25"
        )
    if group not in GROUPS:
        raise ValueError("group is 4, 8, 16, 32 or 64")

"""Ray tracing of compressed meshlets with a cache of decoded ones."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any, ClassVar

import numpy as np

from gltf_ext.errors import blaming

from ..decode.slots import SlotLayout
from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.errors import VulkanError
from ..gpu.limits import MAX_WORKGROUPS
from ..gpu.memory import Buffer
from ..gpu.pipelines import ComputePipeline, Timestamps, addresses, push, push_record
from ..gpu.reflection import structure
from ..scene.buffers import FRAME, SceneBuffers, require_room
from ..scene.camera import Camera
from ..scene.scene import Scene
from ..scene.textures import TextureArray, array_size, textures_layout
from .commands import MESHLET_LEVELS, Area, FrameSubmissions, tiles
from .geometry import Geometry
from .pipeline import RayPipeline

RAYS_PUSH, FILL_PUSH = structure("RaysPush"), structure("FillPush")
MAX_PARTS = 64  # of the model: the slots hold one at a time
MAX_PASSES = 1 << 16  # of a frame
SERIAL_FILL = 12_000  # meshlets; from here on a thread each is faster than a team each (docs)
MAX_BOUNCES = 254  # RaysPush.level
DEFAULT_SAMPLES = 16  # paths per pixel, with bounces
RECORD_BYTES = CONSTANTS["RECORD_BYTES"]
MARGIN = 2  # pixels around the rectangle in which the scene is
HIT_WORDS = CONSTANTS["HIT_WORDS"]
FIRST_PART, LAST_PART = CONSTANTS["FIRST_PART"], CONSTANTS["LAST_PART"]
BACKGROUND = CONSTANTS["BACKGROUND"]


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

    cache: bytes that decoded meshlets may take (None: as many as all need). bounces: diffuse
    bounces; shadows: trace shadow rays; samples: paths per pixel (None: 1, or 16 with bounces).

    If the cache does not hold all meshlets, paths sweep over the model for each ray: part by part
    is decoded into the cache, and the nearest hit is kept.

    Raises VulkanError if the device lacks ray tracing or memory, or the cache holds less than 1/64
    of the meshlets.
    """

    path = "rt"
    hit_shaders: ClassVar = {
        "closestHitShader": "rt_surface.rchit",
        "anyHitShader": "rt_alpha.rahit",
        "intersectionShader": "rt_meshlets.rint",
    }
    box_triangles = 4  # behind each box, a power of two
    needs: ClassVar = frozenset({"blobs"})  # of SceneBuffers
    may_sweep = True

    def __init__(
        self,
        device: Device,
        scene: Scene,
        *,
        cache: int | None = None,
        bounces: int = 0,
        shadows: bool = True,
        samples: int | None = None,
    ):
        device.require("raytracing", self.path)
        if "blobs" in self.needs:
            shared = device.limits.compute_shared_bytes
            require_room(device, scene, self.path, shared, "choose --path geometry or vertex")
        self.device, self.scene = device, scene
        self.samples = samples or (DEFAULT_SAMPLES if bounces else 1)
        layout = SlotLayout.of(scene, traced=True)
        self.slot_bytes = layout.bytes
        self.meshlets = sum(p.meshlets for p in scene.primitives)
        self.slots = self._count_slots(cache)
        self.sweeps = self.may_sweep and self.slots < self.meshlets
        self.parts = -(-self.meshlets // self.slots) if self.sweeps else 1
        self._part = 0  # that the slots hold
        self.passes = 0  # of the last frame: launches of rays that met one part each
        self._picture: dict[str, Buffer] = {}
        self._size = (0, 0)
        self.set_light(bounces=bounces, shadows=shadows)
        with device.free_on_error():
            self._make_resources(layout)

    def _make_resources(self, layout: SlotLayout) -> None:
        """Makes everything on the device that does not depend on the picture's size."""
        device, scene = self.device, self.scene
        self.buffers = SceneBuffers(device, scene, self.needs)
        frame = Buffer(device, FRAME.itemsize)
        start = Camera.fit_box(scene.low, scene.high, 1, 1)
        frame.write(self.buffers.frame_record(start, 1, 1, 0).tobytes())
        constants = {**self._constants(), **layout.constants}
        self.geometry = self._make_geometry(self.buffers.primitives_address, constants)
        self._own = {
            "frame": frame,
            "sources": self.geometry.sources,
            "placed": self.geometry.placed,
        }
        with blaming(scene.path):
            self._textures = TextureArray(device, scene.textures)
        textures = array_size(scene.textures)
        self._layout = textures_layout(device, textures)
        hit = dict(self.hit_shaders)
        if not self.geometry.any_masked:
            del hit["anyHitShader"]
        self._rays = RayPipeline(
            device, hit, constants=constants, layout=self._layout, textures=textures
        )
        self._times = Timestamps(device, 2)
        self._make_cache(constants)

    # --- use ---

    def render(self, camera: Camera, width: int, height: int) -> TracedPicture:
        """Renders one frame."""
        milliseconds = self.time(camera, width, height)
        hits = self._picture["hits"].read().reshape(height, width, HIT_WORDS)
        ids = self.scene.whole_ids(self._ids(np.ascontiguousarray(hits[..., :2])))
        floats = np.ascontiguousarray(hits[..., 2:]).view(np.float32)
        color = self._picture["colors"].read(np.uint8).reshape(height, width, 4)
        return TracedPicture(color, ids, floats[..., 0], floats[..., 1:], milliseconds)

    def time(self, camera: Camera, width: int, height: int) -> float:
        """Renders one frame without copying it to the host; milliseconds on the GPU."""
        if self._size != (width, height):
            self._prepare(width, height)
        frame = self.buffers.frame_record(camera, width, height, 0)
        self._own["frame"].write(frame.tobytes())
        submissions = FrameSubmissions(self.device, self._bind)
        self._times.reset(submissions.commands)
        self._times.mark(submissions.commands, 0)
        self._record(submissions, camera)
        self._times.mark(submissions.commands, 1)
        submissions.run()
        return float(self._times.milliseconds().sum())

    def resident_bytes(self) -> dict[str, int]:
        """Allocated bytes of device memory by part, without pictures and textures.

        cache: everything that is decoded. records: of paths that sweep; they grow with the picture,
        all other parts with the model.
        """
        own = {name: buffer.allocated for name, buffer in self._own.items()}
        return {
            "model": self.buffers.resident_bytes,
            "acceleration": self.geometry.resident_bytes,
            "cache": own.pop("cache", 0),
            "tables": self._rays.table.allocated + sum(own.values()),
            "records": self._picture["records"].allocated if "records" in self._picture else 0,
        }

    def set_light(self, *, bounces: int, shadows: bool) -> None:
        """Changes bounces and shadows from the next frame on. Raises VulkanError for too many."""
        passes = self.samples * _levels(bounces, shadows) * self.parts
        if not 0 <= bounces <= MAX_BOUNCES or not 0 < passes <= MAX_PASSES:
            raise VulkanError(
                f"{self.samples} samples of {bounces} bounces take too many passes",
                f"ask for at most {MAX_BOUNCES} bounces, for fewer samples or for a larger cache",
            )
        self.bounces, self.shadows = bounces, shadows

    def free(self) -> None:
        """Frees the device memory; the tracer cannot be used afterwards."""
        self.buffers.free()
        self.geometry.free()
        self._textures.free()
        for buffer in (*self._own.values(), *self._picture.values(), self._rays.table):
            buffer.free()

    # --- setup ---

    def _count_slots(self, cache: int | None) -> int:
        """Raises VulkanError if sweeps would need more than MAX_PARTS parts."""
        least = -(-self.meshlets // MAX_PARTS) if self.may_sweep else 0
        slots = self.meshlets if cache is None else cache // self.slot_bytes
        if slots < least:
            raise VulkanError(
                f"the cache holds {slots} of {self.meshlets} meshlets, fewer than one in "
                f"{MAX_PARTS}",
                f"give it {least * self.slot_bytes} bytes or more",
            )
        return min(slots, self.meshlets)

    def _constants(self) -> dict[str, int]:
        """Specialisation constants besides those of slots."""
        return {
            "MAX_STREAMS": self.scene.max_streams,
            "MAX_ELEMENTS": self.scene.max_elements,
            "BOX_TRIANGLES": self.box_triangles,
            "SWEEPS": int(self.sweeps),
        }

    def _make_geometry(self, primitives: int, constants: dict[str, int]) -> Geometry:
        """primitives: address of their table."""
        return Geometry(
            self.device,
            self.scene,
            primitives=primitives,
            constants=constants,
            part_meshlets=self.slots if self.sweeps else self.meshlets,
        )

    def _make_cache(self, constants: dict[str, int]) -> None:
        """Makes the cache and decodes the first meshlets into it."""
        self._own["cache"] = Buffer(self.device, self.slots * self.slot_bytes)
        self._fill, self._fill_serial = (
            ComputePipeline.of(self.device, name, constants)
            for name in ("rt_fill.comp", "rt_fill_serial.comp")
        )
        with self.device.commands() as commands:
            self._record_fill(commands, 0, self.slots)

    # --- frames ---

    def _prepare(self, width: int, height: int) -> None:
        """Makes the buffers of a picture of this size."""
        self.device.limits.check_rays(width, height)
        pixels = width * height
        for buffer in self._picture.values():
            buffer.free()
        self._picture, self._size = {}, (0, 0)  # the new ones may not fit the device
        sizes = {"colors": 4 * pixels, "hits": 4 * HIT_WORDS * pixels}
        if self.sweeps:
            # One record per pixel; a row of pixels may need two.
            sizes["records"] = RECORD_BYTES * width * max(height, 2)
        with self.device.free_on_error():
            self._picture = {name: Buffer(self.device, size) for name, size in sizes.items()}
        self._size = width, height

    def _bind(self, commands: Any) -> None:
        """Records what all launches of a command buffer need."""
        bind_point = vk.VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR
        vk.vkCmdBindPipeline(commands, bind_point, self._rays.handle)
        vk.vkCmdBindDescriptorSets(
            commands, bind_point, self._layout, 0, 1, [self._textures.set], 0, []
        )

    def _record(self, submissions: FrameSubmissions, camera: Camera) -> None:
        """Records all passes of a frame."""
        levels = self.samples * _levels(self.bounces, self.shadows)  # of a pixel
        for area in tiles(*self._size, levels):
            commands = submissions.room_for(area[2] * area[3] * levels)
            self._record_rays(commands, area, part=BACKGROUND if self.sweeps else 0)
        if self.sweeps:
            self._record_sweeps(submissions, self._strips(camera))

    def _strips(self, camera: Camera) -> list[Area]:
        """The rectangle of the picture in which the scene is, in strips that fit the records."""
        left, top, right, bottom = self._rectangle(camera)
        records = 2 if self.bounces or self.shadows else 1  # of a pixel: rt_paths.glsl
        room = self._picture["records"].size // (RECORD_BYTES * records)
        rows = room // (right - left)
        return [
            (left, first, right - left, min(rows, bottom - first))
            for first in range(top, bottom, rows)
        ]

    def _rectangle(self, camera: Camera) -> tuple[int, int, int, int]:
        """Left, top, right and bottom of the pixels that may show the scene."""
        size = np.array(self._size)
        with np.errstate(all="ignore"):
            clip = self.geometry.corners @ camera.world_to_clip(*self._size).T
            places = (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * size
        # Behind the camera, or not numbers.
        if not (clip[:, 3] > 0).all() or not np.isfinite(places).all():
            return 0, 0, *self._size
        low = np.clip(np.floor(places.min(axis=0)) - MARGIN, 0, size - 1).astype(int)
        high = np.clip(np.ceil(places.max(axis=0)) + MARGIN, low + 1, size).astype(int)
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

    def _record_sweeps(self, submissions: FrameSubmissions, strips: list[Area]) -> None:
        """Records a sweep over the parts for each ray of a path.

        A shadow ray takes the sweep of the next ray. A sweep begins with the part that the slots
        hold, where the one before has ended.
        """
        parts = range(self.parts)
        if self._part == parts[-1]:
            parts = parts[::-1]
        levels = range(_levels(self.bounces, self.shadows))
        sweeps = list(product(strips, range(self.samples), levels))
        for strip, sample, bounce in sweeps:
            for part in parts:
                if part != self._part:
                    # Beside the last part, which may be smaller, the slots keep some of the one
                    # before.
                    larger = max(part, self._part) * self.slots
                    count = min(self.slots, self.meshlets - larger)
                    commands = submissions.room_for(count * MESHLET_LEVELS)
                    self._record_fill(commands, part * self.slots, count)
                    self._part = part
                ends = FIRST_PART * (part == parts[0]) + LAST_PART * (part == parts[-1])
                level = bounce | sample << 8
                commands = submissions.room_for(strip[2] * strip[3])
                self._record_rays(commands, strip, part, part=ends, level=level)
            parts = parts[::-1]
        self.passes = len(sweeps) * self.parts

    def _record_fill(self, commands: Any, first: int, count: int) -> None:
        """Records the decoding of `count` meshlets from number `first` on into the first slots."""
        data = self._pushed(FILL_PUSH, first=first, count=count)
        if count < SERIAL_FILL:
            self._fill.dispatch(commands, min(count, MAX_WORKGROUPS), data)
        else:
            self._fill_serial.dispatch(commands, min(-(-count // 32), MAX_WORKGROUPS), data)
        self.device.full_barrier(commands)

    def _record_rays(self, commands: Any, area: Area, structure: int = 0, **own: int) -> None:
        """Records a launch of the rays of an area, which meet a part."""
        left, top, width, height = area
        data = self._pushed(
            RAYS_PUSH,
            structure=self.geometry.tops.addresses[structure],
            bounces=self.bounces,
            samples=self.samples,
            shadows=int(self.shadows),
            width=self._size[0],
            pixel=top * self._size[0] + left,
            first=structure * self.slots,
            **own,
        )
        push(commands, self._layout, data)
        trace = self.device.function("vkCmdTraceRaysKHR")
        trace(commands, *self._rays.regions, width, height, 1)
        self.device.full_barrier(commands)

    def _pushed(self, dtype: np.dtype, **fields: int) -> np.ndarray:
        """Push constants: the given fields, and the addresses of all buffers that it has."""
        found = addresses(dtype, {**self._own, **self._picture})
        own = {name: value for name, value in fields.items() if name in (dtype.names or ())}
        return push_record(dtype, **{**found, **own})

    def _ids(self, hits: np.ndarray) -> np.ndarray:
        """uint32[..., 2] instance and meshlet * 64 + triangle, from the shaders' hits."""
        return hits if self.sweeps else self.scene.drawn_ids(hits)


def _levels(bounces: int, shadows: bool) -> int:
    """Levels of a path: see shaders/raytrace/rt_paths.glsl."""
    return bounces + 1 + shadows

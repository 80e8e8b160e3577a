"""What all tracers have in common: the rays of a picture, its buffers, light and time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.errors import VulkanError
from ..gpu.memory import Buffer
from ..gpu.pipelines import Timestamps, addresses, push, push_record
from ..gpu.reflection import structure
from ..scene.camera import Camera
from ..scene.view import SceneView
from .commands import Area, FrameSubmissions, tiles
from .geometry import Geometry
from .pipeline import RayPipeline

RAYS_PUSH = structure("RaysPush")
MAX_PASSES = 1 << 16  # of a frame
MAX_BOUNCES = 254  # RaysPush.level
DEFAULT_SAMPLES = 16  # paths per pixel, with bounces
RECORD_BYTES = CONSTANTS["RECORD_BYTES"]
HIT_WORDS = CONSTANTS["HIT_WORDS"]


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


class Tracer:
    """Traces the rays of pictures. A subclass has the parts: geometry, shaders of hits, decoders.

    rays: made before the geometry, so that the driver compiles it meanwhile. parts: of the
    geometry, of which a launch of rays meets one. bounces, shadows, samples: see RayTracer.
    """

    def __init__(
        self,
        view: SceneView,
        geometry: Geometry,
        rays: RayPipeline,
        *,
        parts: int = 1,
        bounces: int = 0,
        shadows: bool = True,
        samples: int | None = None,
    ):
        self.device, self.scene, self.view, self.geometry = view.device, view.scene, view, geometry
        self.samples = samples or (DEFAULT_SAMPLES if bounces else 1)
        self.parts = parts
        self.passes = 0  # of the last frame: launches of rays that met one part each
        self.set_light(bounces=bounces, shadows=shadows)
        # Shaders read the frame's tables before there is a picture.
        self.view.look(Camera.fit_box(self.scene.low, self.scene.high, 1, 1), 1, 1)
        self._rays = rays
        self._times = Timestamps(self.device, 2)
        self._own = {"sources": geometry.sources, "placed": geometry.placed}
        self._picture: dict[str, Buffer] = {}
        self._size = (0, 0)

    def record(self, submissions: FrameSubmissions, camera: Camera) -> None:
        """Records a frame."""
        for area in tiles(*self._size, self.levels):
            commands = submissions.room_for(area[2] * area[3] * self.levels)
            self.record_rays(commands, area)

    def meshlet_ids(self, hits: np.ndarray) -> np.ndarray:
        """uint32[..., 2] instance and meshlet * 64 + triangle, from the shaders' hits."""
        return hits

    # --- use ---

    def render(self, camera: Camera, width: int, height: int) -> TracedPicture:
        """Renders one frame."""
        milliseconds = self.time(camera, width, height)
        hits = self._picture["hits"].read().reshape(height, width, HIT_WORDS)
        ids = self.scene.whole_ids(self.meshlet_ids(np.ascontiguousarray(hits[..., :2])))
        floats = np.ascontiguousarray(hits[..., 2:]).view(np.float32)
        color = self._picture["colors"].read(np.uint8).reshape(height, width, 4)
        return TracedPicture(color, ids, floats[..., 0], floats[..., 1:], milliseconds)

    def time(self, camera: Camera, width: int, height: int) -> float:
        """Renders one frame without copying it to the host; milliseconds on the GPU."""
        if self._size != (width, height):
            self._prepare(width, height)
        self.view.look(camera, width, height)
        submissions = FrameSubmissions(self.device, self._bind)
        self._times.reset(submissions.commands)
        self._times.mark(submissions.commands, 0)
        self.record(submissions, camera)
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
            "model": self.view.resident_bytes,
            "acceleration": self.geometry.resident_bytes,
            "cache": own.pop("cache", 0),
            "tables": self._rays.table.allocated + sum(own.values()),
            "records": self._picture["records"].allocated if "records" in self._picture else 0,
        }

    def set_light(self, *, bounces: int, shadows: bool) -> None:
        """Changes bounces and shadows from the next frame on. Raises VulkanError for too many."""
        levels = bounces + 1 + shadows  # of a path: see shaders/raytrace/rt_paths.glsl
        passes = self.samples * levels * self.parts
        if not 0 <= bounces <= MAX_BOUNCES or not 0 < passes <= MAX_PASSES:
            raise VulkanError(
                f"{self.samples} samples of {bounces} bounces take too many passes",
                f"ask for at most {MAX_BOUNCES} bounces, for fewer samples or for a larger cache",
            )
        self.bounces, self.shadows = bounces, shadows
        self.levels = self.samples * levels  # of a pixel

    def free(self) -> None:
        """Frees the device memory; the tracer cannot be used afterwards."""
        self.view.free()
        self.geometry.free()
        for buffer in (*self._own.values(), *self._picture.values(), self._rays.table):
            buffer.free()

    # --- frames ---

    def _prepare(self, width: int, height: int) -> None:
        """Makes the buffers of a picture of this size."""
        self.device.limits.check_rays(width, height)
        pixels = width * height
        for buffer in self._picture.values():
            buffer.free()
        self._picture, self._size = {}, (0, 0)  # the new ones may not fit the device
        sizes = {"colors": 4 * pixels, "hits": 4 * HIT_WORDS * pixels}
        if self.parts > 1:
            # One record per pixel; a row of pixels may need two.
            sizes["records"] = RECORD_BYTES * width * max(height, 2)
        with self.device.free_on_error():
            self._picture = {name: Buffer(self.device, size) for name, size in sizes.items()}
        self._size = width, height

    def _bind(self, commands: Any) -> None:
        """Records what all launches of a command buffer need."""
        bind_point = vk.VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR
        vk.vkCmdBindPipeline(commands, bind_point, self._rays.handle)
        self.view.bind(commands, bind_point)

    def record_rays(
        self, commands: Any, area: Area, structure: int = 0, first: int = 0, **own: int
    ) -> None:
        """Records a launch of the rays of an area, which meet a part.

        first: number of the part's first meshlet.
        """
        left, top, width, height = area
        data = self.pushed(
            RAYS_PUSH,
            structure=self.geometry.tops.addresses[structure],
            bounces=self.bounces,
            samples=self.samples,
            shadows=int(self.shadows),
            width=self._size[0],
            pixel=top * self._size[0] + left,
            first=first,
            **own,
        )
        push(commands, self.view.layout, data)
        trace = self.device.function("vkCmdTraceRaysKHR")
        trace(commands, *self._rays.regions, width, height, 1)
        # The next launch reads the records; the next decoding overwrites the slots.
        self.device.full_barrier(commands)

    def pushed(self, dtype: np.dtype, **fields: int) -> np.ndarray:
        """Push constants: the given fields, and the addresses of all buffers that it has."""
        found = addresses(dtype, {**self._own, **self._picture})
        own = {name: value for name, value in fields.items() if name in (dtype.names or ())}
        return push_record(dtype, frame=self.view.frame, **{**found, **own})

"""Ray tracing of compressed meshlets with a cache of decoded ones."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from ..decode.decoder import TRACED, TRACED_SERIAL, Decoder, Stage
from ..decode.slots import SlotLayout
from ..decode.structures import FILL_PUSH
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.errors import VulkanError
from ..gpu.limits import MAX_WORKGROUPS
from ..scene.buffers import require_room
from ..scene.camera import Camera
from ..scene.scene import Scene
from ..scene.view import SceneView
from .commands import MESHLET_LEVELS, Area, FrameSubmissions, tiles
from .geometry import Geometry
from .pipeline import RayPipeline
from .rays import RECORD_BYTES, Tracer

MAX_PARTS = 64  # of the model: the slots hold one at a time
BOX_TRIANGLES = 4  # behind each box, a power of two
SERIAL_FILL = 12_000  # meshlets; from here on a thread each is faster than a team each (docs)
FILL = {False: TRACED, True: TRACED_SERIAL}  # whether so many are decoded -> how
MARGIN = 2  # pixels around the rectangle in which the scene is
FIRST_PART, LAST_PART = CONSTANTS["FIRST_PART"], CONSTANTS["LAST_PART"]
BACKGROUND = CONSTANTS["BACKGROUND"]
HIT = {
    "closestHitShader": "rt_surface.rchit",
    "anyHitShader": "rt_alpha.rahit",
    "intersectionShader": "rt_meshlets.rint",
}


def ray_constants(
    scene: Scene, layout: SlotLayout, box_triangles: int, sweeps: bool = False
) -> dict[str, int]:
    """Specialisation constants of the shaders of rays."""
    return {
        "MAX_STREAMS": scene.max_streams,
        "MAX_ELEMENTS": scene.max_elements,
        "BOX_TRIANGLES": box_triangles,
        "SWEEPS": int(sweeps),
        **layout.constants,
    }


def require(device: Device, scene: Scene, path: str) -> None:
    """Raises VulkanError if the device cannot trace rays, or decode the scene in a workgroup."""
    device.require("raytracing", path)
    shared = device.limits.compute_shared_bytes
    require_room(device, scene, path, shared, "choose --path geometry or vertex")


@dataclass(frozen=True)
class Numbered:
    """Jobs of a decoder: meshlets [first, first + count) by number, for the first slots."""

    first: int
    count: int

    def dispatch(self, commands: Any, stage: Stage, pushed: np.ndarray) -> None:
        """See decoder.Jobs. A workgroup takes every n-th meshlet if they are too many."""
        own = pushed.copy()
        own["first"], own["count"] = self.first, self.count
        workgroups = min(-(-self.count // stage.meshlets), MAX_WORKGROUPS)
        stage.pipeline.dispatch(commands, workgroups, own)


class RayTracer(Tracer):
    """Renders a scene by tracing rays.

    cache: bytes that decoded meshlets may take (None: as many as all need). bounces: diffuse
    bounces; shadows: trace shadow rays; samples: paths per pixel (None: 1, or 16 with bounces).

    If the cache does not hold all meshlets, paths sweep over the model for each ray: part by part
    is decoded into the cache, and the nearest hit is kept.

    Raises VulkanError if the device lacks ray tracing or memory, or the cache holds less than 1/64
    of the meshlets.
    """

    def __init__(self, device: Device, scene: Scene, *, cache: int | None = None, **light: Any):
        require(device, scene, "rt")
        layout = SlotLayout.of(scene, traced=True)
        meshlets = sum(p.meshlets for p in scene.primitives)
        slots = meshlets if cache is None else min(cache // layout.bytes, meshlets)
        least = -(-meshlets // MAX_PARTS)
        if slots < least:
            raise VulkanError(
                f"the cache holds {slots} of {meshlets} meshlets, fewer than one in {MAX_PARTS}",
                f"give it {least * layout.bytes} bytes or more",
            )
        constants = ray_constants(scene, layout, BOX_TRIANGLES, sweeps=slots < meshlets)
        with device.free_on_error():
            view = SceneView(device, scene, frozenset({"blobs"}), matrices=False)
            rays = RayPipeline(view, HIT, constants)
            serial = slots >= SERIAL_FILL
            self._decoders = {serial: Decoder(device, layout, slots, constants, FILL[serial])}
            geometry = Geometry(view, constants=constants, part_meshlets=slots)
            super().__init__(view, geometry, rays, parts=geometry.parts, **light)
            self.meshlets, self.slots, self.slot_bytes = meshlets, slots, layout.bytes
            self.sweeps = slots < meshlets
            self._part = 0  # that the slots hold
            self._own["cache"] = self._decoder(slots).buffers["slots"]
            with device.commands() as commands:
                self._record_fill(commands, 0, slots)

    def meshlet_ids(self, hits: np.ndarray) -> np.ndarray:
        return hits if self.sweeps else self.scene.drawn_ids(hits)

    def record(self, submissions: FrameSubmissions, camera: Camera) -> None:
        """Without sweeps, all rays of a path in one launch; else the background and the sweeps."""
        if not self.sweeps:
            super().record(submissions, camera)
            return
        for area in tiles(*self._size, self.levels):
            commands = submissions.room_for(area[2] * area[3] * self.levels)
            self.record_rays(commands, area, part=BACKGROUND)
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
        levels = range(self.levels // self.samples)
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
                self.record_rays(
                    commands, strip, part, first=part * self.slots, part=ends, level=level
                )
            parts = parts[::-1]
        self.passes = len(sweeps) * self.parts

    def slot_words(self) -> np.ndarray:
        """uint32[slots, words]: what the cache holds; waits."""
        return self._decoder(self.slots).slot_words()

    def _decoder(self, count: int) -> Decoder:
        """That is faster for `count` meshlets; all fill the same slots."""
        serial = count >= SERIAL_FILL
        if serial not in self._decoders:  # the last part may be a small one
            self._decoders[serial] = self._decoder(self.slots).by(FILL[serial])
        return self._decoders[serial]

    def _record_fill(self, commands: Any, first: int, count: int) -> None:
        """Records the decoding of `count` meshlets from number `first` on into the first slots."""
        decoder = self._decoder(count)
        decoder.decode(commands, Numbered(first, count), self.pushed(FILL_PUSH))
        # Rays read the slots.
        self.device.full_barrier(commands)

"""Path `visibility`: compute shaders rasterise the decoded meshlets, without a graphics pipeline.

Each pixel of a visibility buffer keeps its nearest triangle; then every pixel is shaded once.
shaders/visibility/visibility.glsl describes the buffer.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..decode.batches import Batch
from ..decode.decoder import Stage
from ..decode.structures import RASTER_PUSH
from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.limits import MAX_WORKGROUPS
from ..gpu.memory import Buffer, Owner
from ..gpu.pipelines import ComputePipeline, addresses
from ..gpu.targets import pyramid_bytes
from ..levels.jobs import JobList
from ..scene.view import SceneView

# Pixels in the box of a triangle that a single thread draws, at most. On an H200, all triangles
# together take up to 2 times as long with 32 or 512 (seven models at two sizes).
SMALL_PIXELS = 128
# Pieces of the larger triangles of a batch. Those that do not fit are drawn, too, but more slowly.
MAX_PIECES = 1 << 16
# On an H200, 1024 take up to 1.7 times as long with large triangles; 8192 take 8 instead of 6
# microseconds without any.
PIECE_WORKGROUPS = 4096
RESULTS = ("pixels", "color", "depth", "ids")


class Plane:
    """Values of all pixels in a buffer. size: bytes of a pixel; more: bytes after the pixels."""

    def __init__(self, device: Device, width: int, height: int, size: int, more: int = 0):
        self.width, self.height = width, height
        self.buffer = Buffer(device, width * height * size + more)

    def read(self, dtype: np.dtype | type, channels: int) -> np.ndarray:
        """dtype[height, width, channels]; waits."""
        count = self.width * self.height * channels
        return self.buffer.read(dtype, count).reshape(self.height, self.width, channels)


class Planes:
    """Colour (sRGB), depth and (or None) ids of a picture, its visibility buffer and depth pyramid.

    The same as Targets, in buffers: no image of an sRGB format can be written by compute shaders.
    """

    def __init__(self, device: Device, width: int, height: int, ids: bool):
        self.width, self.height = width, height
        pyramid = pyramid_bytes(width, height)
        self.pixels = Plane(device, width, height, CONSTANTS["PIXEL_BYTES"], pyramid)
        self.color = Plane(device, width, height, 4)
        self.depth = Plane(device, width, height, 4)
        self.ids = Plane(device, width, height, 8) if ids else None

    @property
    def addresses(self) -> dict[str, int]:
        """Buffer addresses, by the names of RasterPush in shaders/raster/raster.glsl."""
        planes = {name: getattr(self, name) for name in RESULTS}
        return {name: plane.buffer.address for name, plane in planes.items() if plane}

    def free(self) -> None:
        """Frees the buffers; a second call does nothing."""
        for plane in (self.pixels, self.color, self.depth, self.ids):
            if plane:
                plane.buffer.free()


class Rasterizer(Owner):
    """The steps that draw decoded meshlets. Each records a barrier after it, but for `clear`.

    most: meshlets that are drawn at a time. constants: of the decoder.
    """

    def __init__(self, view: SceneView, most: int, constants: dict[str, int]):
        pieces = Buffer(view.device, CONSTANTS["PIECE_BYTES"] * (1 + MAX_PIECES))
        super().__init__(pieces=pieces, overflow=Buffer(view.device, 8 * most))
        self._view, self._device = view, view.device
        constants = {
            **constants,
            "CULLING": 1,  # the decoder has done it: the same pipelines with culling and without
            "MASKED": int(view.scene.any_masked),
            "SMALL_PIXELS": SMALL_PIXELS,
            "MAX_PIECES": MAX_PIECES,
        }
        self._stages = {
            step: Stage(
                step,
                ComputePipeline.of(view.device, f"visibility_{step}.comp", constants, view.layout),
            )
            for step in ("clear", "small", "pieces", "resolve")
        }

    @property
    def addresses(self) -> dict[str, int]:
        """Buffer addresses, by the names of RASTER_PUSH."""
        return addresses(RASTER_PUSH, self.buffers)

    def clear(self, commands: Any, targets: Planes, pushed: np.ndarray) -> None:
        """First in a frame. No barrier: decoding may begin before the buffer is empty."""
        self._view.bind(commands, vk.VK_PIPELINE_BIND_POINT_COMPUTE)
        workgroups = -(-targets.width * targets.height // CONSTANTS["CLEAR_THREADS"])
        clear = self._stages["clear"].pipeline
        clear.dispatch(commands, min(workgroups, MAX_WORKGROUPS), pushed)

    def small(self, commands: Any, source: Batch | JobList, pushed: np.ndarray) -> None:
        """Draws small triangles, and cuts the others into pieces."""
        source.dispatch(commands, self._stages["small"], pushed)
        # The list of pieces is complete.
        self._device.compute_barrier(commands)

    def pieces(self, commands: Any, source: Batch | JobList, pushed: np.ndarray) -> None:
        """Draws the pieces."""
        stage = self._stages["pieces"]
        if isinstance(source, JobList):
            source.dispatch(commands, stage, pushed)
        else:
            stage.pipeline.dispatch(commands, PIECE_WORKGROUPS, source.pushed(pushed))
        # The depths are final, for `resolve` and for the pyramid.
        self._device.compute_barrier(commands)

    def resolve(self, commands: Any, targets: Planes, pushed: np.ndarray) -> None:
        """Shades the pixels that show a meshlet of this batch."""
        side = CONSTANTS["RESOLVE_SIDE"]
        columns, rows = -(-targets.width // side), -(-targets.height // side)
        self._stages["resolve"].pipeline.dispatch(commands, columns, pushed, rows)
        # The next batch overwrites the slots, and atomics compare with the pixels.
        self._device.compute_barrier(commands)

    def resolve_rest(self, commands: Any, jobs: JobList, pushed: np.ndarray) -> None:
        """The same after a later pass of a frame, if that has drawn anything."""
        jobs.dispatch(commands, self._stages["resolve"], pushed)
        # As in `resolve`.
        self._device.compute_barrier(commands)

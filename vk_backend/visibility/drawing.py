"""Path `visibility`: compute shaders rasterise the decoded meshlets, without a graphics pipeline.

Each pixel of a visibility buffer keeps its nearest triangle; then every pixel is shaded once.
shaders/visibility/visibility.glsl describes the buffer.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.limits import MAX_WORKGROUPS
from ..gpu.memory import Buffer
from ..gpu.pipelines import ComputePipeline
from ..gpu.targets import pyramid_bytes
from ..raster.drawing import BLOBS, Drawing, Mark, Path, no_mark

# Of the ring, unless the scene has fewer meshlets. On an H200, half as many take 1.28 times as long
# for bistro_like (23,882 meshlets) and 1.19 times for dragon_x4 (56,899), with 24 instead of 39 and
# 42 MB in all; one slot for each meshlet of dragon_x4 saves 6 %, with 71 MB.
SLOTS = 1 << 15
# Pixels in the box of a triangle that a single thread draws, at most. On an H200, all triangles
# together take up to 2 times as long with 32 or 512 (seven models at two sizes).
SMALL_PIXELS = 128
# Pieces of the larger triangles of a batch. Those that do not fit are drawn, too, but more slowly.
MAX_PIECES = 1 << 16
# On an H200, 1024 take up to 1.7 times as long with large triangles; 8192 take 8 instead of 6
# microseconds without any.
PIECE_WORKGROUPS = 4096
MASKED = CONSTANTS["MATERIAL_MASK"] | CONSTANTS["MATERIAL_BLEND"]
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


class VisibilityDrawing(Drawing):
    """A scene ready to be drawn by path `visibility`."""

    targets: ClassVar[Any] = Planes

    def _make_pipelines(self, constants: dict[str, int]) -> None:
        assert self.ring is not None
        self._own |= {
            "pieces": Buffer(self.device, CONSTANTS["PIECE_BYTES"] * (1 + MAX_PIECES)),
            "overflow": Buffer(self.device, 8 * self._most_drawn),
        }
        # Bench's cheapest shader lets no pixels through.
        shown = np.unique(self.scene.instances.material)
        masked = any(self.scene.materials[number].flags & MASKED for number in shown)
        constants = {
            **constants,
            "CULLING": 1,  # the ring has done it: the same pipelines with culling and without
            "MASKED": int(masked and self.path.fragment == VISIBILITY.fragment),
            "SMALL_PIXELS": SMALL_PIXELS,
            "MAX_PIECES": MAX_PIECES,
        }
        modules = {
            "clear": "visibility_clear.comp",
            "small": "visibility_small.comp",
            "pieces": "visibility_pieces.comp",
            "resolve": self.path.fragment,
        }
        self._shaders = {
            step: ComputePipeline.of(self.device, module, constants, self._layout)
            for step, module in modules.items()
        }

    @property
    def _most_drawn(self) -> int:
        """Meshlets that are drawn at a time, at most."""
        assert self.ring is not None
        return self.ring.slots

    @property
    def steps(self) -> tuple[str, ...]:
        assert self.ring is not None
        return ("clear", *("decode", "small", "pieces", "resolve") * len(self.ring.batches))

    def record(self, commands: Any, targets: Planes, mark: Mark = no_mark) -> None:
        assert self.ring is not None
        data = self._begin_frame(commands, targets, mark)
        for number in range(len(self.ring.batches)):
            self.record_decoding(commands, number)
            self._end_step(commands, mark)
            self._record_batch(commands, targets, number, data.copy(), mark)

    def _begin_frame(self, commands: Any, targets: Planes, mark: Mark) -> np.ndarray:
        """Records what comes before the first batch. Returns push constants."""
        vk.vkCmdBindDescriptorSets(
            commands,
            vk.VK_PIPELINE_BIND_POINT_COMPUTE,
            self._layout,
            0,
            1,
            [self._textures.set],
            0,
            None,
        )
        data = self._push_constants(**targets.addresses)
        workgroups = -(-targets.width * targets.height // CONSTANTS["CLEAR_THREADS"])
        self._shaders["clear"].dispatch(commands, min(workgroups, MAX_WORKGROUPS), data)
        mark(commands)  # no barrier: decoding may begin before the buffer is empty
        return data

    def _end_step(self, commands: Any, mark: Mark) -> None:
        self.device.compute_barrier(commands)
        mark(commands)

    def _record_batch(
        self, commands: Any, targets: Planes, number: int, data: np.ndarray, mark: Mark
    ) -> None:
        """Records the drawing of a decoded batch. data: push constants."""
        assert self.ring is not None
        data["segments"], data["segment_count"] = self.ring.segments(number)
        meshlets = data["meshlets"] = self.ring.batch_slots(number)
        if number == 0:
            data["batch"] |= CONSTANTS["BATCH_FIRST"]
        if number == len(self.ring.batches) - 1:
            data["batch"] |= CONSTANTS["BATCH_LAST"]
        for first in range(0, meshlets, MAX_WORKGROUPS):
            data["first_slot"] = first
            self._shaders["small"].dispatch(commands, min(meshlets - first, MAX_WORKGROUPS), data)
        data["first_slot"] = 0
        self._end_step(commands, mark)
        self._shaders["pieces"].dispatch(commands, PIECE_WORKGROUPS, data)
        self._end_step(commands, mark)
        self._record_resolve(commands, targets, data)
        self._end_step(commands, mark)

    def _record_resolve(self, commands: Any, targets: Planes, data: np.ndarray) -> None:
        side = CONSTANTS["RESOLVE_SIDE"]
        columns, rows = -(-targets.width // side), -(-targets.height // side)
        self._shaders["resolve"].dispatch(commands, columns, data, rows)


VISIBILITY = Path(
    "visibility",
    BLOBS,
    (),
    VisibilityDrawing,
    capability="atomics64",
    teams="compute_shared_bytes",
    ring=SLOTS,
    bulk=True,
    fragment="visibility_resolve.comp",
)

"""Renderer: renders pictures of a scene with any of the raster paths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import vk
from .camera import Camera
from .device import Device
from .errors import VulkanError
from .frame_commands import FrameCommands
from .pipelines import Timestamps
from .raster import PATHS, Drawing
from .ring import RING
from .scene import Scene
from .targets import Targets


@dataclass(frozen=True)
class Picture:
    """A rasterised picture.

    color: uint8[height, width, 4], sRGB; transparent if no surface covers the pixel.
    depth: float32[height, width], 0 (near) to 1 (far, or no surface); Camera.distance converts it
    to world units.
    ids: uint32[height, width, 2], instance and meshlet * 64 + triangle, 0xFFFFFFFF if no surface
    covers the pixel; None if they were not requested.
    milliseconds: on the GPU, without copies to the host.
    """

    color: np.ndarray
    depth: np.ndarray
    ids: np.ndarray | None
    milliseconds: float

    @property
    def covered(self) -> np.ndarray:
        """bool[height, width]: whether a surface covers the pixel."""
        return self.depth < 1


class Renderer:
    """Renders scenes on one device. Use it in a `with` block, or call close.

    select: a device's number or part of its name; by default the first GPU. validation: enables the
    validation layer, see `device.messages`. For path stream, ring: slots, at most; overlap: decode
    on another queue, half a ring ahead (None: if the scene is large enough).
    Raises VulkanError if there is no such device or driver.
    """

    def __init__(
        self,
        select: str | int | None = None,
        validation: bool = False,
        ring: int = RING,
        overlap: bool | None = None,
    ):
        self.ring, self.overlap = ring, overlap
        self.device = Device(select, validation=validation)
        self._limit = vk.vkGetPhysicalDeviceProperties(
            self.device.physical
        ).limits.maxImageDimension2D
        self._stamps = Timestamps(self.device, 2)
        self._scene: Scene | None = None
        self._drawings: dict[tuple[object, ...], Drawing] = {}  # of this scene
        self.drawing: Drawing | None = None  # the last one used
        self._targets: Targets | None = None

    @property
    def default_path(self) -> str:
        """ "stream" if the device has mesh shaders, else "vertex"."""
        return "stream" if "mesh" in self.device.capabilities else "vertex"

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of all buffers of the last picture's scene and path, without images."""
        return self.drawing.resident_bytes if self.drawing else 0

    def render(
        self,
        scene: Scene,
        camera: Camera,
        path: str | None = None,
        width: int = 1280,
        height: int = 720,
        culling: bool = True,
        ids: bool = True,
    ) -> Picture:
        """Renders a picture. Buffers stay on the device until another scene is rendered.

        path: a key of raster.PATHS; by default `default_path`. width, height: pixels. culling: skip
        meshlets that cannot be visible. ids: return the ids of each pixel.
        Raises VulkanError if the device cannot render this path or size.
        """
        path = path or self.default_path
        if path not in PATHS:
            raise VulkanError(f"there is no path {path}", f"there are {', '.join(PATHS)}")
        if not (0 < width <= self._limit and 0 < height <= self._limit):
            raise VulkanError(
                f"{width} x {height} pixels are not possible on {self.device.name}",
                f"at most {self._limit} each",
            )
        drawing = self.drawing = self._drawing(scene, path, culling, ids)
        drawing.look(camera, width, height)
        targets = self._fitting_targets(width, height, ids)
        frame = FrameCommands(drawing, targets, self._stamps)
        milliseconds = frame.run()
        frame.free()
        color = targets.color.read(np.uint8, 4)
        depth = targets.depth.read(np.float32, 1)[..., 0]
        found = None
        if targets.ids:
            found = targets.ids.read(np.uint32, 2)
            # Path vertex numbers triangles through all meshlets of a primitive.
            found = scene.meshlet_ids(found) if drawing.buffers.index_buffer else found
            found = scene.whole_ids(found)
        return Picture(color, depth, found, milliseconds)

    def _drawing(self, scene: Scene, path: str, culling: bool, ids: bool) -> Drawing:
        """The drawing of a path, which is kept until another scene is rendered."""
        if self._scene is not scene:
            for drawing in self._drawings.values():
                drawing.free()
            self._drawings, self.drawing, self._scene = {}, None, scene
        key = (path, culling, ids, self.ring, self.overlap)
        if key not in self._drawings:
            self._drawings[key] = Drawing(
                self.device,
                scene,
                PATHS[path],
                culling=culling,
                ids=ids,
                ring=self.ring,
                overlap=self.overlap,
            )
        return self._drawings[key]

    def _fitting_targets(self, width: int, height: int, ids: bool) -> Targets:
        last = self._targets
        if last and (last.width, last.height, last.ids is not None) == (width, height, ids):
            return last
        if last:
            last.free()
        self._targets = Targets(self.device, width, height, ids)
        return self._targets

    def close(self) -> None:
        """Frees everything on the device and closes it."""
        self.device.close()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

"""Renderer: pictures of a scene by any of the raster paths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import vulkan as vk

from .camera import Camera
from .device import Device
from .errors import VulkanError
from .frame import Frame
from .pipelines import Timestamps
from .raster import ATTRIBUTES, LIT, NO_ID, PATHS, Drawing, Pipelines, Targets
from .scene import Scene
from .stream import RING


@dataclass(frozen=True)
class Picture:
    """color: uint8[height, width, 4], sRGB, transparent where nothing is drawn; depth: float32[height, width], 0 near to 1 far and
    nothing (Camera.distance gives world units); ids: uint32[height, width, 2], instance and meshlet * 64 + triangle, NO_ID where nothing
    is drawn, or None when they were not asked for; milliseconds: on the GPU, copies apart."""

    color: np.ndarray
    depth: np.ndarray
    ids: np.ndarray | None
    milliseconds: float

    @property
    def covered(self) -> np.ndarray:
        """bool[height, width]"""
        return self.depth < 1


class Renderer:
    """Draws scenes on one device.

    select: a device's number or a part of its name; validation: with the validation layer, see `device.messages`; ring: slots of
    path stream, at most; overlap: it decodes on another queue than it draws on, half a ring ahead (None: where that pays). Raises
    VulkanError.
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
        self.pipelines = Pipelines(self.device)
        self._stamps = Timestamps(self.device, 2)
        self._scene: Scene | None = None
        self._drawings: dict[tuple, Drawing] = {}  # of that scene
        self.drawing: Drawing | None = None  # the last one used
        self._targets: Targets | None = None

    @property
    def default_path(self) -> str:
        """stream where the device has mesh shaders, else vertex."""
        return "stream" if "mesh" in self.device.capabilities else "vertex"

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of the buffers of what was drawn last; images are left out."""
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
        """A picture of the scene. What was set up for a scene is kept until another one is drawn."""
        drawing, targets = self.prepare(
            scene, camera, path, width, height, culling=culling, ids=ids
        )
        frame = Frame(drawing, targets, self._stamps)
        milliseconds = frame.run()
        frame.free()
        color = targets.color.read(np.uint8, 4)
        depth = targets.depth.read(np.float32, 1)[..., 0]
        found = (
            _meshlet_ids(scene, drawing, targets.ids.read(np.uint32, 2)) if targets.ids else None
        )
        return Picture(color, depth, found, milliseconds)

    def prepare(
        self,
        scene: Scene,
        camera: Camera,
        path: str | None,
        width: int,
        height: int,
        *,
        culling: bool = True,
        ids: bool = False,
        shading: int = LIT,
    ) -> tuple[Drawing, Targets]:
        """The drawing and the images of a picture, set up where the last ones do not fit."""
        path = path or self.default_path
        if path not in PATHS:
            raise VulkanError(f"there is no path {path}", f"there are {', '.join(PATHS)}")
        if not (0 < width <= self._limit and 0 < height <= self._limit):
            raise VulkanError(
                f"{width} x {height} pixels are not possible on {self.device.name}",
                f"at most {self._limit} each",
            )
        if self._scene is not scene:
            self._forget_drawings()
            self._scene = scene
        key = (path, culling, ids, shading, self.ring, self.overlap)
        if key not in self._drawings:
            self._drawings[key] = Drawing(
                self.pipelines,
                scene,
                path,
                culling=culling,
                ids=ids,
                shading=shading,
                ring=self.ring,
                overlap=self.overlap,
            )
        self.drawing = self._drawings[key]
        shape = self._targets and (
            self._targets.width,
            self._targets.height,
            self._targets.ids is not None,
        )
        if shape != (width, height, ids):
            if self._targets:
                self._targets.free()
            self._targets = Targets(self.device, width, height, ids)
        self.drawing.look(camera, width, height)
        return self.drawing, self._targets

    def close(self) -> None:
        self.device.close()

    def __enter__(self) -> "Renderer":
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def _forget_drawings(self) -> None:
        for drawing in self._drawings.values():
            drawing.free()
        self._drawings, self.drawing = {}, None


class TimedDrawing:
    """One path's frame for timing: recorded once, run as often as wanted, timed on the GPU.

    lit: with the shaded surface rather than the cheapest one that uses every attribute.
    """

    def __init__(
        self,
        pipelines: Pipelines,
        scene: Scene,
        camera: Camera,
        path: str,
        targets: Targets,
        *,
        culling: bool,
        lit: bool,
        ring: int = RING,
        overlap: bool | None = None,
    ):
        shading = LIT if lit else ATTRIBUTES
        self.drawing = Drawing(
            pipelines,
            scene,
            path,
            culling=culling,
            ids=False,
            shading=shading,
            ring=ring,
            overlap=overlap,
        )
        self.drawing.look(camera, targets.width, targets.height)
        self._frame = Frame(self.drawing, targets, Timestamps(pipelines.device, 2))

    def run(self) -> float:
        """Draws one frame; milliseconds on the GPU."""
        return self._frame.run()

    def free(self) -> None:
        self._frame.free()
        self.drawing.free()


def _meshlet_ids(scene: Scene, drawing: Drawing, ids: np.ndarray) -> np.ndarray:
    """The same ids for every path: the vertex path counts triangles through all meshlets."""
    if not drawing.buffers.index_buffer:
        return ids
    ids = ids.copy()
    for number, instance in enumerate(scene.instances):
        drawn = ids[..., 0] == number
        if drawn.any():
            ids[drawn, 1] = scene.primitives[instance.primitive].decoded().ids()[ids[drawn, 1]]
    return ids


__all__ = ["NO_ID", "Picture", "Renderer", "TimedDrawing"]

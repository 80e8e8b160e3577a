"""Renderer: renders pictures of a scene with any of the raster paths."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from gltf_ext.errors import MeshletError

from .decode.decoder import Decoder
from .decode.slots import SlotLayout, share_bytes
from .frame_commands import FrameCommands
from .gpu.device import Device
from .gpu.errors import VulkanError
from .levels.choice import LevelStatistics
from .levels.jobs import PoolStatistics
from .raster.instances import GeometryDrawing, VertexDrawing
from .raster.mesh import MESH_PATHS, MeshDrawing, TaskStatistics
from .raster.stream import StreamDrawing
from .scene.camera import Camera
from .scene.drawing import Drawing, Options
from .scene.scene import Scene
from .visibility.batched import BatchedDrawing
from .visibility.pooled import PooledDrawing, is_shared, slot_bytes


def _visibility(device: Device, scene: Scene, options: Options) -> Drawing:
    is_kept = scene.has_levels or options.cache is not None or is_shared(scene)
    return (PooledDrawing if is_kept else BatchedDrawing)(device, scene, options)


# Path -> what makes its drawing, and the capability that it needs.
PATHS: dict[str, tuple[Callable[[Device, Scene, Options], Drawing], str | None]] = {
    "visibility": (_visibility, BatchedDrawing.capability),
    **{path.name: (partial(MeshDrawing, path), MeshDrawing.capability) for path in MESH_PATHS},
    **{
        kind.name: (kind, kind.capability)
        for kind in (StreamDrawing, GeometryDrawing, VertexDrawing)
    },
}
DEFAULTS = ("visibility", "stream", "vertex")  # the last one works everywhere
LEVELS = ("visibility", *(path.name for path in MESH_PATHS))  # those that draw levels


def cache_bytes(scene: Scene, path: str, share: float) -> int:
    """Bytes of the cache of a path, "rt" included, that holds a share of the scene's meshlets."""
    if path == "rt":
        return share_bytes(scene, share, SlotLayout.of(scene, traced=True).bytes)
    if path == "visibility":
        return share_bytes(scene, share, slot_bytes(scene), spare=1)
    return share_bytes(scene, share, Decoder.slot_bytes(scene))


@dataclass(frozen=True)
class Picture:
    """A rasterised picture.

    color: uint8[height, width, 4], sRGB; transparent if no surface covers the pixel.
    depth: float32[height, width], 0 (near) to 1 (far, or no surface); Camera.distance converts it
    to world units.
    ids: uint32[height, width, 2], instance and meshlet * 64 + triangle, 0xFFFFFFFF if no surface
    covers the pixel; None if they were not requested.
    milliseconds: on the GPU, without copies to the host. steps: those of each step; empty if they
    were not requested. pool: if decoded meshlets are kept; of a scene that was loaded with levels
    LevelStatistics. tasks: of a picture by path mesh or mesh-paper. With levels, milliseconds,
    steps and tasks are those of the last frame, and meshlets are numbered through all pages of a
    primitive.
    """

    color: np.ndarray
    depth: np.ndarray
    ids: np.ndarray | None
    milliseconds: float
    steps: dict[str, float]
    pool: PoolStatistics | None = None
    tasks: TaskStatistics | None = None

    @property
    def levels(self) -> LevelStatistics | None:
        """Of a scene that was loaded with levels."""
        return self.pool if isinstance(self.pool, LevelStatistics) else None

    @property
    def covered(self) -> np.ndarray:
        """bool[height, width]: whether a surface covers the pixel."""
        return self.depth < 1


class Renderer:
    """Renders scenes on one device. Use it in a `with` block, or call close.

    select: a device's number or part of its name; by default the first GPU. validation: enables the
    validation layer, see `device.messages`. cache: bytes that decoded meshlets may take: path
    visibility keeps them from picture to picture, path stream has a ring of them, the other paths
    have none (None: visibility keeps none and decodes up to 32,768 meshlets at a time, with levels
    it keeps as many, stream 8,192). pages: bytes that the compressed pages of a scene with levels
    may take (None: 256 MiB, or what its coarsest pages need). occlusion: where meshlets are kept or
    have levels, and by paths mesh and mesh-paper, skip what is hidden.
    Raises VulkanError if there is no such device or driver.
    """

    def __init__(
        self,
        select: str | int | None = None,
        validation: bool = False,
        cache: int | None = None,
        pages: int | None = None,
        occlusion: bool = True,
    ):
        self.cache, self.pages, self.occlusion = cache, pages, occlusion
        self.device = Device(select, validation=validation)
        self._scene: Scene | None = None
        self._drawings: dict[tuple[str, Options], Drawing] = {}  # of this scene
        self.drawing: Drawing | None = None  # the last one used
        self._targets: Any = None

    def default_path(self, scene: Scene) -> str:
        """The first of DEFAULTS, or of LEVELS for a scene with levels, that the device can draw.

        Raises VulkanError if it can draw no path with levels.
        """
        for path in LEVELS if scene.has_levels else DEFAULTS:
            _, capability = PATHS[path]
            if capability is None or capability in self.device.capabilities:
                return path
        raise VulkanError(
            f"{self.device.name} has neither 64-bit atomics nor mesh shaders, and levels of detail "
            "need one of them",
            "choose another --device, or leave out --lod-error",
        )

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of all buffers of the last picture's scene and path, without images."""
        return self.drawing.resident_bytes if self.drawing else 0

    @property
    def refused_pages(self) -> list[MeshletError]:
        """What was wrong with the malformed pages of the last picture's scene."""
        return self.drawing.refused if self.drawing else []

    def render(
        self,
        scene: Scene,
        camera: Camera,
        path: str | None = None,
        width: int = 1280,
        height: int = 720,
        culling: bool = True,
        ids: bool = True,
        steps: bool = False,
        lod_error: float = 1.0,
        wait: bool = True,
    ) -> Picture:
        """Renders a picture. Buffers stay on the device until another scene is rendered.

        path: a key of PATHS; by default `default_path(scene)`. width, height: pixels. culling: skip
        meshlets that cannot be visible. ids: return the ids of each pixel. steps: time each step.
        lod_error: pixels, for a scene that was loaded with levels. wait: draw frames until all
        pages that the picture needs are there; otherwise draw one frame with those that are, and
        read others for later ones.
        Raises VulkanError if the device cannot render this path or size.
        """
        path = path or self.default_path(scene)
        if path not in PATHS:
            raise VulkanError(f"there is no path {path}", f"there are {', '.join(PATHS)}")
        self.device.limits.check_picture(width, height)
        drawing = self.drawing = self._drawing(scene, path, culling, ids)
        drawing.look(camera, width, height, lod_error)
        targets = self._fitting_targets(drawing.targets, width, height, ids)
        finished = False
        while not finished:
            with self.device.free_on_error():
                frame = FrameCommands(drawing, targets, steps=steps)
                times = frame.run_steps()
            frame.free()
            finished = drawing.finish(wait) or not wait
        color = targets.color.read(np.uint8, 4)
        depth = targets.depth.read(np.float32, 1)[..., 0]
        found = None
        if targets.ids:
            found = scene.whole_ids(drawing.meshlet_ids(targets.ids.read(np.uint32, 2)))
        spent, own = sum(times.values()), times if steps else {}
        return Picture(color, depth, found, spent, own, drawing.statistics, drawing.tasks)

    def _drawing(self, scene: Scene, path: str, culling: bool, ids: bool) -> Drawing:
        """The drawing of a path, which is kept until another scene is rendered."""
        if self._scene is not scene:
            for drawing in self._drawings.values():
                drawing.free()
            self._drawings, self.drawing, self._scene = {}, None, scene
        if scene.has_levels and path not in LEVELS:
            raise VulkanError(
                f"path {path} has no levels of detail", f"choose path {' or '.join(LEVELS)}"
            )
        key = (path, Options(culling, ids, self.cache, self.pages, self.occlusion))
        if key not in self._drawings:
            make, _ = PATHS[path]
            with self.device.free_on_error():
                self._drawings[key] = make(self.device, scene, key[1])
        return self._drawings[key]

    def _fitting_targets(self, kind: Any, width: int, height: int, ids: bool) -> Any:
        """Targets of a class, which are kept until others are needed."""
        last, wanted = self._targets, (kind, width, height, ids)
        if last and (type(last), last.width, last.height, last.ids is not None) == wanted:
            return last
        if last:
            last.free()
            self._targets = None  # the new ones may not fit the device
        with self.device.free_on_error():
            self._targets = kind(self.device, width, height, ids)
        return self._targets

    def close(self) -> None:
        """Frees everything on the device and closes it."""
        self.device.close()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

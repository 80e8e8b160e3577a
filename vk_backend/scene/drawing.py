"""What all raster paths have in common: a view of the scene, parts, and a frame of steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from gltf_ext.errors import MeshletError

from ..gpu.device import Device
from .camera import Camera
from .scene import Scene
from .view import SceneView


@dataclass(frozen=True)
class Step:
    """A step of a frame.

    record: adds its commands to a command buffer, with the barriers that later steps need.
    """

    name: str
    record: Callable[[Any], None]


@dataclass(frozen=True)
class Options:
    """Of a drawing, those of Renderer: a path takes those that it has a use for.

    culling: skip meshlets that cannot be visible; occlusion: also those that are hidden. ids: draw
    ids, too. cache: bytes that decoded meshlets may take; pages: those of the compressed pages of
    levels (None: the path's default).
    """

    culling: bool = True
    ids: bool = True
    cache: int | None = None
    pages: int | None = None
    occlusion: bool = True


DEFAULT = Options()


class Part(Protocol):
    """Something on the device that a drawing owns."""

    @property
    def resident_bytes(self) -> int: ...

    def free(self) -> None: ...


Owned = TypeVar("Owned", bound=Part)


class Drawing:
    """A scene ready to be drawn by one path. Each path has a subclass, which says what a frame is.

    name: of the path. capability: of device.CAPABILITIES that it needs. targets: the class that a
    picture is drawn into. overlap: of a path that decodes on a queue of its own (raster/stream.py).
    """

    # Of a scene with levels, levels.choice.Levels, which some paths draw.
    levels: Any = None
    name: str
    capability: ClassVar[str | None] = None
    targets: ClassVar[Any]
    overlap: Any = None

    def __init__(self, view: SceneView):
        self.view = view
        self._parts: list[Part] = [view]

    def own(self, part: Owned) -> Owned:
        """Adds a part to those that the drawing frees. Returns it."""
        self._parts.append(part)
        return part

    def frame(self, targets: Any) -> list[Step]:
        """The steps of a picture, in order. targets: of the class self.targets."""
        raise NotImplementedError

    def look(self, camera: Camera, width: int, height: int, lod_error: float = 1.0) -> None:
        """Sets the camera of later pictures. lod_error: pixels, of a scene with levels."""
        self.view.look(camera, width, height)
        if self.levels:
            self.levels.look(camera, width, height, lod_error)

    def finish(self, wait: bool) -> bool:
        """Call after a frame has run. Returns whether another frame would be the same.

        wait: for pages that the frame lacked.
        """
        return not self.levels or self.levels.finish(wait, self.counts_of)

    def counts_of(self, cut: Any) -> dict[str, int]:
        """The fields of PoolStatistics, of CUT[()] after a frame. Of a drawing with levels."""
        raise NotImplementedError

    def meshlet_ids(self, ids: np.ndarray) -> np.ndarray:
        """The ids of pixels, from those that the shaders write."""
        return ids

    @property
    def statistics(self) -> Any:
        """PoolStatistics of the last frame, if the drawing keeps meshlets or has levels; waits."""
        return self.levels.statistics if self.levels else None

    @property
    def tasks(self) -> Any:
        """Of the last frame, of a drawing with task shaders; waits."""
        return None

    @property
    def refused(self) -> list[MeshletError]:
        """What was wrong with malformed pages."""
        return self.levels.refused if self.levels else []

    @property
    def device(self) -> Device:
        return self.view.device

    @property
    def scene(self) -> Scene:
        return self.view.scene

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of all buffers, without images."""
        return sum(part.resident_bytes for part in self._parts)

    def free(self) -> None:
        """Frees the memory; a second call does nothing."""
        for part in self._parts:
            part.free()

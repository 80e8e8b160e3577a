"""Paths `vertex` and `geometry`: a draw for each run of instances.

`vertex` draws the decompressed model with its indices, on any device. In `geometry` a geometry
shader receives a point for each meshlet, decodes it and emits its triangles.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from ..decode.bounds import fill_bounds
from ..decode.structures import RASTER_PUSH
from ..gpu import vk
from ..gpu.device import Device
from ..gpu.pipelines import push_record
from ..gpu.targets import Targets
from ..scene.drawing import DEFAULT, Drawing, Options, Step
from ..scene.scene import Scene
from ..scene.view import BLOBS, SceneView
from .graphics import Graphics, raster_constants
from .pipeline import GEOMETRY, VERTEX


class VertexDrawing(Drawing):
    """Path `vertex`."""

    name = "vertex"
    targets: ClassVar[Any] = Targets

    def __init__(self, device: Device, scene: Scene, options: Options = DEFAULT):
        super().__init__(SceneView(device, scene, frozenset({"vertices", "indices"})))
        stages, constants = (("vertex.vert", VERTEX),), raster_constants(scene, culling=False)
        self._graphics = Graphics(self.view, stages, constants, options.ids)

    def frame(self, targets: Targets) -> list[Step]:
        return [Step("draw", lambda commands: self._draw(commands, targets))]

    def _draw(self, commands: Any, targets: Targets) -> None:
        buffers, data = self.view.buffers, push_record(RASTER_PUSH, frame=self.view.frame)
        with self._graphics.rendering(commands, targets):
            vk.vkCmdBindVertexBuffers(commands, 0, 1, [buffers.vertices.handle], [0])
            indices = buffers.index_buffer.handle
            vk.vkCmdBindIndexBuffer(commands, indices, 0, vk.VK_INDEX_TYPE_UINT32)
            for run, instance in self._graphics.runs(commands, data):
                first_index, first_vertex, count = buffers.index_range(instance.primitive)
                vk.vkCmdDrawIndexed(commands, count, run.count, first_index, first_vertex, 0)

    def meshlet_ids(self, ids: np.ndarray) -> np.ndarray:
        """The shaders number triangles through all meshlets of a primitive."""
        return self.scene.meshlet_ids(ids)


class GeometryDrawing(Drawing):
    """Path `geometry`."""

    name = capability = "geometry"
    targets: ClassVar[Any] = Targets

    def __init__(self, device: Device, scene: Scene, options: Options = DEFAULT):
        device.require(self.capability, self.name)
        super().__init__(SceneView(device, scene, BLOBS))
        fill_bounds(self.view)
        stages = (("geometry.vert", VERTEX), ("geometry_{attributes}.geom", GEOMETRY))
        constants = raster_constants(scene, options.culling)
        self._graphics = Graphics(
            self.view, stages, constants, options.ids, variants=("normal", "color")
        )

    def frame(self, targets: Targets) -> list[Step]:
        return [Step("draw", lambda commands: self._draw(commands, targets))]

    def _draw(self, commands: Any, targets: Targets) -> None:
        data = push_record(RASTER_PUSH, frame=self.view.frame)
        with self._graphics.rendering(commands, targets):
            for run, instance in self._graphics.runs(commands, data):
                meshlets = self.scene.primitives[instance.primitive].meshlets
                vk.vkCmdDraw(commands, meshlets, run.count, 0, 0)

"""Path `visibility` in batches: each frame decodes all meshlets that may be visible."""

from __future__ import annotations

from typing import Any, ClassVar

from ..decode.batches import (
    BULK_MESHLETS,
    Batch,
    BatchTable,
    bulk_fits,
    schedule,
    schedule_whole,
    slots_of,
)
from ..decode.bounds import fill_bounds
from ..decode.decoder import BULK, TEAM, Decoder
from ..decode.slots import SlotLayout
from ..decode.structures import RASTER_PUSH
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.pipelines import push_record
from ..raster.graphics import raster_constants, require_team
from ..scene.drawing import DEFAULT, Drawing, Options, Step
from ..scene.scene import Scene
from ..scene.view import BLOBS, SceneView
from .rasterizer import Planes, Rasterizer

# Unless the scene has fewer meshlets. On an H200, half as many take 1.28 times as long for
# bistro_like (23,882 meshlets) and 1.19 times for dragon_x4 (56,899), with 24 instead of 39 and
# 42 MB in all; one slot for each meshlet of dragon_x4 saves 6 %, with 71 MB.
SLOTS = 1 << 15


class BatchedDrawing(Drawing):
    """Path `visibility` without a cache: the meshlets of instances are decoded one by one."""

    name, capability = "visibility", "atomics64"
    targets: ClassVar[Any] = Planes

    def __init__(self, device: Device, scene: Scene, options: Options = DEFAULT):
        device.require(self.capability, self.name)
        require_team(device, scene, self.name, device.limits.compute_shared_bytes)
        super().__init__(SceneView(device, scene, BLOBS))
        fill_bounds(self.view)
        slots = min(SLOTS, CONSTANTS["MAX_SLOTS"])
        meshlets = scene.instance_meshlets
        layout = SlotLayout.of(scene)
        is_bulk = meshlets.sum() >= BULK_MESHLETS and bulk_fits(scene, layout, slots)
        batches = (schedule_whole if is_bulk else schedule)(meshlets, slots)
        method, constants = BULK if is_bulk else TEAM, raster_constants(scene, options.culling)
        self.slots = slots_of(batches)
        self.decoder = self.own(Decoder(device, layout, self.slots, constants, method))
        self.batches = self.own(BatchTable(device, batches)).batches
        self._rasterizer = self.own(Rasterizer(self.view, self.slots, self.decoder.constants))

    def frame(self, targets: Planes) -> list[Step]:
        own = {**self.decoder.addresses, **self._rasterizer.addresses, **targets.addresses}
        pushed = push_record(RASTER_PUSH, frame=self.view.frame, **own)
        steps = [Step("clear", lambda commands: self._rasterizer.clear(commands, targets, pushed))]
        for batch in self.batches:
            steps += self._steps_of(batch, targets, pushed.copy())
        return steps

    def _steps_of(self, batch: Batch, targets: Planes, pushed: Any) -> list[Step]:
        if batch is self.batches[0]:
            pushed["batch"] |= CONSTANTS["BATCH_FIRST"]
        if batch is self.batches[-1]:
            pushed["batch"] |= CONSTANTS["BATCH_LAST"]
        raster = self._rasterizer

        def decode(commands: Any) -> None:
            self.decoder.decode(commands, batch, pushed)
            # `small` reads the slots, and the pixels that `clear` has emptied.
            self.device.compute_barrier(commands)

        return [
            Step("decode", decode),
            Step("small", lambda commands: raster.small(commands, batch, pushed)),
            Step("pieces", lambda commands: raster.pieces(commands, batch, pushed)),
            Step("resolve", lambda c: raster.resolve(c, targets, batch.pushed(pushed))),
        ]

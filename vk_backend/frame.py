"""The commands of a picture, recorded once and run as often as wanted."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import vulkan as vk

from .device import Queue, Submission
from .pipelines import Timestamps
from .raster import Drawing, Targets
from .stream import COMPUTE_STAGE, MESH_STAGE

ALL_STAGES = vk.VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT


class Frame:
    """A drawing's picture, timed on the GPU.

    Where decoding overlaps drawing, each batch of path stream has commands for both queues: one half of the ring is filled on the compute
    queue while the mesh shader reads the other half on the graphics queue. stamps: two places, for one frame at a time.
    """

    def __init__(self, drawing: Drawing, targets: Targets, stamps: Timestamps):
        self._drawing, self._device, self._stamps = drawing, drawing.device, stamps
        self._commands: list[tuple[Queue, Any]] = []  # in turns: the start, and for each batch its decoding and its drawing
        graphics, compute = self._device.graphics, self._device.compute
        if not drawing.overlaps:
            with self._recorded(graphics) as commands:
                self._start(commands)
                drawing.record(commands, targets)
                self._stop(commands)
            return
        with self._recorded(graphics) as commands:
            self._start(commands)
        batches = drawing.batches()
        for number, batch in enumerate(batches):
            with self._recorded(compute) as commands:
                drawing.record_decoding(commands, batch)
            with self._recorded(graphics) as commands:
                drawing.record_drawing(commands, targets, batch, resumed=number > 0)
                if number == len(batches) - 1:
                    self._stop(commands)

    def run(self) -> float:
        """Draws the picture; milliseconds on the GPU, from before the first to after the last of all commands."""
        self._device.submit_all(self._overlapped() if self._drawing.overlaps else [Submission(*self._commands[0])])
        return float(self._stamps.milliseconds()[0])

    def free(self) -> None:
        for queue, commands in self._commands:
            vk.vkFreeCommandBuffers(self._device.handle, queue.pool, 1, [commands])

    @contextmanager
    def _recorded(self, queue: Queue) -> Iterator[Any]:
        """A command buffer that is recorded in the block."""
        commands = self._device.record(queue)
        yield commands
        vk.vkEndCommandBuffer(commands)
        self._commands.append((queue, commands))

    # Both times are the graphics queue's, since those of two queues may not be compared: all decoding waits for the first, and the last
    # drawing, before the second, waits for all decoding.

    def _start(self, commands) -> None:
        self._stamps.reset(commands)
        self._stamps.mark(commands, 0)

    def _stop(self, commands) -> None:
        self._stamps.mark(commands, 1)

    def _overlapped(self) -> list[Submission]:
        """A batch is drawn when it is decoded, and decoded when its slots are free: when the frame has begun, and the batch that was in
        the slots before is drawn."""
        ring, batches = self._drawing.ring, len(self._commands) // 2
        decoded, drawn = ring.decoded, ring.drawn
        before, begun = decoded.value, drawn.value + 1       # batch i has then been decoded and drawn at before + 1 + i, begun + 1 + i
        submissions = [Submission(*self._commands[0], signal=(drawn, begun, ALL_STAGES))]
        for number in range(batches + 1):                    # decoding goes first, so that one queue can do it all, too
            if number < batches:
                free = begun + max(number - ring.parts + 1, 0)
                wait, signal = (drawn, free, COMPUTE_STAGE), (decoded, before + 1 + number, COMPUTE_STAGE)
                submissions.append(Submission(*self._commands[1 + 2 * number], wait, signal))
            if number > 0:
                wait, signal = (decoded, before + number, MESH_STAGE), (drawn, begun + number, MESH_STAGE)
                submissions.append(Submission(*self._commands[2 * number], wait, signal))
        decoded.value, drawn.value = before + batches, begun + batches
        return submissions

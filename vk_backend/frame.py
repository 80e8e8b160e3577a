"""The commands of a picture, recorded once and run as often as wanted."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import vulkan as vk

from .device import Queue, Submission
from .pipelines import Timestamps
from .raster import Drawing, Targets
from .stream import COMPUTE_STAGE, MESH_STAGE, Ring

ALL_STAGES = vk.VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT


class Frame:
    """A drawing's picture, timed on the GPU.

    Where decoding overlaps drawing, each batch of path stream has commands for both queues: one half of the ring is filled on the compute
    queue while the mesh shader reads the other half on the graphics queue. stamps: two places, for one frame at a time.
    """

    def __init__(self, drawing: Drawing, targets: Targets, stamps: Timestamps):
        self._device, self._stamps = drawing.device, stamps
        self._ring = drawing.ring if drawing.overlaps else None
        self._commands: list[
            tuple[Queue, Any]
        ] = []  # in turns: the start, and for each batch its decoding and its drawing
        graphics, compute = self._device.graphics, self._device.compute
        if not self._ring:
            with self._recorded(graphics) as commands:
                self._start(commands)
                drawing.record(commands, targets)
                self._stop(commands)
            return
        with self._recorded(graphics) as commands:
            self._start(commands)
        batches = len(self._ring.batches)
        for number in range(batches):
            with self._recorded(compute) as commands:
                drawing.record_decoding(commands, number)
            with self._recorded(graphics) as commands:
                drawing.record_drawing(commands, targets, number)
                if number == batches - 1:
                    self._stop(commands)

    def run(self) -> float:
        """Draws the picture; milliseconds on the GPU, from before the first to after the last of all commands."""
        if self._ring:
            self._device.submit_all(overlapped(self._commands, self._ring))
        else:
            self._device.submit(self._commands[0][1])
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


def overlapped(commands: list[tuple[Queue, Any]], ring: Ring) -> list[Submission]:
    """When commands for two queues run: a batch is drawn once it is decoded, and decoded once its slots are free, that is, once the
    frame has begun, and the batch that was in the slots before is drawn.

    commands: the start's, and then in turns the decoding's and the drawing's of each batch. The ring's timelines advance.
    """
    batches, decoded, drawn = len(commands) // 2, ring.decoded, ring.drawn
    before, begun = decoded.value, drawn.value + 1
    # Batch i is decoded at before + 1 + i, and drawn at begun + 1 + i.
    submissions = [Submission(*commands[0], signal=(drawn, begun, ALL_STAGES))]
    for number in range(batches + 1):  # decoding goes ahead, so that one queue can do it all, too
        if number < batches:
            free = begun + max(number - ring.parts + 1, 0)
            wait, signal = (
                (drawn, free, COMPUTE_STAGE),
                (decoded, before + 1 + number, COMPUTE_STAGE),
            )
            submissions.append(Submission(*commands[1 + 2 * number], wait, signal))
        if number > 0:
            wait, signal = (
                (decoded, before + number, MESH_STAGE),
                (drawn, begun + number, MESH_STAGE),
            )
            submissions.append(Submission(*commands[2 * number], wait, signal))
    decoded.value, drawn.value = before + batches, begun + batches
    return submissions

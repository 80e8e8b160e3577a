"""The commands of a picture: recorded once, run and timed any number of times."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .gpu import vk
from .gpu.device import Queue, Submission
from .gpu.pipelines import Timestamps
from .raster.stream import COMPUTE_STAGE, MESH_STAGE, Overlap
from .scene.drawing import Drawing, Step

ALL_STAGES = vk.VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT


class FrameCommands:
    """The commands of one picture of a drawing.

    If decoding overlaps drawing, each batch of path stream has commands for both queues: the
    compute queue fills one half of the ring while the graphics queue draws the other half.
    targets: of the class drawing.targets. steps: time the steps of the picture one by one. Each
    timestamp takes about a microsecond.
    """

    def __init__(self, drawing: Drawing, targets: Any, *, steps: bool = False):
        self._device, self._overlap = drawing.device, drawing.overlap
        frame = drawing.frame(targets)
        is_timed = steps and not self._overlap
        self._steps = [step.name for step in frame] if is_timed else ["frame"]
        self._stamps = Timestamps(drawing.device, 1 + len(self._steps))
        self._marks = 0  # recorded so far
        # With two queues: the start, then the decoding and the drawing of each batch in turn.
        self._commands: list[tuple[Queue, Any]] = []
        if self._overlap:
            self._record_overlapped(frame)
            return
        with self._recorded(self._device.graphics) as commands:
            self._start(commands)
            for step in frame:
                step.record(commands)
                if is_timed:
                    self._mark(commands)
            if not is_timed:
                self._mark(commands)

    def run(self) -> float:
        """Draws the picture; milliseconds on the GPU, from the first to the last command."""
        return sum(self.run_steps().values())

    def run_steps(self) -> dict[str, float]:
        """Draws the picture; step -> milliseconds on the GPU, of all batches together."""
        if self._overlap:
            self._device.submit_all(overlapped(self._commands, self._overlap))
        else:
            self._device.submit(self._commands[0][1])
        times = dict.fromkeys(self._steps, 0.0)
        for step, milliseconds in zip(self._steps, self._stamps.milliseconds()):
            times[step] += float(milliseconds)
        return times

    def free(self) -> None:
        """Frees the command buffers and the timestamps."""
        self._stamps.free()
        for queue, commands in self._commands:
            vk.vkFreeCommandBuffers(self._device.handle, queue.pool, 1, [commands])

    def _record_overlapped(self, frame: list[Step]) -> None:
        with self._recorded(self._device.graphics) as commands:
            self._start(commands)
        for number, step in enumerate(frame):
            queue = self._device.graphics if number % 2 else self._device.compute
            with self._recorded(queue) as commands:
                step.record(commands)
                if number == len(frame) - 1:
                    self._mark(commands)

    @contextmanager
    def _recorded(self, queue: Queue) -> Iterator[Any]:
        """A command buffer that the block records."""
        commands = self._device.record(queue)
        yield commands
        vk.vkEndCommandBuffer(commands)
        self._commands.append((queue, commands))

    # Timestamps of different queues cannot be compared, so both are written on the graphics queue.
    # All decoding waits for the first; the last drawing, before the second, waits for all decoding.

    def _start(self, commands: Any) -> None:
        self._stamps.reset(commands)
        self._mark(commands)

    def _mark(self, commands: Any) -> None:
        self._stamps.mark(commands, self._marks)
        self._marks += 1


def overlapped(commands: list[tuple[Queue, Any]], overlap: Overlap) -> list[Submission]:
    """Submissions to two queues that wait for each other.

    A batch is drawn when it is decoded. It is decoded when the frame has begun and the batch that
    held its slots before is drawn. commands: the start, then the decoding and the drawing of each
    batch in turn. Advances the timelines.
    """
    decoded, drawn = overlap.decoded, overlap.drawn
    batches = len(commands) // 2
    before, begun = decoded.value, drawn.value + 1
    # The end of decoding batch i is value before + 1 + i, the end of drawing it begun + 1 + i.
    submissions = [Submission(*commands[0], signal=(drawn, begun, ALL_STAGES))]
    # Decoding is submitted one batch ahead; if there is a single queue, the order works as well.
    for number in range(batches + 1):
        if number < batches:
            free = begun + max(number - overlap.sections + 1, 0)
            wait = (drawn, free, COMPUTE_STAGE)
            signal = (decoded, before + 1 + number, COMPUTE_STAGE)
            submissions.append(Submission(*commands[1 + 2 * number], wait, signal))
        if number > 0:
            wait = (decoded, before + number, MESH_STAGE)
            signal = (drawn, begun + number, MESH_STAGE)
            submissions.append(Submission(*commands[2 * number], wait, signal))
    decoded.value, drawn.value = before + batches, begun + batches
    return submissions

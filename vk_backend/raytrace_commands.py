"""The commands of a ray-traced frame, in submissions that each take a fraction of a second.

A driver ends a submission that runs for seconds, because it takes it for a hang; the device is lost
then.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from . import vk
from .device import Device

Area = tuple[int, int, int, int]  # of a picture: left, top, width, height

# Of a submission, at most, unless a single launch has more: levels of paths, see
# shaders/raytrace/rt_paths.glsl. At 10 million a second, which is slow, they take 0.4 seconds. A
# frame of 1920 x 1080 pixels with shadows is one submission.
MOST_LEVELS = 1 << 22
MESHLET_LEVELS = 64  # decoding a meshlet takes no longer than so many levels


class FrameSubmissions:
    """The command buffers of a frame, for the graphics queue.

    begin: records what each of them needs first. commands: the one that is being recorded.
    """

    def __init__(self, device: Device, begin: Callable[[Any], None]):
        self._device, self._begin = device, begin
        self._ended: list[Any] = []
        self._open()

    def _open(self) -> None:
        self.commands = self._device.record()
        self._levels = 0
        self._begin(self.commands)

    def _end(self) -> None:
        vk.vkEndCommandBuffer(self.commands)
        self._ended.append(self.commands)

    def room_for(self, levels: int) -> Any:
        """The command buffer for commands that take as long as so many levels of paths."""
        if self._levels and self._levels + levels > MOST_LEVELS:
            self._end()
            self._open()
        self._levels += levels
        return self.commands

    def run(self) -> None:
        """Runs and frees the command buffers; waits. Raises VulkanError if the device is lost."""
        self._end()
        self._device.submit_apart(self._ended)
        pool = self._device.graphics.pool
        vk.vkFreeCommandBuffers(self._device.handle, pool, len(self._ended), self._ended)


def tiles(width: int, height: int, levels: int) -> list[Area]:
    """Cuts a picture so that each area has at most MOST_LEVELS. levels: of a pixel."""
    pixels = max(MOST_LEVELS // levels, 1)
    columns, rows = min(pixels, width), max(pixels // width, 1)
    return [
        (left, top, min(columns, width - left), min(rows, height - top))
        for top in range(0, height, rows)
        for left in range(0, width, columns)
    ]

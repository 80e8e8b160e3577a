"""The commands of a ray-traced frame, in submissions that each take a fraction of a second.

A driver ends a submission that runs for seconds, because it takes it for a hang; the device is lost
then.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..gpu import vk
from ..gpu.device import Device

Area = tuple[int, int, int, int]  # of a picture: left, top, width, height

# Levels of paths (shaders/raytrace/rt_paths.glsl) of a submission, at most, unless a single launch
# has more. An H200 takes 9 ms for so many, a device with a hundredth of its speed 0.9 s. Smaller
# submissions cost time: 22 million levels (bunny, 1280 x 720, 8 samples, 2 bounces) took 5.9 ms in
# one, 7.3 in parts of 2^24, 15.0 of 2^22, 40 of 2^20.
MOST_LEVELS = 1 << 25
# Decoding a meshlet takes about as long as so many levels: 50 ns, and a level 0.25 ns, where
# dragon_x4 is traced on an H100 with a cache of 10 %.
MESHLET_LEVELS = 256


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

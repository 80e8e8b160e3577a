"""Where a camera will be: pages are asked for along its way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..scene.camera import Camera

# How far ahead: so many seconds, in which pages are chosen, read and uploaded, but no more than so
# many frames, because a way that is drawn faster than shown bends. On an H200, the shares of 300
# frames at 60 Hz that show one pixel of error (bench vulkan_lod --rate 60; 14 M, 167 M and 1 G
# triangles; one page read at a time): 90, 92 and 83 % without, 99.7, 97 and 92 % with 0.05 seconds,
# 100, 99 and 91 % with 0.1; 98, 100 and 93 % with 0.2 and 16 frames. With 0.1 and four pages at a
# time all frames do.
LEAD_SECONDS, LEAD_FRAMES = 0.1, 8.0


class Motion:
    """The last camera, and the moment at which it was seen."""

    def __init__(self) -> None:
        self._last: tuple[Camera, float] | None = None

    def see(self, camera: Camera, moment: float) -> Camera | None:
        """Returns where the camera will be if it goes on so; None if it stands still.

        moment: seconds, of any clock.
        """
        before, self._last = self._last, (camera, moment)
        if before is None or moment <= before[1]:
            return None
        steps = min(LEAD_SECONDS / (moment - before[1]), LEAD_FRAMES)
        return moved_on(before[0], camera, steps)


def moved_on(before: Camera, now: Camera, steps: float) -> Camera | None:
    """`now`, moved and turned on by so many times its way from `before`; None if they are alike."""
    if np.array_equal(before.to_world, now.to_world):
        return None
    to_world = now.to_world.copy()
    with np.errstate(all="ignore"):  # the matrices of a user may be anything
        to_world[:3, 3] += steps * (now.to_world[:3, 3] - before.to_world[:3, 3])
        turn = now.to_world[:3, :3] @ np.linalg.pinv(before.to_world[:3, :3])
        to_world[:3, :3] = _turned(turn, steps) @ now.to_world[:3, :3]
    return replace(now, to_world=to_world) if np.isfinite(to_world).all() else None


def _turned(turn: np.ndarray, steps: float) -> np.ndarray:
    """float64[3, 3]: `steps` times the rotation `turn`, at most a quarter turn (Rodrigues)."""
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    double_sine = np.linalg.norm(axis)
    if not double_sine > 1e-12:
        return np.eye(3)
    x, y, z = axis / double_sine
    angle = np.arctan2(double_sine, np.trace(turn) - 1)
    angle = min(steps * angle, np.pi / 2)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    result: np.ndarray = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return result

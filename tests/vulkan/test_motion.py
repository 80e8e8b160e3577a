"""Where a camera will be, if it goes on as it does."""

from __future__ import annotations

import numpy as np
import pytest


def camera(eye, turn=0.0):
    from vk_backend.scene.camera import Camera

    cosine, sine = np.cos(turn), np.sin(turn)
    to_world = np.array(
        [[cosine, 0, sine, eye[0]], [0, 1, 0, eye[1]], [-sine, 0, cosine, eye[2]], [0, 0, 0, 1]]
    )
    return Camera(to_world, 0.8, None, 0.1, 100.0)


@pytest.fixture(autouse=True)
def vulkan():
    pytest.importorskip("vulkan", exc_type=Exception)


@pytest.mark.parametrize("seconds", [0.1, 0.025, 0.0125, 0.001])
def test_it_goes_and_turns_on(seconds):
    from vk_backend.levels.motion import LEAD_FRAMES, LEAD_SECONDS, Motion

    motion = Motion()
    assert motion.see(camera((0, 0, 0), 1.0), 5.0) is None
    later = motion.see(camera((0.1, 0, -0.2), 1.05), 5.0 + seconds)
    steps = min(LEAD_SECONDS / seconds, LEAD_FRAMES)
    expected = camera((0.1 * (1 + steps), 0, -0.2 * (1 + steps)), 1.05 + 0.05 * steps)
    np.testing.assert_allclose(later.to_world, expected.to_world, atol=1e-6)
    assert later.near == 0.1 and later.yfov == 0.8


def test_a_turn_about_any_axis():
    from vk_backend.levels.motion import moved_on

    random = np.random.default_rng(3)
    for _ in range(20):
        axis, angle = random.normal(size=3), random.uniform(-0.4, 0.4)
        x, y, z = axis / np.linalg.norm(axis)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        step = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
        now, before = camera((0, 0, 0), 0.7), camera((0, 0, 0), 0.7)
        now.to_world[:3, :3] = step @ before.to_world[:3, :3]
        later = moved_on(before, now, 3.0).to_world[:3, :3]
        np.testing.assert_allclose(later, step @ step @ step @ now.to_world[:3, :3], atol=1e-9)


def test_who_stands_still_goes_nowhere():
    from vk_backend.levels.motion import Motion

    motion = Motion()
    motion.see(camera((1, 2, 3)), 0.0)
    assert motion.see(camera((1, 2, 3)), 1.0) is None
    assert motion.see(camera((1, 2, 4)), 1.0) is None  # no time has passed


def test_matrices_may_be_anything():
    from vk_backend.levels.motion import moved_on

    flat, far = camera((0, 0, 0)), camera((1e308, 0, 0))
    flat.to_world[:3, :3] = 0
    assert moved_on(camera((-1e308, 0, 0)), far, 8.0) is None
    assert moved_on(flat, camera((1, 0, 0)), 8.0) is not None
    half = moved_on(camera((0, 0, 0), 0.0), camera((0, 0, 0), 3.0), 8.0)
    assert np.isfinite(half.to_world).all()

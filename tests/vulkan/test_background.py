"""The sky behind a picture."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest


def picture(width: int, height: int) -> np.ndarray:
    """A picture with a surface in the middle."""
    color = np.zeros((height, width, 4), np.uint8)
    color[height // 4 : height // 2, width // 4 : width // 2] = (200, 100, 50, 255)
    return color


def camera():
    from vk_backend.scene.camera import Camera

    return Camera.look_at((3, 2, 1), (0, 0, 0), near=0.1, far=10.0, yfov=1.0)


@pytest.fixture(autouse=True)
def needs_vulkan():
    pytest.importorskip("vulkan", exc_type=Exception)


def test_bands_are_parts_of_the_same_sky(monkeypatch):
    from vk_backend.scene import background

    color = picture(70, 50)
    whole = background.before_sky(color, camera())
    monkeypatch.setattr(background, "BAND_PIXELS", 210)  # three rows
    assert (background.before_sky(color, camera()) == whole).all()
    seen = color[..., 3] > 0
    assert (whole[seen] == color[seen]).all() and (whole[..., 3] == 255).all()
    assert len(np.unique(whole[~seen], axis=0)) > 5, "the sky changes with height"


def test_memory_does_not_grow_with_the_picture(monkeypatch):
    """Besides the result. All rows at once took 100 bytes a pixel."""
    from vk_backend.scene import background

    monkeypatch.setattr(background, "BAND_PIXELS", 1 << 14)
    color = picture(1024, 1024)
    tracemalloc.start()
    background.before_sky(color, camera())
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < color.nbytes + 200 * (1 << 14)

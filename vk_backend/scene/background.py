"""The default sky behind a picture, as Mitsuba's pictures show it."""

from __future__ import annotations

import numpy as np

from gltf_scene.default_light import sky_radiance

from .camera import Camera

BAND_PIXELS = 1 << 20  # at a time: directions and radiance take some 100 bytes a pixel


def before_sky(color: np.ndarray, camera: Camera) -> np.ndarray:
    """uint8[height, width, 4]: the picture, opaque, with the sky wherever alpha is 0.

    color: uint8[height, width, 4], sRGB.
    """
    height, width = color.shape[:2]
    result: np.ndarray = color.copy()
    rows = max(BAND_PIXELS // width, 1)
    for top in range(0, height, rows):
        band = result[top : top + rows]
        is_sky = band[..., 3] == 0
        directions = _directions(camera, width, height, top, top + len(band))
        band[is_sky, :3] = _srgb(sky_radiance(directions[is_sky]))
        band[is_sky, 3] = 255
    return result


def _directions(camera: Camera, width: int, height: int, top: int, bottom: int) -> np.ndarray:
    """float64[bottom - top, width, 3]: unit vectors from the viewer through the pixels' centres.

    top, bottom: rows of the picture.
    """
    if camera.yfov is None:
        return np.broadcast_to(-camera.to_world[:3, 2], (bottom - top, width, 3))
    y, x = np.mgrid[top:bottom, :width] + 0.5
    up = np.tan(camera.yfov / 2)
    right = up * width / height
    local = np.stack(
        [(2 * x / width - 1) * right, (1 - 2 * y / height) * up, np.full_like(x, -1.0)], axis=-1
    )
    local /= np.linalg.norm(local, axis=-1, keepdims=True)
    return np.asarray(local @ camera.to_world[:3, :3].T)


def _srgb(linear: np.ndarray) -> np.ndarray:
    """uint8 of linear colours in [0, 1]."""
    linear = np.clip(linear, 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(255 * encoded), np.uint8)

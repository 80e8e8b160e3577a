"""Images of materials, joined from channels of others. Takes and returns encoded images.

Raises MeshletError for one that cannot be read.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from gltf_ext.errors import MeshletError

if TYPE_CHECKING:
    from PIL.Image import Image

CHANNELS = {b"r": "R", b"g": "G", b"b": "B", b"m": "A"}  # names in .mtl -> Pillow's bands

Channel = tuple[bytes, bytes]  # an image and the channel's name in .mtl, which may be empty


def is_gray(image: bytes) -> bool:
    """Return whether an image has one channel, and maybe an alpha."""
    from PIL import Image

    with Image.open(io.BytesIO(image)) as pixels:
        return pixels.mode in ("1", "L", "LA", "I", "I;16", "F")


def with_alpha(color: bytes | None, alpha: bytes, channel: bytes) -> bytes:
    """Return the colours, or white, with an alpha from another image."""
    from PIL import Image

    opacity = _band(alpha, channel, "A")
    pixels = _open(color).convert("RGB") if color else Image.new("RGB", opacity.size, "white")
    pixels.putalpha(opacity.resize(pixels.size))
    return _png(pixels)


def metal_rough(roughness: Channel | float, metalness: Channel | float) -> bytes:
    """Return an image of glTF: green is roughness, blue is metalness. Numbers are from 0 to 1."""
    from PIL import Image

    values = [v if isinstance(v, float) else _band(*v, "") for v in (roughness, metalness)]
    sizes = [v.size for v in values if not isinstance(v, float)]
    size = max(sizes, key=lambda s: s[0] * s[1])
    bands = [
        Image.new("L", size, round(255 * v)) if isinstance(v, float) else v.resize(size)
        for v in values
    ]
    return _png(Image.merge("RGB", [Image.new("L", size, 255), *bands]))


def _band(image: bytes, channel: bytes, default: str) -> Image:
    """Return one channel as grey: the one that is named, else the default, else the luminance."""
    pixels = _open(image)
    if pixels.mode == "P" or "transparency" in pixels.info:
        pixels = pixels.convert("RGBA" if "transparency" in pixels.info else "RGB")
    band = CHANNELS.get(channel) or ("" if channel else default)
    if band in pixels.getbands():
        return pixels.getchannel(band)
    if pixels.mode.startswith("I;16"):  # convert would clip the 16 bits instead of rounding them
        return pixels.point(lambda value: value / 257 + 0.5, "L")
    return pixels.convert("L")


def _open(image: bytes) -> Image:
    from PIL import Image

    try:
        pixels = Image.open(io.BytesIO(image))
        pixels.load()
    except Exception:  # Pillow's readers raise anything
        raise MeshletError("it cannot be read") from None
    return pixels


def _png(image: Image) -> bytes:
    data = io.BytesIO()
    image.save(data, "PNG")
    return data.getvalue()

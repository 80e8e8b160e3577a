"""numpy dtypes of the structures that the host shares with the ray-tracing shaders.

Buffer addresses are 64-bit words here and uvec2 in the shaders. tests/vulkan/test_layouts.py
compares the dtypes with the shaders, by names and offsets.
"""

from __future__ import annotations

import numpy as np


def _words(size: int, names: str) -> list[tuple[str, str]]:
    """Fields of `size` bytes each."""
    return [(name, f"<u{size}") for name in names.split()]


# shaders/raytrace/rt_common.glsl
PLACED = np.dtype(_words(4, "instance primitive first key"))
SOURCE = np.dtype(_words(4, "primitive meshlet"))
RAYS_PUSH = np.dtype(
    _words(8, "frame structure placed sources cache colors hits records")
    + _words(4, "bounces samples shadows width pixel part level first")
)
# shaders/raytrace/boxes.comp
BOXES_PUSH = np.dtype(_words(8, "frame sources boxes") + _words(4, "meshlets"))
# shaders/raytrace/rt_fill.comp
FILL_PUSH = np.dtype(_words(8, "frame sources cache") + _words(4, "first count"))

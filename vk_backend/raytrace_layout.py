"""numpy dtypes of the structures that the host shares with the ray-tracing shaders.

Buffer addresses are 64-bit words here and uvec2 in the shaders. tests/vulkan/test_layouts.py
compares the dtypes with the shaders, by names and offsets.
"""

from __future__ import annotations

import numpy as np

from .constants import CONSTANTS


def _words(size: int, names: str) -> list[tuple[str, str]]:
    """Fields of `size` bytes each."""
    return [(name, f"<u{size}") for name in names.split()]


# shaders/raytrace/rt_common.glsl
PLACED = np.dtype(_words(4, "instance primitive first key"))
SOURCE = np.dtype(_words(4, "primitive meshlet"))
RAYS_PUSH = np.dtype(
    _words(
        8,
        "frame structure placed sources slot_table cache counters first_triangles colors hits "
        "state",
    )
    + _words(4, "bounces samples shadows kind pass turn step next_turn")
)
# shaders/raytrace/boxes.comp
BOXES_PUSH = np.dtype(
    _words(8, "frame sources first_triangles boxes bounds") + _words(4, "meshlets")
)
# shaders/raytrace/rt_cache.glsl
CACHE_PUSH = np.dtype(
    _words(8, "frame sources slot_table cache counters state")
    + _words(4, "kind pass turn step meshlets")
)
PASS = np.dtype(
    [("launch", "<u4", 3), *_words(4, "waiting requested begin backward resident")]
)
# CacheState without its last member, the passes, which follow it.
CACHE_STATE = np.dtype(
    [
        *_words(8, "bounds structures victims missing found levels"),
        *_words(4, "slots meshlets parts room frame free backward resident retry"),
        *_words(4, "idle recent lacking finished"),
        ("records", "<u4", CONSTANTS["TURNS"]),
    ]
)

"""numpy dtypes of the structures that the host shares with the ray-tracing shaders.

Buffer addresses are 64-bit words here and uvec2 in the shaders. tests/vulkan/test_layouts.py
compares the dtypes with the shaders, by names and offsets.
"""

from __future__ import annotations

import numpy as np

from .constants import CONSTANTS

LISTS = CONSTANTS["LISTS"]

# shaders/raytrace/rt_common.glsl
TRACED = np.dtype(
    [
        ("blob", "<u4", 2),
        ("blob_words", "<u4"),
        ("first_meshlet", "<u4"),
        ("indices", "<u4", 2),
        ("vertices", "<u4", 2),
    ]
)
RAYS_PUSH = np.dtype(
    [
        ("frame", "<u8"),
        ("structure", "<u8"),
        ("traced", "<u8"),
        ("slot_table", "<u8"),
        ("cache", "<u8"),
        ("counters", "<u8"),
        ("first_triangles", "<u8"),
        ("colors", "<u8"),
        ("hits", "<u8"),
        ("bounces", "<u4"),
        ("samples", "<u4"),
        ("first_row", "<u4"),
        ("shadows", "<u4"),
        ("round", "<u4"),
        ("record", "<u4"),
        ("state", "<u8"),
        ("requests", "<u8"),
        ("waiting", "<u8"),
        ("strip_rows", "<u4"),
    ]
)
# shaders/raytrace/boxes.comp
BOXES_PUSH = np.dtype(
    [
        ("frame", "<u8"),
        ("traced", "<u8"),
        ("first_triangles", "<u8"),
        ("boxes", "<u8"),
        ("primitive", "<u4"),
        ("meshlets", "<u4"),
        ("bounds", "<u8"),
        ("owners", "<u8"),
    ]
)
# shaders/raytrace/rt_cache.glsl
CACHE_PUSH = np.dtype(
    [
        ("frame", "<u8"),
        ("traced", "<u8"),
        ("slot_table", "<u8"),
        ("cache", "<u8"),
        ("counters", "<u8"),
        ("state", "<u8"),
        ("lists", "<u8"),
        ("slot_meshlets", "<u8"),
        ("round", "<u4"),
    ]
)
ROUND = np.dtype(
    [
        ("fill_groups", "<u4", 3),
        ("requested", "<u4"),
        ("launch", "<u4", 3),
        ("restarted", "<u4"),
        ("waiting", "<u4"),
        ("filled", "<u4"),
    ]
)
# CacheState without its last member, the rounds, which follow it.
CACHE_STATE = np.dtype(
    [
        ("bounds", "<u8"),
        ("paths", "<u8"),
        ("owners", "<u8"),
        ("stamps", "<u8"),
        ("seen", "<u8"),
        ("ahead", "<u8"),
        ("stable", "<u4"),
        ("rotating", "<u4"),
        ("meshlets", "<u4"),
        ("primitives", "<u4"),
        ("waits", "<u4"),
        ("path_limit", "<u4"),
        ("coming_round", "<u4"),
        ("frame", "<u4"),
        ("kept", "<u4"),
        ("ring", "<u4"),
        ("cursor", "<u4"),
        ("finished", "<u4"),
        ("listed", "<u4", (2, LISTS)),
    ]
)

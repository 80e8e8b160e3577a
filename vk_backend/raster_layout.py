"""numpy dtypes of the structures that the host shares with the raster and decoding shaders.

Buffer addresses are 64-bit words here and uvec2 in the shaders.
tests/vulkan/test_layouts.py compares them with the shaders, by names and offsets.
"""

from __future__ import annotations

import numpy as np

# Push constants of all raster paths: shaders/raster/raster.glsl.
RASTER_PUSH = np.dtype(
    [
        ("frame", "<u8"),
        ("instance", "<u4"),
        ("first", "<u4"),
        ("meshlets", "<u4"),
        ("first_slot", "<u4"),
        ("slots", "<u8"),
        ("summaries", "<u8"),
        ("connectivity", "<u8"),
        ("segments", "<u8"),
        ("segment_count", "<u4"),
    ]
)
# shaders/raster/bounds.comp.
BOUNDS_PUSH = np.dtype([("primitives", "<u8"), ("primitive", "<u4")])
# shaders/raster/stream_push.glsl
SEGMENT = np.dtype([("instance", "<u4"), ("first", "<u4"), ("meshlets", "<u4"), ("slot", "<u4")])
# shaders/decoders/decode_buffers.glsl
CONNECTED = np.dtype(
    [
        ("boundary", "<u8"),
        ("starts", "<u8"),
        ("closing", "<u8"),
        ("ends", "<u8"),
        ("splits", "<u8"),
        ("references", "<u8"),
    ]
)
PLACES = np.dtype(
    [
        ("foreign_refs", "<u8"),
        ("private_refs", "<u8"),
        ("loop_ends", "<u8"),
        ("counts", "<u4"),
        ("lengths", "<u4"),
        ("entries", "<u4"),
        ("codes", "<u4"),
        ("anchors", "<u4"),
        ("chains", "<u4"),
        ("quotients", "<u4"),
        ("interior", "<u4"),
        ("waiting", "<u8"),
    ]
)
# shaders/decoders/decode_push.glsl
DECODE_PUSH = np.dtype(
    [
        ("blob", "<u8"),
        ("summaries", "<u8"),
        ("connectivity", "<u8"),
        ("places", "<u8"),
        ("triangles", "<u8"),
        ("values", "<u8"),
        ("blob_words", "<u4"),
        ("meshlets", "<u4"),
        ("streams", "<u4"),
        ("value_words", "<u4"),
    ]
)

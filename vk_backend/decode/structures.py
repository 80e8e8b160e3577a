"""Structures that the host shares with the raster and decoding shaders."""

from __future__ import annotations

from ..gpu.reflection import structure

RASTER_PUSH = structure("RasterPush")  # push constants of all raster paths
FILL_PUSH = structure("FillPush")  # of rt_fill.comp
BOUNDS_PUSH = structure("BoundsPush")  # of bounds.comp
SEGMENT = structure("Segment")  # of shaders/decoders/slot_jobs.glsl
# Of shaders/decoders/decode_buffers.glsl.
CONNECTED = structure("Connected")
PLACES = structure("Places")

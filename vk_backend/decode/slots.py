"""The layout of slots: one decoded meshlet each (shaders/decoders/slots.glsl).

The ray tracer's cache and the ring of path stream consist of slots.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..gpu.constants import CONSTANTS
from ..gpu.errors import VulkanError
from ..scene.scene import SHADED, Primitive, Scene

PACKED_POSITION_BITS = CONSTANTS["PACKED_POSITION_BITS"]


@dataclass(frozen=True)
class SlotLayout:
    """floats: positions are floats instead of integers on the primitive's grid.

    attribute_words: per vertex, besides the position.
    """

    floats: bool
    attribute_words: int

    @classmethod
    def of(cls, scene: Scene, *, traced: bool = False) -> SlotLayout:
        """The layout that fits all of the scene's primitives. traced: for the ray tracer."""
        # Positions with too many bits are stored as floats. So are rounded ones if rays hit them:
        # rounding moves them off the grid.
        floats = any(
            p.position_bits > PACKED_POSITION_BITS or (traced and p.attributes["POSITION"].rounded)
            for p in scene.primitives
        )
        return cls(floats, max(_attribute_words(p) for p in scene.primitives))

    @property
    def bytes(self) -> int:
        """Of one slot."""
        words = CONSTANTS["MESHLET_VERTICES"] * ((3 if self.floats else 2) + self.attribute_words)
        return 4 * (CONSTANTS["MESHLET_TRIANGLES"] + words)

    @property
    def constants(self) -> dict[str, int]:
        """Specialisation constants by name."""
        return {"POSITION_FLOATS": int(self.floats), "ATTRIBUTE_WORDS": self.attribute_words}


def share_bytes(scene: Scene, share: float, slot_bytes: int, spare: int = 0) -> int:
    """Bytes of a cache for a share of the scene's meshlets, besides spare slots: see slots_in."""
    meshlets = sum(p.meshlets for p in scene.primitives)
    return (math.ceil(share * meshlets) + spare) * slot_bytes


def slots_in(size: int, slot_bytes: int, spare: int = 0) -> int:
    """Slots of a cache of `size` bytes, besides spare ones. Raises VulkanError for none."""
    slots = size // slot_bytes - spare
    if slots < 1:
        least = (1 + spare) * slot_bytes
        raise VulkanError(f"a cache of {size} bytes holds no meshlet", f"use {least} or more")
    return slots


def _attribute_words(primitive: Primitive) -> int:
    """Words per vertex of the attributes besides the position. Each attribute has whole words."""
    streams = [
        primitive.attributes[role].stream for role in SHADED[1:] if role in primitive.attributes
    ]
    return sum(packed_field(stream.elements, stream.bits)[1] for stream in streams)


def packed_field(elements: int, bits: int) -> tuple[int, int]:
    """(bits of an element, words of a vertex): side by side in up to 64 bits, else a word each."""
    field = bits if elements * bits <= 64 else 32
    return field, -(-elements * field // 32)

"""Slots: decoded meshlets in memory as shaders/slots.glsl lays them out, for the ray tracer's cache and for path stream."""

from __future__ import annotations

from dataclasses import dataclass

from .constants import CONSTANTS
from .scene import SHADED, Primitive, Scene

PACKED_BITS = 21  # the most that a coordinate has as an integer
# Specialisation constants of shaders/slots.glsl.
POSITION_FLOATS_ID, ATTRIBUTE_WORDS_ID = 16, 17


@dataclass(frozen=True)
class SlotLayout:
    """floats: positions are floats rather than integers on a grid; attribute_words: of a vertex, beyond its position."""

    floats: bool
    attribute_words: int

    @classmethod
    def of(cls, scene: Scene) -> "SlotLayout":
        """The layout that holds the meshlets of all the scene's primitives."""
        # Positions that do not fit as integers, or are not on a grid after their rounding, are kept as floats.
        floats = any(p.position_bits > PACKED_BITS or p.attributes["POSITION"].rounded for p in scene.primitives)
        return cls(floats, max(-(-_attribute_bits(p) // 32) for p in scene.primitives))

    @property
    def bytes(self) -> int:
        """Of one slot."""
        words = CONSTANTS["MESHLET_VERTICES"] * ((3 if self.floats else 2) + self.attribute_words)
        return 4 * (CONSTANTS["MESHLET_TRIANGLES"] + words)

    @property
    def constants(self) -> dict[int, int]:
        """Specialisation constants by id."""
        return {POSITION_FLOATS_ID: int(self.floats), ATTRIBUTE_WORDS_ID: self.attribute_words}


def _attribute_bits(primitive: Primitive) -> int:
    """Of a vertex: what shading needs of it beside its position."""
    streams = [primitive.attributes[role].stream for role in SHADED[1:] if role in primitive.attributes]
    return sum(stream.bits * stream.components for stream in streams)

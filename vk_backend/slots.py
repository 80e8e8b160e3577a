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
    def of(cls, scene: Scene, *, traced: bool = False) -> "SlotLayout":
        """The layout that holds the meshlets of all the scene's primitives. traced: what is in slots is used as it is."""
        # Positions that do not fit as integers are kept as floats, and so are those that rays meet and that their rounding takes off
        # the grid.
        floats = any(
            p.position_bits > PACKED_BITS or (traced and p.attributes["POSITION"].rounded)
            for p in scene.primitives
        )
        return cls(floats, max(_attribute_words(p) for p in scene.primitives))

    @property
    def bytes(self) -> int:
        """Of one slot."""
        words = CONSTANTS["MESHLET_VERTICES"] * ((3 if self.floats else 2) + self.attribute_words)
        return 4 * (CONSTANTS["MESHLET_TRIANGLES"] + words)

    @property
    def constants(self) -> dict[int, int]:
        """Specialisation constants by id."""
        return {POSITION_FLOATS_ID: int(self.floats), ATTRIBUTE_WORDS_ID: self.attribute_words}


def _attribute_words(primitive: Primitive) -> int:
    """Of a vertex: what shading needs of it beside its position, each attribute in words of its own."""
    streams = [
        primitive.attributes[role].stream for role in SHADED[1:] if role in primitive.attributes
    ]
    return sum(packed_field(stream.components, stream.bits)[1] for stream in streams)


def packed_field(components: int, bits: int) -> tuple[int, int]:
    """(bits of a component, words of a vertex) where components lie side by side in up to 64 bits, and otherwise in a word each."""
    field = bits if components * bits <= 64 else 32
    return field, -(-components * field // 32)

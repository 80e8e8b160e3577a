// Writes a decoded meshlet into a slot.
//
// needs: decoded_value
#ifndef SLOT_OUTPUT_GLSL
#define SLOT_OUTPUT_GLSL

#include "decoders/slots.glsl"

// Writes an attribute at bit `place` of the vertex's attributes.
void put_attribute(uvec2 slot, Attribute a, uint place, uint vertex) {
  SlotWords words = SlotWords(slot);
  uint word = slot_attributes() + vertex * ATTRIBUTE_WORDS + (place >> 5);
  uint field = attribute_field(a);
  uint pending = 0u;  // bits of an incomplete word
  uint filled = 0u;
  for (uint c = 0u; c < attribute_elements(a); c++) {
    uint value = decoded_value(a.element + c, vertex);
    pending |= value << filled;
    filled += field;
    if (filled < 32u) continue;
    words.at[word++] = pending;
    filled -= 32u;
    pending = filled == 0u ? 0u : value >> (field - filled);
  }
  if (filled > 0u) words.at[word] = pending;
}

void put_position(uvec2 slot, Attribute position, uint vertex) {
  uvec3 q = uvec3(decoded_value(0u, vertex), decoded_value(1u, vertex), decoded_value(2u, vertex));
  if (POSITION_FLOATS) {
    vec3 p = position_value(position, q);
    for (uint c = 0u; c < 3u; c++)
      SlotWords(slot).at[SLOT_POSITIONS + 3u * vertex + c] = floatBitsToUint(p[c]);
  } else {
    SlotPairs(slot).at[SLOT_POSITIONS / 2u + vertex] = packed_position(q);
  }
}

// Vertex `vertex` of the meshlet, in primitive p.
void put_vertex(uvec2 slot, Primitive p, uint vertex) {
  put_position(slot, p.position, vertex);
  put_attribute(slot, p.normal, NORMAL_PLACE, vertex);
  put_attribute(slot, p.texcoord, texcoord_place(p.normal), vertex);
  put_attribute(slot, p.color, color_place(p.normal, p.texcoord), vertex);
}

#endif

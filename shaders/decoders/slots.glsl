// A slot holds one decoded meshlet: in the ray tracer's cache, or in the ring of path `stream`.
// vk_backend/decode/slots.py computes its size.
//   64 words: triangles a | b << 8 | v << 16; readers mask the upper byte, which decoders use
//   64 positions: packed_position, or three floats
//   64 * ATTRIBUTE_WORDS words: normal, texture coordinates and colour of each vertex, without
//   those that the primitive lacks
#ifndef SLOTS_GLSL
#define SLOTS_GLSL

#include "scene/addresses.glsl"
#include "scene/scene.glsl"

// Positions are floats in object coordinates instead of integers on the primitive's grid.
layout(constant_id = 16) const bool POSITION_FLOATS = false;
layout(constant_id = 17) const uint ATTRIBUTE_WORDS = 0u;  // per vertex, besides the position

layout(buffer_reference, std430, buffer_reference_align = 4) buffer SlotWords { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) buffer SlotPairs { uvec2 at[]; };

#define SLOT_POSITIONS MESHLET_TRIANGLES
uint position_words() { return POSITION_FLOATS ? 3u : 2u; }
uint slot_words() {
  return MESHLET_TRIANGLES + MESHLET_VERTICES * (position_words() + ATTRIBUTE_WORDS);
}
uint slot_attributes() { return MESHLET_TRIANGLES + MESHLET_VERTICES * position_words(); }

uvec2 slot_address(uvec2 slots, uint slot) { return byte_offset(slots, slot_words(), slot); }

// --- positions ---

// Three coordinates of PACKED_POSITION_BITS = 21 bits each in 63 bits.
uvec2 packed_position(uvec3 q) { return uvec2(q.x | q.y << 21, q.y >> 11 | q.z << 10); }
uvec3 unpacked_position(uvec2 p) {
  return uvec3(p.x & 0x1FFFFFu, p.x >> 21 | (p.y & 0x3FFu) << 11, p.y >> 10);
}

// Only if POSITION_FLOATS.
vec3 slot_float_position(uvec2 slot, uint vertex) {
  SceneFloats floats = SceneFloats(slot);
  uint at = SLOT_POSITIONS + 3u * vertex;
  return vec3(floats.at[at], floats.at[at + 1u], floats.at[at + 2u]);
}

// Only if not POSITION_FLOATS.
uvec3 slot_grid_position(uvec2 slot, uint vertex) {
  return unpacked_position(SlotPairs(slot).at[SLOT_POSITIONS / 2u + vertex]);
}

vec3 slot_position(uvec2 slot, uint vertex) {
  return POSITION_FLOATS ? slot_float_position(slot, vertex)
                         : vec3(slot_grid_position(slot, vertex));
}

// In object coordinates.
vec3 slot_object_position(uvec2 slot, Attribute position, uint vertex) {
  return POSITION_FLOATS ? slot_float_position(slot, vertex)
                         : position_value(position, slot_grid_position(slot, vertex));
}

// --- attributes ---

// Bits per element. An attribute has whole words: all elements side by side in up to 64 bits, or
// each in a word of its own.
uint attribute_field(Attribute a) {
  uint bits = attribute_bits(a);
  return bits * attribute_elements(a) <= 64u ? bits : 32u;
}
uint attribute_size(Attribute a) {
  return (attribute_field(a) * attribute_elements(a) + 31u) & ~31u;
}
// Offset of each attribute's bits in a vertex. Attributes that the primitive lacks take no bits.
#define NORMAL_PLACE 0u
uint texcoord_place(Attribute normal) { return attribute_size(normal); }
uint color_place(Attribute normal, Attribute texcoord) {
  return attribute_size(normal) + attribute_size(texcoord);
}

// Reads 1 to 32 bits at bit offset `at` of a vertex's attributes.
uint slot_bits(uvec2 slot, uint vertex, uint at, uint bits) {
  SceneWords words = SceneWords(slot);
  uint word = slot_attributes() + vertex * ATTRIBUTE_WORDS + (at >> 5);
  uint shift = at & 31u;
  uint value = words.at[word] >> shift;
  if (shift + bits > 32u) value |= words.at[word + 1u] << (32u - shift);
  return bits == 32u ? value : value & ((1u << bits) - 1u);
}

#endif

// Slots: decoded meshlets in memory, in the ray tracer's cache and in the ring of path `stream`.
// vk_backend/slots.py has their size.
//   64 words of triangles, a | b << 8 | v << 16 (above that, what decoding needs: readers mask it)
//   64 positions, packed_position or three floats
//   64 times ATTRIBUTE_WORDS words: the vertex's normal, texture coordinates and colour, without
//   those that the primitive lacks
#ifndef SLOTS_GLSL
#define SLOTS_GLSL

#include "scene/addresses.glsl"
#include "scene/scene.glsl"

layout(constant_id = 16) const bool POSITION_FLOATS =
    false;  // positions are floats in the primitive's coordinates, not integers on its grid
layout(constant_id = 17) const uint ATTRIBUTE_WORDS = 0u;  // of a vertex, beyond its position

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

// Three coordinates of at most 21 bits each, one after another.
uvec2 packed_position(uvec3 q) { return uvec2(q.x | q.y << 21, q.y >> 11 | q.z << 10); }
uvec3 unpacked_position(uvec2 p) {
  return uvec3(p.x & 0x1FFFFFu, p.x >> 21 | (p.y & 0x3FFu) << 11, p.y >> 10);
}

// Where positions are floats.
vec3 slot_float_position(uvec2 slot, uint vertex) {
  SceneFloats floats = SceneFloats(slot);
  uint at = SLOT_POSITIONS + 3u * vertex;
  return vec3(floats.at[at], floats.at[at + 1u], floats.at[at + 2u]);
}

// Where they are not.
uvec3 slot_grid_position(uvec2 slot, uint vertex) {
  return unpacked_position(SlotPairs(slot).at[SLOT_POSITIONS / 2u + vertex]);
}

vec3 slot_position(uvec2 slot, uint vertex) {
  return POSITION_FLOATS ? slot_float_position(slot, vertex)
                         : vec3(slot_grid_position(slot, vertex));
}

// --- attributes ---

// An attribute has whole words: its components lie side by side in up to two, or in one each.
uint attribute_field(Attribute a) {
  uint bits = attribute_bits(a);
  return bits * attribute_elements(a) <= 64u ? bits : 32u;
}
uint attribute_size(Attribute a) {
  return (attribute_field(a) * attribute_elements(a) + 31u) & ~31u;
}
// Where its bits begin; an attribute that the primitive lacks has none.
#define NORMAL_PLACE 0u
uint texcoord_place(Attribute normal) { return attribute_size(normal); }
uint color_place(Attribute normal, Attribute texcoord) {
  return attribute_size(normal) + attribute_size(texcoord);
}

// `bits` bits, 1 to 32, of a vertex's attributes.
uint slot_bits(uvec2 slot, uint vertex, uint at, uint bits) {
  SceneWords words = SceneWords(slot);
  uint word = slot_attributes() + vertex * ATTRIBUTE_WORDS + (at >> 5);
  uint shift = at & 31u;
  uint value = words.at[word] >> shift;
  if (shift + bits > 32u) value |= words.at[word + 1u] << (32u - shift);
  return bits == 32u ? value : value & ((1u << bits) - 1u);
}

#endif

// The bulk passes' layout of values: per stream 64 vertices of one or more words. A vertex's
// elements lie side by side in up to 64 bits (a position's elements take 21 bits each); if they do
// not fit, each has a word. With STREAM these are the words of a slot; bench/gpu_decoder.py unpacks
// the others.
//
// needs: WORKGROUP
#ifndef PACKED_VALUES_GLSL
#define PACKED_VALUES_GLSL

#include "decoders/sections.glsl"
#ifdef STREAM
#include "decoders/slot_jobs.glsl"
#else
#include "decoders/decode_push.glsl"
#endif

shared uint shared_places[MAX_STREAMS];  // see place_field

#define PLACE_BASE 0, 16    // word of the first vertex
#define PLACE_STRIDE 16, 6  // words from one vertex to the next
#define PLACE_FIELD 22, 6   // bits per element
#define PLACE_WORDS 28, 2   // words of the elements: 1, 2, or 3 for more
#define place_field(s, field) bitfieldExtract(shared_places[s], field)

uint field_of(uint s) {
  uint bits = stream_field(s, STREAM_BITS);
  uint field = s == 0u ? max(bits, 21u) : bits;
  return field * stream_field(s, STREAM_ELEMENTS) <= 64u ? field : 32u;
}

uint words_of(uint s) { return (field_of(s) * stream_field(s, STREAM_ELEMENTS) + 31u) >> 5; }

// x: word of the first vertex of stream s, y: words from one vertex to the next.
#ifdef STREAM
// In a slot, see slots.glsl. The host makes sure that each stream is one of these attributes.
uvec2 value_place(uint s) {
  Primitive p = job_primitive();
  if (s == 0u) return uvec2(SLOT_POSITIONS, 2u);
  uint element = stream_field(s, STREAM_ELEMENT);
  uint bits = element == p.normal.element     ? NORMAL_PLACE
              : element == p.texcoord.element ? texcoord_place(p.normal)
                                              : color_place(p.normal, p.texcoord);
  return uvec2(slot_attributes() + (bits >> 5), ATTRIBUTE_WORDS);
}
#else
uvec2 value_place(uint s) {
  uint words = 0u;
  for (uint before = 0u; before < s; before++) words += words_of(before);
  return uvec2(64u * words, words_of(s));
}
#endif

// Call with all threads after share_streams. Contains a barrier.
void share_value_places() {
  for (uint s = THREAD; s < stream_total; s += WORKGROUP) {
    uvec2 place = value_place(s);
    shared_places[s] = (place.x & 0xFFFFu) | (place.y & 63u) << 16 | field_of(s) << 22 |
                       min(words_of(s), 3u) << 28;
  }
  barrier();
}

bool is_packed(uint s) { return place_field(s, PLACE_WORDS) <= 2u; }

uint get_field(uvec2 fields, uint at, uint bits) {
  uint value =
      at < 32u ? (fields.x >> at) | ((fields.y << 1) << (31u - at)) : fields.y >> (at - 32u);
  return value & word_below(bits);
}

uvec2 put_field(uint at, uint value) {
  return at < 32u ? uvec2(value << at, (value >> 1) >> (31u - at)) : uvec2(0u, value << (at - 32u));
}

ADDRESS the_values;  // address of the meshlet's values

uint word_of(uint s, uint id) {
  return place_field(s, PLACE_BASE) + place_field(s, PLACE_STRIDE) * (id & 63u);
}

// The elements of a vertex of a packed stream.
uvec2 vertex_at(uint s, uint id) {
  uint word = word_of(s, id);
  if (place_field(s, PLACE_WORDS) == 1u) return uvec2(VALUE_AT(the_values, word), 0u);
  return VALUE_PAIR_AT(the_values, word >> 1);
}

void put_vertex(uint s, uint id, uvec2 fields) {
  uint word = word_of(s, id);
  if (place_field(s, PLACE_WORDS) == 1u)
    VALUE_AT(the_values, word) = fields.x;
  else
    SET_VALUE_PAIR_AT(the_values, word >> 1, fields);
}

uint value_at(uint s, uint c, uint id) {
  if (is_packed(s))
    return get_field(vertex_at(s, id), c * place_field(s, PLACE_FIELD),
                     place_field(s, PLACE_FIELD));
  return VALUE_AT(the_values, word_of(s, id) + c);
}

// Write the elements of a vertex in order: element 0 clears the others.
void put_value(uint s, uint c, uint id, uint value) {
  uint inside = value & bits_mask(s);
  if (!is_packed(s)) {
    VALUE_AT(the_values, word_of(s, id) + c) = inside;
    return;
  }
  uvec2 before = c == 0u ? uvec2(0u) : vertex_at(s, id);
  put_vertex(s, id, before | put_field(c * place_field(s, PLACE_FIELD), inside));
}

#endif

// Decoded values of a meshlet, packed: for every stream 64 vertices of a few words each. To be included after meshlet_sections.glsl.
// The components of a vertex lie side by side in up to 64 bits, a position's in 21 bits each; if that does not hold them, in a word each.

layout(buffer_reference, std430, buffer_reference_align = 4) buffer PackedWords { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) buffer PackedPairs { uvec2 at[]; };

uint field_bits(uint s) {
  uint bits = stream_field(s, STREAM_BITS);
  uint n = stream_field(s, STREAM_COMPONENTS);
  if (s == 0u) return n * 21u <= 64u && bits <= 21u ? 21u : 32u;
  return n * bits <= 64u ? bits : 32u;
}

uint vertex_words(uint s) {
  uint bits = field_bits(s) * stream_field(s, STREAM_COMPONENTS);
  return (bits + 31u) >> 5;
}

bool is_packed(uint s) { return vertex_words(s) <= 2u; }

// Words of a vertex in the streams before s.
uint words_before(uint s) {
  uint words = 0u;
  for (uint before = 0u; before < s; before++) words += vertex_words(before);
  return words;
}

uint get_field(uvec2 fields, uint at, uint bits) {
  uint value = at < 32u ? (fields.x >> at) | ((fields.y << 1) << (31u - at)) : fields.y >> (at - 32u);
  return value & word_below(bits);
}

uvec2 put_field(uint at, uint value) {
  return at < 32u ? uvec2(value << at, (value >> 1) >> (31u - at)) : uvec2(0u, value << (at - 32u));
}

// begin: the words before the meshlet.
uvec2 packed_vertex(uvec2 values, uint begin, uint s, uint id) {
  uint place = begin + 64u * words_before(s);
  if (vertex_words(s) == 1u) return uvec2(PackedWords(values).at[place + id], 0u);
  return PackedPairs(values).at[(place >> 1) + id];
}

void put_packed_vertex(uvec2 values, uint begin, uint s, uint id, uvec2 fields) {
  uint place = begin + 64u * words_before(s);
  if (vertex_words(s) == 1u) PackedWords(values).at[place + id] = fields.x;
  else PackedPairs(values).at[(place >> 1) + id] = fields;
}

uint packed_value(uvec2 values, uint begin, uint s, uint c, uint id) {
  if (is_packed(s)) return get_field(packed_vertex(values, begin, s, id), c * field_bits(s), field_bits(s));
  return PackedWords(values).at[begin + 64u * words_before(s) + vertex_words(s) * id + c];
}

// The components of a vertex have to come in their order.
void put_packed_value(uvec2 values, uint begin, uint s, uint c, uint id, uint value) {
  if (is_packed(s)) {
    uvec2 fields = c == 0u ? uvec2(0u) : packed_vertex(values, begin, s, id);
    put_packed_vertex(values, begin, s, id, fields | put_field(c * field_bits(s), value));
  } else {
    PackedWords(values).at[begin + 64u * words_before(s) + vertex_words(s) * id + c] = value;
  }
}

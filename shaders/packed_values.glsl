// Values of decoded meshlets where decoding passes put them: a vertex's components of one stream side by side in up to two words, or in a word
// each. To be included after meshlet_sections.glsl. The includer provides uint stream_place(uint s), by placed() below.

shared uint group_places[GROUP_BLOBS * MAX_STREAMS]; // see place_field

#define PLACE_BASE 0, 16                             // word of the first vertex,
#define PLACE_STRIDE 16, 6                           //   words from one vertex to the next,
#define PLACE_FIELD 22, 6                            //   and bits of a component
#define PLACE_WANTED 28, 1                           // else nobody asks for the stream
#define place_field(s, field) bitfieldExtract(group_places[stream_table + (s)], field)

uint placed(uint base, uint stride, uint field) { return (base & 0xFFFFu) | (stride & 63u) << 16 | (field & 63u) << 22 | 1u << 28; }

bool is_packed(uint s) { return place_field(s, PLACE_FIELD) * stream_field(s, STREAM_COMPONENTS) <= 64u; }
bool is_wanted(uint s) { return place_field(s, PLACE_WANTED) != 0u; }

uint get_field(uvec2 fields, uint at, uint bits) {
  uint value = at < 32u ? (fields.x >> at) | ((fields.y << 1) << (31u - at)) : fields.y >> (at - 32u);
  return value & word_below(bits);
}

uvec2 put_field(uint at, uint value) {
  return at < 32u ? uvec2(value << at, (value >> 1) >> (31u - at)) : uvec2(0u, value << (at - 32u));
}

uvec2 the_values;                                    // address of the meshlet's

uint word_of(uint s, uint id) { return place_field(s, PLACE_BASE) + place_field(s, PLACE_STRIDE) * (id & 63u); }
bool two_words(uint s) { return place_field(s, PLACE_FIELD) * stream_field(s, STREAM_COMPONENTS) > 32u; }

uvec2 vertex_at(uint s, uint id) {
  uint word = word_of(s, id);
  if (two_words(s) && (word & 1u) == 0u) return Pairs(the_values).at[word >> 1];
  return uvec2(Integers(the_values).at[word], two_words(s) ? Integers(the_values).at[word + 1u] : 0u);
}

void put_vertex(uint s, uint id, uvec2 fields) {
  uint word = word_of(s, id);
  if (two_words(s) && (word & 1u) == 0u) {
    Pairs(the_values).at[word >> 1] = fields;
    return;
  }
  Integers(the_values).at[word] = fields.x;
  if (two_words(s)) Integers(the_values).at[word + 1u] = fields.y;
}

uint value_at(uint s, uint c, uint id) {
  if (is_packed(s)) return get_field(vertex_at(s, id), c * place_field(s, PLACE_FIELD), place_field(s, PLACE_FIELD));
  return Integers(the_values).at[word_of(s, id) + c];
}

// The components of a vertex have to come in their order.
void put_value(uint s, uint c, uint id, uint value) {
  uint inside = value & bits_mask(s);
  if (!is_packed(s)) {
    Integers(the_values).at[word_of(s, id) + c] = inside;
    return;
  }
  uvec2 before = c == 0u ? uvec2(0u) : vertex_at(s, id);
  put_vertex(s, id, before | put_field(c * place_field(s, PLACE_FIELD), inside));
}

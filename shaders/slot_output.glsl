// Writes what a team has decoded into a slot. To be included after slots.glsl and meshlet_workgroup.glsl.

uint pending;                              // bits of a vertex's attributes that do not fill a word yet
uint pending_bits;
uint next_word;

void put_bits(SlotWords words, uint value, uint bits) {
  pending |= value << pending_bits;
  uint filled = pending_bits + bits;
  if (filled >= 32u) {
    words.at[next_word] = pending;
    next_word++;
    filled -= 32u;
    pending = filled == 0u ? 0u : value >> (bits - filled);
  }
  pending_bits = filled;
}

uint team_value(uint lane, uint vertex) { return team_values[TEAM_INDEX][min(lane, MAX_LANES - 1u) * 64u + vertex]; }

void put_attribute(SlotWords words, Attribute a, uint vertex) {
  for (uint c = 0u; c < attribute_components(a); c++) put_bits(words, team_value(a.lane + c, vertex), attribute_bits(a));
}

void put_position(uvec2 slot, Attribute position, uint vertex) {
  uvec3 q = uvec3(team_value(0u, vertex), team_value(1u, vertex), team_value(2u, vertex));
  if (POSITION_FLOATS) {
    vec3 p = position_value(position, q);
    for (uint c = 0u; c < 3u; c++) SlotWords(slot).at[SLOT_POSITIONS + 3u * vertex + c] = floatBitsToUint(p[c]);
  } else {
    SlotPairs(slot).at[SLOT_POSITIONS / 2u + vertex] = packed_position(q);
  }
}

// Vertex `vertex` of the team's meshlet, in primitive p.
void put_vertex(uvec2 slot, Primitive p, uint vertex) {
  put_position(slot, p.position, vertex);
  SlotWords words = SlotWords(slot);
  next_word = slot_attributes() + vertex * ATTRIBUTE_WORDS;
  uint last = next_word + ATTRIBUTE_WORDS;
  pending = 0u;
  pending_bits = 0u;
  put_attribute(words, p.normal, vertex);
  put_attribute(words, p.texcoord, vertex);
  put_attribute(words, p.color, vertex);
  if (next_word < last) words.at[next_word] = pending;
}

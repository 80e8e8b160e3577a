// Residuals of a stream, one after the other, and the values of a chain.
#ifndef PASS_RESIDUALS_GLSL
#define PASS_RESIDUALS_GLSL

#include "decoders/passes.glsl"

// --- residuals ---

uint residual_code;     // see is_exponential
uvec2 residual_widths;  // of a fixed code: six bits per element
uint low_position;      // bit position of the next residual's low bits
uint low_index;         // index of the first of low_words
uvec2 low_words;        // the two words read last

void seek_low(uint p) {
  low_position = p;
  low_index = p >> 5;
  low_words = load_words2(low_index);
}

uint take_low(uint width) {
  uint w = low_position >> 5;
  if (w != low_index) {
    low_words = uvec2(w == low_index + 1u ? low_words.y : load_word(w), load_word(w + 1u));
    low_index = w;
  }
  uint bits = funnel(low_words.x, low_words.y, low_position & 31u) & word_below(width);
  low_position += width;
  return bits;
}

uvec2 fixed_widths(uint position, uint n) {
  uvec2 widths = uvec2(0u);
  for (uint c = 0u; c < n; c++) widths |= put_field(6u * c, width_field(position + WIDTH_BITS * c));
  return widths;
}

// Threads side by side read different codes: all of them call the steps that codes have in common.
uint next_residual(uint c) {
  bool fixed_code = residual_code == CODE_FIXED;
  uint parameter = residual_code & CODE_MAX_PARAMETER;
  uint width = fixed_code ? get_field(residual_widths, 6u * c, 6u) : parameter;
  uint above = fixed_code ? 0u : next_quotient();
  if (is_exponential(residual_code)) {
    uint longer = exponential_quotient(parameter, above);
    width += longer;
    above = (1u << longer) - 1u;
  }
  return unzigzag(take_low(width) + (above << parameter));
}

// --- chains ---

struct Chain {
  uint steps;  // its length in edges
  uint from;   // local ids of its ends, in the direction of its residuals
  uint to;
  mask64 inner;    // local ids between the ends
  bool backwards;  // against the loop's direction
};

// Reads the values of a chain's inner vertices for stream s: predicted toward the chain's end, plus
// residuals.
void read_chain(Chain chain, uint s) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  bool vectors = is_packed(s);
  uint field = place_field(s, PLACE_FIELD);
  uint mask = bits_mask(s);
  uint a = chain.from;  // the vertex before, and the one before that
  uint o = chain.from;
  uvec2 from = vectors ? vertex_at(s, chain.from) : uvec2(0u);
  uvec2 to = vectors ? vertex_at(s, chain.to) : uvec2(0u);
  uvec2 beyond = from;
  uint left = chain.steps;
  for (mask64 rest = chain.inner; mask_any(rest) && error == ERROR_NONE; left--) {
    uint id = (chain.backwards ? mask_msb(rest) : mask_lsb(rest)) & 63u;
    rest = rest & ~mask_bit(id);
    Weights weights;
    weights.exist = false;
    if (predictor == PREDICT_AFFINE)
      weights = chain_weights(pack4(id, a, chain.to, a == chain.from ? NO_VERTEX : o));
    uvec2 fields = uvec2(0u);
    for (uint c = 0u; c < n; c++) {
      uint at = c * field;
      uint prev = vectors ? get_field(from, at, field) : value_at(s, c, a);
      uint point = prev;
      if (predictor != PREDICT_COPY) {
        uint last = vectors ? get_field(to, at, field) : value_at(s, c, chain.to);
        uint before = vectors ? get_field(beyond, at, field) : value_at(s, c, o);
        point = affine_chain_point(weights, prev, last, before, max(left, 1u));
      }
      uint value = (point + next_residual(c)) & mask;
      if (vectors)
        fields |= put_field(at, value);
      else
        put_value(s, c, id, value);
    }
    if (vectors) put_vertex(s, id, fields);
    beyond = from;
    from = fields;
    o = a;
    a = id;
  }
}

#endif

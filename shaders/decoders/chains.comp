// The fourth pass, after corners.comp: the values of the chains between corners, without
// those of seams.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET 8u
#include "decoders/passes.glsl"

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

void read_chains(HEADER_IN h, uint r) {
  Run run = run_of(r);
  if (mask_test(h.private_refs, r) || run.steps < 2u) return;
  bool foreign = mask_test(h.foreign_refs, r);
  uint entry = entry_position(h, r);
  Header owner = header_of(foreign ? entry_owner(h, entry) : h.meshlet);
  uint reference = foreign ? slot_reference(owner, entry_slot(h, entry)) & 63u : r;
  uvec2 vertices = chain_vertices(owner, reference);
  uint total = vertices.x;
  uint first = vertices.y;
  Places places = places_of(owner.meshlet);
  uint low = places.chains;
  uint quotients = places.quotients;
  uint begin = id_at(run.rank);
  uint end = last_id(h, r, run);
  mask64 inner =
      the_boundary & ~mask_below(begin + 1u) & mask_below(id_at(run.rank + run.steps - 1u) + 1u);
  Chain chain = Chain(run.steps, foreign ? end : begin, foreign ? begin : end, inner, foreign);
  uint skipped = 0u;  // quotients between the last one read and the next to read
  uint codes = places.codes;
  for (uint s = 0u; s < stream_end && error == ERROR_NONE; s++) {
    uint n = stream_field(s, STREAM_ELEMENTS);
    uint code = code_at(codes, s, true);
    uint widths = codes - WIDTH_BITS * n;
    uint width = low_width(code, n, widths);
    code_at(codes, s, false);
    uint rice = code == CODE_FIXED ? 0u : n;
    if (mask_test(seam_references(h, s), r)) {
      skipped += total * rice;
    } else {
      if (rice > 0u) {
        unary = seek_unary(after_ones(quotients, skipped + first * rice));
        skipped = (total - first - (run.steps - 1u)) * rice;
      }
      residual_code = code;
      residual_widths = code == CODE_FIXED ? fixed_widths(widths, n) : uvec2(0u);
      seek_low(low + first * width);
      read_chain(chain, s);
      if (rice > 0u) quotients = unary.cursor;
      if (max(quotients, low_position) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
    }
    low += total * width;
  }
}

void main() {
  if (!open_pass()) return;
  Header h = open_header();
  for (uint r = part; r < h.references && error == ERROR_NONE; r += PER_MESHLET) read_chains(h, r);
  close_pass();
}

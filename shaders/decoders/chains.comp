// The fourth pass, after corners.comp: the values of the chains between corners.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET 8u
#include "decoders/passes.glsl"

struct Chain {
  uint steps;  // its length in edges
  uint from;   // local ids of its ends, in the owner's direction
  uint to;
  mask64 inner;    // local ids between the ends
  bool backwards;  // the owner's direction is against the loop's
};

// Values of one stream: the chord between the chain's ends plus residuals.
void read_chain(Chain chain, uint s, uint code, uint widths, uint low) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  bool copies = stream_field(s, STREAM_PREDICTOR) == PREDICT_COPY;
  bool vectors = is_packed(s);
  uint field = place_field(s, PLACE_FIELD);
  uint mask = bits_mask(s);
  uvec2 from = vectors ? vertex_at(s, chain.from) : uvec2(0u);
  uvec2 to = vectors ? vertex_at(s, chain.to) : uvec2(0u);
  residual_code = code;
  residual_widths = code == CODE_FIXED ? fixed_widths(widths, n) : uvec2(0u);
  seek_low(low);
  uint i = 1u;
  for (mask64 rest = chain.inner; mask_any(rest) && error == ERROR_NONE; i++) {
    uint id = (chain.backwards ? mask_msb(rest) : mask_lsb(rest)) & 63u;
    rest = rest & ~mask_bit(id);
    uvec2 fields = uvec2(0u);
    for (uint c = 0u; c < n; c++) {
      uint a = vectors ? get_field(from, c * field, field) : value_at(s, c, chain.from);
      uint point = a;
      if (!copies)
        point = chord_point(a, vectors ? get_field(to, c * field, field) : value_at(s, c, chain.to),
                            i, chain.steps);
      uint value = (point + next_residual(c)) & mask;
      if (vectors)
        fields |= put_field(c * field, value);
      else
        put_value(s, c, id, value);
    }
    if (vectors) put_vertex(s, id, fields);
  }
  if (low_position > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

void read_chains(HEADER_IN h, uint r) {
  Run run = run_of(r);
  if (mask_test(h.private_refs, r) || run.steps < 2u) return;
  bool foreign = mask_test(h.foreign_refs, r);
  uint entry = entry_position(h, r);
  Header owner = read_header(foreign ? entry_owner(h, entry) : h.meshlet);
  uint reference = foreign ? slot_reference(owner, entry_slot(h, entry)) & 63u : r;
  uvec2 vertices = chain_vertices(owner, reference);
  uint total = vertices.x;
  uint first = vertices.y;
  uint low = anchors_begin(owner);
  uint count = mask_count(the_starts);
  uint codes = owner.codes;
  uint widths_total = 0u;
  for (uint s = 0u; s < stream_total; s++) {
    count = anchors_of(owner, s, count);
    low = after_anchors(low, s, count);
    uint n = stream_field(s, STREAM_ELEMENTS);
    uint code = code_at(codes, n, stream_field(s, STREAM_CHAIN_BASE));
    widths_total += low_width(code, n, codes - WIDTH_BITS * n);
    code_at(codes, n, stream_field(s, STREAM_INTERIOR_BASE));
  }
  uint quotients = low + total * widths_total;
  uint begin = id_at(run.rank);
  uint end = last_id(h, r, run);
  mask64 inner =
      the_boundary & ~mask_below(begin + 1u) & mask_below(id_at(run.rank + run.steps - 1u) + 1u);
  Chain chain = Chain(run.steps, foreign ? end : begin, foreign ? begin : end, inner, foreign);
  uint skipped = 0u;  // quotients between the last one read and the next to read
  codes = owner.codes;
  for (uint s = 0u; s < stream_end && error == ERROR_NONE; s++) {
    uint n = stream_field(s, STREAM_ELEMENTS);
    uint code = code_at(codes, n, stream_field(s, STREAM_CHAIN_BASE));
    uint widths = codes - WIDTH_BITS * n;
    uint width = low_width(code, n, widths);
    code_at(codes, n, stream_field(s, STREAM_INTERIOR_BASE));
    uint rice = code == CODE_FIXED ? 0u : n;
    if (foreign && mask_test(seam_references(h, s), r)) {
      skipped += total * rice;
    } else {
      if (rice > 0u) {
        unary = seek_unary(after_ones(quotients, skipped + first * rice));
        skipped = (total - first - (run.steps - 1u)) * rice;
      }
      read_chain(chain, s, code, widths, low + first * width);
      if (rice > 0u) quotients = unary.cursor;
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

// The fourth pass, after corners.comp: the values of the chains between corners, without those of
// seams. A thread takes every 8th chain, and the streams of its workgroup (see next_stream).
// variants: chains_bulk.comp=STREAM bench:chains.comp=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "decoders/passes.glsl"
#include "decoders/pass_residuals.glsl"

// Where the residuals of a chain lie.
struct Source {
  uint total;      // inner vertices of all chains of the owner
  uint first;      // those before the chain
  uint codes;      // bit positions: the codes of stream 0,
  uint low;        //   its low bits,
  uint quotients;  //   its unary parts
};

Source source_of(HEADER_IN h, uint r) {
  bool foreign = mask_test(h.foreign_refs, r);
  uint entry = entry_position(h, r);
  Header owner = header_of(foreign ? entry_owner(h, entry) : h.meshlet);
  uint reference = foreign ? slot_reference(owner, entry_slot(h, entry)) & 63u : r;
  uvec2 vertices = chain_vertices(owner, reference);
  Places places = places_of(owner.meshlet);
  return Source(vertices.x, vertices.y, places.codes, places.chains, places.quotients);
}

Chain chain_of(HEADER_IN h, uint r, Run run) {
  bool foreign = mask_test(h.foreign_refs, r);
  uint begin = id_at(run.rank);
  uint end = last_id(h, r, run);
  mask64 inner = inner_ids(run);
  return Chain(run.steps, foreign ? end : begin, foreign ? begin : end, inner, foreign);
}

// Reads reference r for one stream.
void read_stream(HEADER_IN h, uint r, Run run, uint wanted) {
  if (mask_test(seam_references(h, wanted), r)) return;
  Source source = source_of(h, r);
  uint ones = 0u;  // quotients before those of the chain
  uint n = 0u;
  uint code = 0u;
  uint widths = 0u;
  for (uint s = 0u; s <= wanted; s++) {
    n = stream_field(s, STREAM_ELEMENTS);
    code = code_at(source.codes, s, true);
    widths = source.codes - WIDTH_BITS * n;
    code_at(source.codes, s, false);
    uint before = s < wanted ? source.total : source.first;
    source.low += before * low_width(code, n, widths);
    if (code != CODE_FIXED) ones += before * n;
  }
  residual_code = code;
  residual_widths = code == CODE_FIXED ? fixed_widths(widths, n) : uvec2(0u);
  unary = seek_unary(code == CODE_FIXED ? source.quotients : after_ones(source.quotients, ones));
  seek_low(source.low);
  if (error == ERROR_NONE) read_chain(chain_of(h, r, run), wanted);
  if (max(unary.cursor, low_position) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

void main() {
  if (!open_pass(8u)) return;
  Header h = open_header();
  for (uint r = first_item; r < h.references; r += 8u) {
    Run run = run_of(r);
    if (mask_test(h.private_refs, r) || run.steps < 2u) continue;
    for (uint s = first_stream(); s < stream_end && error == ERROR_NONE; s = next_stream(s))
      read_stream(h, r, run, s);
  }
  close_pass();
}

// The fourth pass, after corners.comp: the values of the chains between corners, without
// those of seams. A thread takes every 8th chain: all streams of it, since AFFINE needs the values
// of stream 0, or without AFFINE one stream, that of the workgroup.
// variants: chains.comp= chains_split.comp=NO_AFFINE
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET 8u
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

#ifdef NO_AFFINE
// The workgroup's stream of reference r.
void read_chains(HEADER_IN h, uint r, Run run) {
  uint wanted = gl_WorkGroupID.y;
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

#else
// All streams of reference r, in order: AFFINE needs the values of stream 0.
void read_chains(HEADER_IN h, uint r, Run run) {
  Source source = source_of(h, r);
  Chain chain = chain_of(h, r, run);
  uint skipped = 0u;  // quotients between the last one read and the next to read
  for (uint s = 0u; s < stream_end && error == ERROR_NONE; s++) {
    uint n = stream_field(s, STREAM_ELEMENTS);
    uint code = code_at(source.codes, s, true);
    uint widths = source.codes - WIDTH_BITS * n;
    uint width = low_width(code, n, widths);
    code_at(source.codes, s, false);
    uint rice = code == CODE_FIXED ? 0u : n;
    if (mask_test(seam_references(h, s), r)) {
      skipped += source.total * rice;
    } else {
      if (rice > 0u) {
        unary = seek_unary(after_ones(source.quotients, skipped + source.first * rice));
        skipped = (source.total - source.first - (run.steps - 1u)) * rice;
      }
      residual_code = code;
      residual_widths = code == CODE_FIXED ? fixed_widths(widths, n) : uvec2(0u);
      seek_low(source.low + source.first * width);
      read_chain(chain, s);
      if (rice > 0u) source.quotients = unary.cursor;
      if (max(source.quotients, low_position) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
    }
    source.low += source.total * width;
  }
}
#endif

void main() {
  if (!open_pass()) return;
  Header h = open_header();
  for (uint r = part; r < h.references && error == ERROR_NONE; r += PER_MESHLET) {
    Run run = run_of(r);
    if (!mask_test(h.private_refs, r) && run.steps > 1u) read_chains(h, r, run);
  }
  close_pass();
}

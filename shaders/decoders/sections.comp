// The third pass, after lengths.comp: where each stream's values lie in a meshlet's data, one
// thread per meshlet. Needs no triangles: other meshlets look up their boundaries here even if this
// one is malformed.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET 1u
#include "decoders/passes.glsl"

#define ANCHORS 0u
#define CHAINS 1u
#define INTERIOR 2u

void main() {
  bool live = open_pass();
  if (!present) return;
  Header h = open_header();
  bool chains = mask_any(h.owned_refs);
  uint total = chain_vertices(h, 64u).x;
  uint traversed = h.references > 0u
                       ? traversed_vertices(h)
                       : h.closing + mask_count(the_boundary) - mask_count(the_starts);
  uint row = job_meshlet * stream_total;
  Sections table = Sections(push.sections);
  uint count = mask_count(the_starts);  // of anchors
  uint p = h.codes;
  // Part 0 is stream 0, part 1 the others.
  for (uint part = 0u; part < 2u && part < stream_total && error == ERROR_NONE; part++) {
    uint end = part == 0u ? 1u : stream_total;
    uint firsts = 0u;  // bits of the first anchors
    uint ones = 0u;    // values with a unary part: anchors and chains,
    uint later = 0u;   //   and the interior
    for (uint s = part; s < end; s++) {
      uint n = stream_field(s, STREAM_ELEMENTS);
      uint chain_code = chains ? code_at(p, n, stream_base(s, BASE_CHAIN)) : 0u;
      table.of[row + s].chain_unary = p - WIDTH_BITS * n;
      uint interior_code = code_at(p, n, stream_base(s, BASE_INTERIOR));
      table.of[row + s].interior_unary = p - WIDTH_BITS * n;
      table.of[row + s].codes = chain_code | interior_code << 8;
      if (chain_code != CODE_FIXED) ones += total * n;
      uint seams = live ? inner_vertices(seam_references(h, s)) : 0u;
      table.of[row + s].interior_low = traversed + seams;
      if (interior_code != CODE_FIXED) later += (traversed + seams) * n;
      count = anchors_of(h, s, count);
      table.of[row + s].anchor_low = count;
      table.of[row + s].first_anchor = firsts;
      if (count > 0u) firsts += n * stream_field(s, STREAM_BITS);
      if (count > 1u) ones += (count - 1u) * n;
    }
    uint quotients = p + firsts;
    uint low = after_ones(quotients, ones);
    for (uint list = ANCHORS; list <= INTERIOR && error == ERROR_NONE; list++) {
      if (list == INTERIOR) {
        quotients = low;
        low = after_ones(quotients, later);
      }
      for (uint s = part; s < end && error == ERROR_NONE; s++) {
        uint n = stream_field(s, STREAM_ELEMENTS);
        StreamSections found = table.of[row + s];
        uint code = CODE_EXPONENTIAL | stream_base(s, BASE_ANCHOR);
        uint widths = 0u;
        uint items = total * n;
        if (list == ANCHORS) {
          items = (max(found.anchor_low, 1u) - 1u) * n;
          found.first_anchor += p;
          found.anchor_unary = quotients;
          found.anchor_low = low;
        } else if (list == CHAINS) {
          code = found.codes & 255u;
          widths = found.chain_unary;
          if (code != CODE_FIXED) found.chain_unary = quotients;
          found.chain_low = low;
        } else {
          code = found.codes >> 8;
          widths = found.interior_unary;
          items = found.interior_low * n;
          if (code != CODE_FIXED) found.interior_unary = quotients;
          found.interior_low = low;
        }
        table.of[row + s] = found;
        uint next = code == CODE_FIXED ? quotients : after_ones(quotients, items);
        low += low_size(code, n, widths, items, next - quotients - items);
        quotients = next;
      }
    }
    p = low;
  }
  if (error == ERROR_NONE) return;
  for (uint s = 0u; s < stream_total; s++) table.of[row + s].codes = SECTIONS_MALFORMED;
  close_pass();
}

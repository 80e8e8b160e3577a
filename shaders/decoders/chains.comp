// The fifth pass, after corners.comp: the values of the chains between corners.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET 8u
#include "decoders/passes.glsl"

void read_chains(HEADER_IN h, uint r) {
  Run run = run_of(r);
  if (mask_test(h.private_refs, r) || run.steps < 2u) return;
  bool foreign = mask_test(h.foreign_refs, r);
  uint entry = entry_position(h, r);
  Header owner = read_header(foreign ? entry_owner(h, entry) : h.meshlet);
  uint reference = foreign ? slot_reference(owner, entry_slot(h, entry)) & 63u : r;
  uint first = chain_vertices(owner, reference).y;
  Chain chain = chain_of(h, r, run, foreign);
  for (uint s = 0u; s < stream_end && error == ERROR_NONE; s++) {
    if (foreign && mask_test(seam_references(h, s), r)) continue;
    StreamSections sections = sections_of(owner.meshlet, s);
    seek_residuals(s, sections.codes & 255u, sections.chain_unary, sections.chain_low,
                   first * stream_field(s, STREAM_ELEMENTS));
    read_chain(chain, s);
    check_residuals();
  }
}

void main() {
  if (!open_pass()) return;
  Header h = open_header();
  for (uint r = part; r < h.references && error == ERROR_NONE; r += PER_MESHLET) read_chains(h, r);
  close_pass();
}

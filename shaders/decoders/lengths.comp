// The second pass, after connect.comp: the places of references along the boundary.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET 8u
#include "decoders/passes.glsl"

shared uint group_lengths[GROUP_MESHLETS * 64u];  // of references

uint length_of(uint r) { return group_lengths[member * 64u + (r & 63u)]; }

uint measured_length(HEADER_IN h, uint r) {
  if (!mask_test(h.sized_refs | h.foreign_refs, r)) {
    uvec2 loop = loop_of(h, r);
    return loop.y - loop.x;
  }
  if (!mask_test(h.foreign_refs, r)) return stored_length(h, r);
  uint entry = entry_position(h, r);
  Header owner = read_header(entry_owner(h, entry));
  return stored_length(owner, slot_reference(owner, entry_slot(h, entry)) & 63u);
}

void check_length(HEADER_IN h, uint r, uint rank) {
  uvec2 loop = loop_of(h, r);
  uint end = rank + length_of(r);
  if (end == rank) error = ERROR_REFERENCES;
  if (r == loop_begin(h, r) && rank != loop.x) error = ERROR_REFERENCES;
  if (mask_test(h.loop_ends, r) ? end != loop.y : end > loop.y) error = ERROR_REFERENCES;
}

void main() {
  bool live = open_pass();
  Header h = open_header();
  uint references = live ? h.references : 0u;
  if (references > 0u && mask_count(h.loop_ends) != mask_count(the_starts))
    error = ERROR_REFERENCES;
  for (uint r = part; r < references; r += PER_MESHLET)
    group_lengths[member * 64u + r] = min(measured_length(h, r), 64u);
  barrier();
  if (!live) return;
  for (uint r = part; r < references && error == ERROR_NONE; r += PER_MESHLET) {
    uint rank = 0u;
    for (uint before = 0u; before < r; before++) rank += length_of(before);
    check_length(h, r, rank);
  }
  if (part == 0u) {
    mask64 begins = mask_none();
    uint rank = 0u;
    for (uint r = 0u; r < references; r++) {
      begins = begins | mask_bit(rank & 63u);
      rank += length_of(r);
    }
    Connectivity(push.connectivity).of[job_place].references = begins;
  }
  close_pass();
}

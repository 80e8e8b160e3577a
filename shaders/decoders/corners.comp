// The fourth pass, after sections.comp: the values of corners.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET 8u  // a thread takes every 8th corner
#include "decoders/passes.glsl"

// Four values of each thread: a local array would lie in slow memory.
shared uint group_sums[4u * GROUP];
shared uint group_hops;  // MAX_HOPS, hidden from the compiler, which would unroll a long loop

// Anchor `index` of streams [begin, end) of meshlet m: the first one plus differences.
void read_anchor_of(uint m, uint index, uint begin, uint end, uint id) {
  for (uint s = begin; s < end && error == ERROR_NONE; s++) {
    StreamSections sections = sections_of(m, s);
    uint n = stream_field(s, STREAM_ELEMENTS);
    uint bits = stream_field(s, STREAM_BITS);
    for (uint c = 0u; c < n; c++)
      group_sums[c * GROUP + THREAD] = load_bits(sections.first_anchor + c * bits, bits);
    if (index > 0u) {
      seek_residuals(s, CODE_EXPONENTIAL | stream_base(s, BASE_ANCHOR), sections.anchor_unary,
                     sections.anchor_low, 0u);
      uint c = 0u;
      for (uint items = index * n; items > 0u && error == ERROR_NONE; items--) {
        group_sums[c * GROUP + THREAD] += next_residual(c);
        c = c + 1u < n ? c + 1u : 0u;
      }
      check_residuals();
    }
    uvec2 fields = uvec2(0u);
    for (uint c = 0u; c < n; c++) {
      uint value = group_sums[c * GROUP + THREAD] & bits_mask(s);
      if (is_packed(s))
        fields |= put_field(c * place_field(s, PLACE_FIELD), value);
      else
        put_value(s, c, id, value);
    }
    if (is_packed(s)) put_vertex(s, id, fields);
  }
}

// Follows references from corner j to the meshlet that stores it and reads it, for stream s and the
// streams after it that take the same path. Returns the first stream that does not.
uint read_corner(HEADER_IN own, uint j, uint s, uint id) {
  Header h = own;
  bool apart = false;
  for (uint hop = 0u; hop <= group_hops && error == ERROR_NONE; hop++) {
    apart = apart || (h.flags & FLAG_SEAMS) != 0u;
    mask64 seams = seam_references(h, s);
    mask64 shared_refs = h.foreign_refs & ~seams;
    uint before = h.references > 0u ? previous_reference(h, j) & 63u : 0u;
    bool follow = mask_test(shared_refs, j);
    bool follow_before = mask_test(shared_refs, before);
    if (!follow && !follow_before) {
      uint end = apart ? s + 1u : stream_end;
      read_anchor_of(h.meshlet,
                     h.references == 0u ? j : mask_count(stored_corners(h, seams) & mask_below(j)),
                     s, end, id);
      return end;
    }
    if (follow && follow_before) follow = owner_of(h, before) >= owner_of(h, j);
    uint entry = entry_position(h, follow ? j : before);
    uint slot = entry_slot(h, entry);
    h = read_header(entry_owner(h, entry));
    uint reference = slot_reference(h, slot) & 63u;
    j = follow ? next_reference(h, reference) & 63u : reference;
  }
  if (error == ERROR_NONE) error = ERROR_HOPS;
  return stream_end;
}

void main() {
  if (THREAD == 0u) group_hops = MAX_HOPS;
  if (!open_pass()) return;  // contains barriers
  Header h = open_header();
  uint corners = h.references == 0u ? mask_count(the_starts) : h.references;
  for (uint j = part; j < corners; j += PER_MESHLET) {
    uint id = h.references == 0u ? ids_before(j) & 63u : id_at(nth_bit(the_references, j));
    for (uint s = 0u; s < stream_end && error == ERROR_NONE;) s = read_corner(h, j, s, id);
  }
  close_pass();
}

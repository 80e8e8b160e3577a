// The third pass, after lengths.comp: the values of corners. A thread takes every 8th corner, all
// streams of it or (SPLIT) that of the workgroup, which is faster for few meshlets.
// variants: corners.comp= corners_split.comp=SPLIT
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET 8u
#include "decoders/passes.glsl"
#ifdef SPLIT
#define FIRST_STREAM gl_WorkGroupID.y
#define END_STREAM (gl_WorkGroupID.y + 1u)
#else
#define FIRST_STREAM 0u
#define END_STREAM stream_end
#endif

shared uint group_hops;  // MAX_HOPS, hidden from the compiler, which would unroll a long loop

// Anchor `index` of streams [begin, end) of h.
void read_anchors(HEADER_IN h, uint index, uint begin, uint end, uint id) {
  uint p = places_of(h.meshlet).anchors;
  uint count = mask_count(the_starts);
  for (uint s = 0u; s < end; s++) {
    count = anchors_of(h, s, count);
    uint widths = further_widths(p, s, count);
    if (s >= begin) {
      uint n = stream_field(s, STREAM_ELEMENTS);
      uvec2 fields = uvec2(0u);
      for (uint c = 0u; c < n; c++) {
        uint value = anchor_value(s, p, index, widths, c);
        if (is_packed(s))
          fields |= put_field(c * place_field(s, PLACE_FIELD), value);
        else
          put_value(s, c, id, value);
      }
      if (is_packed(s)) put_vertex(s, id, fields);
    }
    p = after_anchors(p, s, count, widths);
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
      uint end = apart ? s + 1u : END_STREAM;
      read_anchors(h, h.references == 0u ? j : mask_count(stored_corners(h, seams) & mask_below(j)),
                   s, end, id);
      return end;
    }
    if (follow && follow_before) follow = owner_of(h, before) >= owner_of(h, j);
    uint entry = entry_position(h, follow ? j : before);
    uint slot = entry_slot(h, entry);
    h = header_of(entry_owner(h, entry));
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
    for (uint s = FIRST_STREAM; s < END_STREAM && error == ERROR_NONE;)
      s = read_corner(h, j, s, id);
  }
  close_pass();
}

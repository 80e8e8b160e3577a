// The third pass, after lengths.comp: the values of corners. A thread takes every 8th corner, and
// the stream of its workgroup.
// variants: corners_bulk.comp=STREAM bench:corners.comp=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "decoders/passes.glsl"

shared uint shared_hops;  // MAX_HOPS, hidden from the compiler, which would unroll a long loop

// Reads anchor `index` of stream `wanted` of h.
void read_anchor(HEADER_IN h, uint index, uint wanted, uint id) {
  uint p = places_of(h.meshlet).anchors;
  uint count = mask_count(the_starts);
  uint widths = 0u;
  for (uint s = 0u; s <= wanted; s++) {
    p = s == 0u ? p : after_anchors(p, s - 1u, count, widths);
    count = anchors_of(h, s, count);
    widths = further_widths(p, s, count);
  }
  uvec2 fields = uvec2(0u);
  for (uint c = 0u; c < stream_field(wanted, STREAM_ELEMENTS); c++) {
    uint value = anchor_value(wanted, p, index, widths, c);
    if (is_packed(wanted))
      fields |= put_field(c * place_field(wanted, PLACE_FIELD), value);
    else
      put_value(wanted, c, id, value);
  }
  if (is_packed(wanted)) put_vertex(wanted, id, fields);
}

// Follows references from corner j to the meshlet that stores its value for stream s and reads it.
void read_corner(HEADER_IN own, uint j, uint s, uint id) {
  Header h = own;
  for (uint hop = 0u; hop <= shared_hops && error == ERROR_NONE; hop++) {
    mask64 seams = seam_references(h, s);
    mask64 shared_refs = h.foreign_refs & ~seams;
    uint before = h.references > 0u ? previous_reference(h, j) & 63u : 0u;
    bool follow = mask_test(shared_refs, j);
    bool follow_before = mask_test(shared_refs, before);
    if (!follow && !follow_before) {
      if (h.references > 0u) j = mask_count(stored_corners(h, seams) & mask_below(j));
      read_anchor(h, j, s, id);
      return;
    }
    if (follow && follow_before) follow = owner_of(h, before) >= owner_of(h, j);
    uint entry = entry_position(h, follow ? j : before);
    uint slot = entry_slot(h, entry);
    h = header_of(entry_owner(h, entry));
    uint reference = slot_reference(h, slot) & 63u;
    j = follow ? next_reference(h, reference) & 63u : reference;
  }
  if (error == ERROR_NONE) error = ERROR_HOPS;
}

void main() {
  if (THREAD == 0u) shared_hops = MAX_HOPS;
  if (!open_pass(8u) || gl_WorkGroupID.y >= stream_end) return;  // contains barriers
  Header h = open_header();
  uint corners = h.references == 0u ? mask_count(the_starts) : h.references;
  for (uint j = first_item; j < corners && error == ERROR_NONE; j += 8u) {
    uint id = h.references == 0u ? ids_before(j) & 63u : id_at(nth_bit(the_references, j));
    read_corner(h, j, gl_WorkGroupID.y, id);
  }
  close_pass();
}

// The second pass, after connect.comp: the places of references along the boundary, and those of
// sections in the meshlets' data.
// variants: lengths_bulk.comp=STREAM bench:lengths.comp=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "decoders/passes.glsl"

shared uint shared_lengths[WORKGROUP / 8u * 64u];  // of references

uint length_of(uint r) { return shared_lengths[member * 64u + (r & 63u)]; }

uint measured_length(HEADER_IN h, uint r) {
  if (!mask_test(h.sized_refs | h.foreign_refs, r)) {
    uvec2 loop = loop_of(h, r);
    return loop.y - loop.x;
  }
  if (!mask_test(h.foreign_refs, r)) return stored_length(h, r);
  uint entry = entry_position(h, r);
  Header owner = header_of(entry_owner(h, entry));
  return stored_length(owner, slot_reference(owner, entry_slot(h, entry)) & 63u);
}

void check_length(HEADER_IN h, uint r, uint rank) {
  uvec2 loop = loop_of(h, r);
  uint end = rank + length_of(r);
  if (end == rank) error = ERROR_REFERENCES;
  if (r == loop_begin(h, r) && rank != loop.x) error = ERROR_REFERENCES;
  if (mask_test(h.loop_ends, r) ? end != loop.y : end > loop.y) error = ERROR_REFERENCES;
}

// The places of references along the boundary, from their lengths.
void place_references(HEADER_IN h, uint references) {
  mask64 begins = mask_none();
  uint rank = 0u;
  for (uint r = 0u; r < references; r++) {
    begins = begins | mask_bit(rank & 63u);
    rank += length_of(r);
  }
  CONNECTED(job_place).references = begins;
}

// Boundary vertices without a value before the traversal: inner vertices of private references.
mask64 waiting_vertices(HEADER_IN h) {
  mask64 waiting = mask_none();
  if (h.references == 0u) {
    waiting = the_boundary;
    for (uint k = 0u; k < mask_count(the_starts); k++)
      waiting = waiting & ~mask_bit(ids_before(k) & 63u);
  }
  uint rank = 0u;
  for (uint r = 0u; r < h.references && mask_any(h.private_refs); r++) {
    for (uint i = 1u; i < length_of(r) && mask_test(h.private_refs, r); i++)
      waiting = waiting | mask_bit(id_at(rank + i));
    rank += length_of(r);
  }
  return waiting;
}

// Other meshlets look up the places even if this one is malformed in another way.
void place_sections(HEADER_IN h, bool live) {
  bool chains = mask_any(h.owned_refs);
  uint total = chain_vertices(h, 64u).x;
  uint p = anchors_begin(h);
  uint codes = h.codes;
  uint count = mask_count(the_starts);
  uint low = 0u;
  uint ones = 0u;
  PLACES(job_meshlet).anchors = p;
  for (uint s = 0u; s < stream_total; s++) {
    count = anchors_of(h, s, count);
    p = after_anchors(p, s, count, further_widths(p, s, count));
    if (!chains) continue;
    uint n = stream_field(s, STREAM_ELEMENTS);
    uint code = code_at(codes, s, true);
    low += total * low_width(code, n, codes - WIDTH_BITS * n);
    if (code != CODE_FIXED) ones += total * n;
    code_at(codes, s, false);
  }
  PLACES(job_meshlet).chains = p;
  PLACES(job_meshlet).quotients = error == ERROR_NONE ? p + low : NO_PLACE;
  PLACES(job_meshlet).waiting = live ? waiting_vertices(h) : mask_none();
  uint interior = after_ones(p + low, ones);
  PLACES(job_meshlet).interior = error == ERROR_NONE ? interior : NO_PLACE;
}

void main() {
  bool live = open_pass(8u);
  Header h = open_header();
  uint header_error = error;
  uint references = live ? h.references : 0u;
  for (uint r = first_item; r < references; r += 8u)
    shared_lengths[member * 64u + r] = min(measured_length(h, r), 64u);
  barrier();
  if (present && first_item == 8u - 1u) {
    uint lengths_error = error;  // of owners: says nothing about this meshlet's sections
    error = header_error;
    place_sections(h, live);
    if (error == ERROR_NONE) error = lengths_error;
  }
  if (!live) return;
  if (references > 0u && mask_count(h.loop_ends) != mask_count(the_starts))
    error = ERROR_REFERENCES;
  for (uint r = first_item; r < references && error == ERROR_NONE; r += 8u) {
    uint rank = 0u;
    for (uint before = 0u; before < r; before++) rank += length_of(before);
    check_length(h, r, rank);
  }
  if (first_item == 0u) place_references(h, references);
  close_pass();
}

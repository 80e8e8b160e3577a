// The last pass, after chains.comp: the vertices that triangles introduce, one thread per stream.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET MAX_STREAMS
#include "decoders/passes.glsl"

uint triangle_at(uint t) { return Integers(job_triangles()).at[t & 63u]; }

// Number of inner vertices of the seams of stream s (spec, A.5, sections G and H).
uint seam_vertices_of(HEADER_IN h, uint s) {
  uint count = 0u;
  for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest))
    count += run_of(mask_lsb(rest)).steps - 1u;
  return count;
}

void read_seams(HEADER_IN h, uint s) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  bool copies = stream_field(s, STREAM_PREDICTOR) == PREDICT_COPY;
  for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    Run run = run_of(r);
    uint from = id_at(run.rank);
    uint to = last_id(h, r, run);
    for (uint i = 1u; i < run.steps; i++) {
      for (uint c = 0u; c < n && error == ERROR_NONE; c++) {
        uint a = value_at(s, c, from);
        uint point = copies ? a : chord_point(a, value_at(s, c, to), i, run.steps);
        put_value(s, c, id_at(run.rank + i), point + next_residual(c));
      }
    }
  }
}

// Reads vertex v of a triangle packed as in serial_decoder.glsl.
void read_traversed(uint s, uint triangle) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  uint a = triangle & 63u;
  uint b = (triangle >> 8) & 63u;
  uint v = (triangle >> 16) & 63u;
  uint o = (triangle >> 24) & 63u;
  bool across = triangle >> 24 != NO_VERTEX;
  bool vectors = is_packed(s);
  uint field = place_field(s, PLACE_FIELD);
  uint mask = bits_mask(s);
  uvec2 from = vectors ? vertex_at(s, a) : uvec2(0u);
  uvec2 to = vectors ? vertex_at(s, b) : uvec2(0u);
  uvec2 beyond = vectors ? vertex_at(s, o) : uvec2(0u);
  uvec2 fields = uvec2(0u);
  for (uint c = 0u; c < n; c++) {
    uint at = c * field;
    uvec3 known = vectors ? uvec3(get_field(from, at, field), get_field(to, at, field),
                                  get_field(beyond, at, field))
                          : uvec3(value_at(s, c, a), value_at(s, c, b), value_at(s, c, o));
    uint value =
        (traversed_prediction(predictor, known.x, known.y, known.z, across) + next_residual(c)) &
        mask;
    if (vectors)
      fields |= put_field(at, value);
    else
      put_value(s, c, v, value);
  }
  if (vectors) put_vertex(s, v, fields);
}

// Boundary vertices without a value yet: inner vertices of private references.
mask64 waiting_vertices(HEADER_IN h) {
  mask64 waiting = mask_none();
  if (h.references == 0u) {
    waiting = the_boundary;
    for (uint k = 0u; k < mask_count(the_starts); k++)
      waiting = waiting & ~mask_bit(ids_before(k) & 63u);
  }
  for (mask64 rest = h.private_refs; mask_any(rest); rest = mask_clear_lsb(rest)) {
    Run run = run_of(mask_lsb(rest));
    for (uint i = 1u; i < run.steps; i++) waiting = waiting | mask_bit(id_at(run.rank + i));
  }
  return waiting;
}

// Reads the vertices that triangles introduce, in order; without waiting boundary vertices these
// are those of C. A root gate with a waiting a takes two steps: first a, predicted from b alone.
void read_all_traversed(uint s, mask64 waiting) {
  mask64 rest = mask_any(waiting) ? mask_below(triangle_count) : symbol_c;
  while (mask_any(rest) && error == ERROR_NONE) {
    uint t = mask_lsb(rest);
    uint triangle = triangle_at(t);
    uint a = triangle & 63u;
    uint b = (triangle >> 8) & 63u;
    uint v = (triangle >> 16) & 63u;
    bool introduces = true;
    if (mask_test(the_starts, t) && mask_test(waiting, a)) {
      waiting = waiting & ~mask_bit(a);
      triangle = pack4(b, b, a, b);
    } else {
      rest = mask_clear_lsb(rest);
      introduces = mask_test(symbol_c, t) || mask_test(waiting, v);
      waiting = waiting & ~mask_bit(v);
    }
    if (introduces) read_traversed(s, triangle);
  }
  if (mask_any(waiting)) error = ERROR_CLERS;
}

void run(HEADER_IN h, uint stream) {
  uint total = chain_vertices(h, 64u).x;
  bool chains = mask_any(h.owned_refs);
  mask64 waiting = waiting_vertices(h);
  uint traversed = mask_count(symbol_c) + mask_count(waiting);
  uint p = anchors_begin(h);
  uint count = mask_count(the_starts);
  for (uint s = 0u; s < stream_total; s++) {
    count = anchors_of(h, s, count);
    p = after_anchors(p, s, count);
  }
  uint codes = h.codes;
  uint chain_quotients = 0u;
  uint before = 0u;   // low bits of the interior of earlier streams
  uint skipped = 0u;  // quotients of the interior of earlier streams
  uint all = 0u;
  for (uint s = 0u; s < stream_total; s++) {
    uint n = stream_field(s, STREAM_ELEMENTS);
    if (chains) {
      uint code = code_at(codes, n, stream_field(s, STREAM_CHAIN_BASE));
      p += total * low_width(code, n, codes - WIDTH_BITS * n);
      if (code != CODE_FIXED) chain_quotients += total * n;
    }
    uint code = code_at(codes, n, stream_field(s, STREAM_INTERIOR_BASE));
    uint vertices = traversed + seam_vertices_of(h, s);
    if (s == stream) {
      residual_code = code;
      residual_widths = code == CODE_FIXED ? fixed_widths(codes - WIDTH_BITS * n, n) : uvec2(0u);
      before = all;
    }
    if (s < stream && code != CODE_FIXED) skipped += vertices * n;
    all += vertices * low_width(code, n, codes - WIDTH_BITS * n);
  }
  p = after_ones(p, chain_quotients);
  seek_low(p + before);
  unary = seek_unary(p + all);
  if (residual_code != CODE_FIXED) unary = seek_unary(after_ones(p + all, skipped));
  read_seams(h, stream);
  read_all_traversed(stream, waiting);
  if (max(unary.cursor, low_position) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

void main() {
  if (!open_pass() || part >= stream_end) return;
  run(open_header(), part);
  close_pass();
}

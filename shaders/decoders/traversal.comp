// The fifth pass, after chains.comp: the values of seams and of the vertices that triangles
// introduce, one thread per meshlet and stream (see next_stream). Streams of GEO get their
// residuals only, to which geo.comp adds the predictions.
// variants: bench:traversal.comp=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "decoders/passes.glsl"
#include "decoders/pass_residuals.glsl"

uint seam_vertices(HEADER_IN h, uint s) {
  uint count = 0u;
  for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest))
    count += run_of(mask_lsb(rest)).steps - 1u;
  return min(count, 64u);
}

// Finds the residuals of `stream`. Those of stream 0 lie before all others; unary parts lie before
// low bits.
void seek_residuals(HEADER_IN h, uint interior, uint stream, uint traversed) {
  uint codes = h.codes;
  bool chains = mask_any(h.owned_refs);
  uint p = interior;
  uint begin = p;
  uint low = 0u;  // low bits before those of the stream
  uint end = stream == 0u ? 1u : stream_total;
  for (uint s = 0u; s < end; s++) {
    uint n = stream_field(s, STREAM_ELEMENTS);
    if (chains) code_at(codes, s, true);
    uint code = code_at(codes, s, false);
    uint widths = codes - WIDTH_BITS * n;
    uint vertices = min(traversed + seam_vertices(h, s), 64u);
    uint ones = code == CODE_FIXED ? 0u : vertices * n;
    uint next = after_ones(p, ones);
    if (s == stream) {
      begin = p;
      residual_code = code;
      residual_widths = code == CODE_FIXED ? fixed_widths(widths, n) : uvec2(0u);
    }
    uint size = low_size(code, n, widths, vertices * n, next - p - ones);
    if (s < stream) low += size;
    p = next;
    if (s == 0u && stream != 0u) {
      p += low;
      low = 0u;
    }
  }
  seek_low(p + low);
  unary = seek_unary(begin);
}

void read_seams(HEADER_IN h, uint s) {
  for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    Run run = run_of(r);
    uint from = id_at(run.rank);
    mask64 inner = inner_ids(run);
    read_chain(Chain(run.steps, from, last_id(h, r, run), inner, false), s);
  }
}

// Reads vertex v of a triangle packed as in serial_decoder.glsl.
void read_traversed(uint s, uint triangle) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  bool predicted = predictor != PREDICT_GEO;
  uint a = triangle & 63u;
  uint b = (triangle >> 8) & 63u;
  uint v = (triangle >> 16) & 63u;
  uint o = (triangle >> 24) & 63u;
  bool across = triangle >> 24 != NO_VERTEX;
  bool vectors = is_packed(s);
  uint field = place_field(s, PLACE_FIELD);
  uint mask = bits_mask(s);
  bool loads = vectors && predicted;
  uvec2 from = loads ? vertex_at(s, a) : uvec2(0u);
  uvec2 to = loads ? vertex_at(s, b) : uvec2(0u);
  uvec2 beyond = loads ? vertex_at(s, o) : uvec2(0u);
  Weights weights;
  weights.exist = false;
  if (predictor == PREDICT_AFFINE) weights = traversed_weights(triangle);
  uvec2 fields = uvec2(0u);
  for (uint c = 0u; c < n; c++) {
    uint at = c * field;
    uint value = next_residual(c);
    if (predicted) {
      uvec3 known = vectors ? uvec3(get_field(from, at, field), get_field(to, at, field),
                                    get_field(beyond, at, field))
                            : uvec3(value_at(s, c, a), value_at(s, c, b), value_at(s, c, o));
      uint simple = traversed_prediction(predictor, known.x, known.y, known.z, across);
      value += weights.exist ? affine_point(weights, known.x, known.y, known.z) : simple;
    }
    if (vectors)
      fields |= put_field(at, value & mask);
    else
      put_value(s, c, v, value);
  }
  if (vectors) put_vertex(s, v, fields);
}

// Reads the vertices that triangles introduce, in order; without waiting boundary vertices these
// are those of C. A root gate with a waiting a takes two steps: first a, predicted from b alone.
void read_all_traversed(uint s, mask64 waiting) {
  mask64 rest = mask_any(waiting) ? mask_below(triangle_count) : symbol_c;
  uint following = TRIANGLE_AT(job_triangles(), mask_lsb(rest) & 63u);
  while (mask_any(rest) && error == ERROR_NONE) {
    uint t = mask_lsb(rest);
    uint triangle = following;
    uint a = triangle & 63u;
    uint b = (triangle >> 8) & 63u;
    uint v = (triangle >> 16) & 63u;
    bool introduces = true;
    if (mask_test(the_starts, t) && mask_test(waiting, a)) {
      waiting = waiting & ~mask_bit(a);
      triangle = pack4(b, b, a, b);
    } else {
      rest = mask_clear_lsb(rest);
      // Loaded early: the next vertex need not wait for it.
      following = TRIANGLE_AT(job_triangles(), mask_lsb(rest) & 63u);
      introduces = mask_test(symbol_c, t) || mask_test(waiting, v);
      waiting = waiting & ~mask_bit(v);
    }
    if (introduces) read_traversed(s, triangle);
  }
  if (mask_any(waiting)) error = ERROR_CLERS;
}

void main() {
  if (!open_pass(1u)) return;
  Header h = open_header();
  Places places = PLACES(job_meshlet);
  if (places.interior == NO_PLACE) return;
  uint traversed = mask_count(symbol_c) + mask_count(places.waiting);
  for (uint s = first_stream(); s < stream_end && error == ERROR_NONE; s = next_stream(s)) {
    seek_residuals(h, places.interior, s, traversed);
    read_seams(h, s);
    read_all_traversed(s, places.waiting);
    if (max(unary.cursor, low_position) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
  }
  close_pass();
}

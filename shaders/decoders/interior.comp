// The last passes, after chains.comp: the vertices that triangles introduce, one thread per stream.
// First stream 0; the others may depend on it.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET (push.end_stream - push.first_stream)
#include "decoders/passes.glsl"

uint triangle_at(uint t) { return Integers(job_triangles()).at[t & 63u]; }

// Reads vertex v of a triangle packed as in serial_decoder.glsl.
void read_traversed(uint s, uint triangle) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  uint a = triangle & 63u;
  uint b = (triangle >> 8) & 63u;
  uint v = (triangle >> 16) & 63u;
  uint o = (triangle >> 24) & 63u;
  bool across = triangle >> 24 != NO_VERTEX;
  // geo.comp has written the predictions of GEO.
  bool predicted =
      predictor == PREDICT_GEO_ALL || (predictor == PREDICT_GEO && !mask_test(the_boundary, v));
  Weights weights;
  weights.exist = false;
  if (predictor == PREDICT_AFFINE) weights = traversed_weights(triangle);
  bool vectors = is_packed(s);
  uint field = place_field(s, PLACE_FIELD);
  uint mask = bits_mask(s);
  uvec2 from = vectors ? vertex_at(s, a) : uvec2(0u);
  uvec2 to = vectors ? vertex_at(s, b) : uvec2(0u);
  uvec2 beyond = vectors ? vertex_at(s, o) : uvec2(0u);
  uvec2 point = predicted ? vertex_at(s, v) : uvec2(0u);
  uvec2 fields = uvec2(0u);
  for (uint c = 0u; c < n; c++) {
    uint at = c * field;
    uvec3 known = vectors ? uvec3(get_field(from, at, field), get_field(to, at, field),
                                  get_field(beyond, at, field))
                          : uvec3(value_at(s, c, a), value_at(s, c, b), value_at(s, c, o));
    uint prediction = weights.exist ? affine_point(weights, known.x, known.y, known.z)
                      : predicted
                          ? get_field(point, at, field)
                          : traversed_prediction(predictor, known.x, known.y, known.z, across);
    uint value = (prediction + next_residual(c)) & mask;
    if (vectors)
      fields |= put_field(at, value);
    else
      put_value(s, c, v, value);
  }
  if (vectors) put_vertex(s, v, fields);
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

void main() {
  if (!open_pass()) return;
  uint s = push.first_stream + part;
  if (s >= stream_end) return;
  Header h = open_header();
  StreamSections sections = sections_of(h.meshlet, s);
  seek_residuals(s, (sections.codes >> 8) & 255u, sections.interior_unary, sections.interior_low,
                 inner_vertices(seam_references(h, s)) * stream_field(s, STREAM_ELEMENTS));
  read_all_traversed(s, waiting_vertices(h));
  check_residuals();
  close_pass();
}

// After traversal.comp: adds the predictions of GEO to the residuals of the vertices that triangles
// introduce.
// variants: bench:geo.comp=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "decoders/passes.glsl"

shared ATOMIC_UINT shared_normals[WORKGROUP / 32u][192];  // sums of cross products at the vertices

// wanted: mask of the vertices with a prediction.
void add_triangle(uint triangle, mask64 wanted) {
  Triple normal = triangle_normal(triangle, geo_shift());
  for (uint corner = 0u; corner < 3u; corner++) {
    uint id = (triangle >> (8u * corner)) & 63u;
    if (!mask_test(wanted, id)) continue;
    uint place = 3u * id;
    ATOMIC_ADD(shared_normals[member][place], normal.x);
    ATOMIC_ADD(shared_normals[member][place + 1u], normal.y);
    ATOMIC_ADD(shared_normals[member][place + 2u], normal.z);
  }
}

void add_prediction(uint s, uint id) {
  OctPair point = octahedral_prediction(ATOMIC_LOAD(shared_normals[member][3u * id]),
                                        ATOMIC_LOAD(shared_normals[member][3u * id + 1u]),
                                        ATOMIC_LOAD(shared_normals[member][3u * id + 2u]),
                                        stream_field(s, STREAM_BITS) & 31u);
  uint field = place_field(s, PLACE_FIELD);
  uvec2 residuals = vertex_at(s, id);
  uint u = (point.u + get_field(residuals, 0u, field)) & bits_mask(s);
  uint v = (point.v + get_field(residuals, field, field)) & bits_mask(s);
  put_vertex(s, id, put_field(0u, u) | put_field(field, v));
}

void main() {
  bool live = open_pass(32u);
  uint summary = SUMMARY(job_place);
  uint triangles = live ? min(summary & 127u, 64u) : 0u;
  mask64 wanted = mask_none();
  if (live)
    wanted = mask_below((summary >> 8) & 127u) & ~(the_boundary & ~PLACES(job_meshlet).waiting);
  for (uint i = first_item; i < 192u; i += 32u) ATOMIC_STORE(shared_normals[member][i], 0u);
  barrier();
  for (uint t = first_item; t < triangles; t += 32u)
    add_triangle(TRIANGLE_AT(job_triangles(), t), wanted);
  barrier();
  for (uint i = first_item; i < mask_count(wanted); i += 32u) {
    uint id = nth_bit(wanted, i);
    for (uint s = 1u; s < stream_end; s++)
      if (stream_field(s, STREAM_PREDICTOR) == PREDICT_GEO) add_prediction(s, id);
  }
}

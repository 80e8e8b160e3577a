// Between the passes of interior.comp, for blobs that use GEO: the predictions of GEO at all
// interior vertices (GEO_ALL: at all vertices), in place of the values.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PER_MESHLET 32u
#include "decoders/passes.glsl"

shared uint group_normals[GROUP_MESHLETS * 192u];  // sums of cross products at the vertices

void main() {
  bool live = open_pass();  // contains barriers
  uint summary = live ? Summaries(push.summaries).of[job_place] : 0u;
  uint base = member * 192u;
  for (uint i = part; i < 192u; i += PER_MESHLET) group_normals[base + i] = 0u;
  barrier();
  for (uint t = part; t < (summary & 127u); t += PER_MESHLET) {
    uint triangle = Integers(job_triangles()).at[t & 63u];
    Triple normal = triangle_normal(triangle, geo_shift());
    for (uint corner = 0u; corner < 3u; corner++) {
      uint place = base + 3u * ((triangle >> (8u * corner)) & 63u);
      atomicAdd(group_normals[place], normal.x);
      atomicAdd(group_normals[place + 1u], normal.y);
      atomicAdd(group_normals[place + 2u], normal.z);
    }
  }
  barrier();
  if (!live) return;
  uint vertices = (summary >> 8) & 127u;
  mask64 waiting = waiting_vertices(open_header());
  for (uint item = part; item < vertices * stream_end; item += PER_MESHLET) {
    uint s = item / vertices;
    uint id = (item - s * vertices) & 63u;
    if (!uses_geo(stream_field(s, STREAM_PREDICTOR)) || !is_packed(s)) continue;
    bool all = stream_field(s, STREAM_PREDICTOR) == PREDICT_GEO_ALL;
    if (mask_test(all ? the_boundary & ~waiting : the_boundary, id)) continue;
    uint place = base + 3u * id;
    OctPair point =
        octahedral_prediction(group_normals[place], group_normals[place + 1u],
                              group_normals[place + 2u], stream_field(s, STREAM_BITS) & 31u);
    put_vertex(s, id, put_field(0u, point.u) | put_field(place_field(s, PLACE_FIELD), point.v));
  }
}

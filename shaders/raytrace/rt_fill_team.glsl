// Decodes a meshlet for rt_fill.glsl with a team: WORKGROUP threads.
//
// needs: WORKGROUP
#ifndef RT_FILL_TEAM_GLSL
#define RT_FILL_TEAM_GLSL

#include "decoders/parallel_triangles.glsl"
#include "decoders/team_values.glsl"
#include "scene/scene.glsl"

uint fill_threads() { return WORKGROUP; }
uint fill_thread() { return THREAD; }

void decode_for_fill(Primitive primitive, uint meshlet) {
  share_streams(primitive.stream_end);
  open_team();
  Header h = read_header(meshlet);
  read_team_symbols(h);
  decode_connectivity();
  team_decode(h);
}

#endif

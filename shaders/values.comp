// Values of a blob's meshlets, by a team of TEAM lanes each: after connect.comp, or (PARALLEL) with the triangles from the parallel
// decoder of connectivity.
// variants: values8.comp=TEAM=8u values16.comp=TEAM=16u values32.comp=TEAM=32u values_parallel.comp=TEAM=32u,PARALLEL
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(local_size_x = 32) in;
#include "decode_push.glsl"
#include "meshlet_team.glsl"
#include "meshlet_decoder_prologue.glsl"
#include "meshlet_decoder.glsl"
#include "meshlet_decoder_epilogue.glsl"

uint team_meshlet;
#ifdef PARALLEL
#include "meshlet_parallel.glsl"
#else
uint packed_triangle(uint t) { return Integers(push.triangles).at[64u * team_meshlet + t]; }
uvec2 connectivity_boundary() { return Connectivity(push.connectivity).of[team_meshlet].boundary; }
uvec2 connectivity_starts() { return Connectivity(push.connectivity).of[team_meshlet].starts; }
#endif
#include "meshlet_workgroup.glsl"

void main() {
  open_blob(push.blob, push.blob_words);
  group_streams(push.streams);
  uint m = gl_WorkGroupID.x * TEAMS + TEAM_INDEX;
  bool exists = m < push.meshlets;
  team_meshlet = min(m, push.meshlets - 1u);
  open_team(team_meshlet);
  Header h = read_header(team_meshlet);
  read_symbols(h.begin, h.triangles);
  Summaries summaries = Summaries(push.summaries);
#ifdef PARALLEL
  bool sound = exists;
  decode_connectivity();
#else
  bool sound = exists && summaries.of[team_meshlet] >> 16 == ERROR_NONE;
#endif
  team_decode(h, sound);
  if (!sound) return;
#ifdef PARALLEL
  if (MEMBER == 0u) summaries.of[m] = triangle_count | vertex_count << 8;
  for (uint t = MEMBER; t < triangle_count; t += TEAM) Integers(push.triangles).at[64u * m + t] = packed_triangle(t);
  barrier();
#endif
  if (error != ERROR_NONE) {
    if (MEMBER == 0u) summaries.of[m] = error << 16;
    return;
  }
  Integers integers = Integers(push.integers);
  for (uint i = MEMBER; i < push.lanes * 64u; i += TEAM)
    if ((i & 63u) < vertex_count) integers.at[m * push.lanes * 64u + i] = team_values[TEAM_INDEX][i];
}

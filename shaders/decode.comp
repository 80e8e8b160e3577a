// Decodes meshlets into plain buffers: by one workgroup per meshlet, or (SINGLE_LANE) by one invocation per meshlet with the decoder
// that C++ shares. The oracle of the tests, and what raw decoding costs.
// variants: decode.comp= decode_single.comp=SINGLE_LANE
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(local_size_x = 32) in;
layout(constant_id = 2) const uint KEEP = 1u;     // 0: integers are only summed up, to time decoding without its output

layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer Out { uint at[]; };

layout(push_constant) uniform Push {
  uvec2 blob;
  uvec2 summaries;       // 2 words per meshlet: triangles | vertices << 8 | error << 16, and 0
  uvec2 triangles;       // 64 words per meshlet, packed
  uvec2 integers;        // lanes x 64 words per meshlet
  uint blob_words;
  uint meshlet_begin;
  uint meshlet_end;
  uint stream_end_of_all;
  uint lanes;
} push;

#include "meshlet_decoder_prologue.glsl"
#include "meshlet_decoder.glsl"
#include "meshlet_decoder_epilogue.glsl"
#ifndef SINGLE_LANE
#include "meshlet_workgroup.glsl"
#endif

void main() {
  open_blob(push.blob, push.blob_words);
  Out summaries = Out(push.summaries);
  Out packed = Out(push.triangles);
  Out integers = Out(push.integers);
#ifdef SINGLE_LANE
  uint m = push.meshlet_begin + gl_GlobalInvocationID.x;
  if (m >= push.meshlet_end) return;
  load_streams(0u, push.stream_end_of_all);
  decode_meshlet(m);
  if (error != ERROR_NONE) { triangle_count = 0u; vertex_count = 0u; }
  summaries.at[m] = triangle_count | vertex_count << 8 | error << 16;
  for (uint t = 0u; t < triangle_count; t++) packed.at[64u * m + t] = triangles[t];
  for (uint lane = 0u; lane < push.lanes; lane++)
    for (uint v = 0u; v < vertex_count; v++) integers.at[(m * push.lanes + lane) * 64u + v] = values[lane * 64u + v];
#else
  uint m = push.meshlet_begin + gl_WorkGroupID.x;
  group_streams(push.stream_end_of_all);
  group_decode(m);
  if (LANE == 0u) summaries.at[m] = triangle_count | vertex_count << 8 | group_error << 16;
  for (uint t = LANE; t < triangle_count; t += GROUP) packed.at[64u * m + t] = group_triangles[t];
  for (uint lane = 0u; lane < push.lanes; lane++)
    for (uint v = LANE; v < vertex_count; v += GROUP) integers.at[(m * push.lanes + lane) * 64u + v] = group_values[lane * 64u + v];
#endif
}

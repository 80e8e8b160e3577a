// Connectivity of a blob's meshlets by decoder B, one invocation per meshlet: triangles into the buffer that is also the result, and
// what values.comp needs to know about them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(local_size_x = 32) in;
#define MAX_LANES 1u
#include "decode_push.glsl"
// No arrays of an invocation's own, which would be in slow memory; and four apices to a word, since the less shared memory a group takes, the
// more groups run at once.
shared uint apexes[16 * 32];
#define APEX_WORD(t) apexes[((t) >> 2) * 32u + gl_LocalInvocationIndex]
#define APEX(t) bitfieldExtract(APEX_WORD(t), int(((t) & 3u) * 8u), 8)
#define SET_APEX(t, v) APEX_WORD(t) = bitfieldInsert(APEX_WORD(t), v, int(((t) & 3u) * 8u), 8)
#define TRIANGLE(t) Integers(push.triangles).at[64u * gl_GlobalInvocationID.x + (t)]
#include "meshlet_decoder_prologue.glsl"
#include "meshlet_decoder.glsl"
#include "meshlet_decoder_epilogue.glsl"
#include "meshlet_connect.glsl"

void main() {
  uint m = gl_GlobalInvocationID.x;
  if (m >= push.meshlets) return;
  open_blob(push.blob, push.blob_words);
  connect(m);
  Connectivity connectivity = Connectivity(push.connectivity);
  connectivity.of[m].boundary = boundary;
  connectivity.of[m].starts = component_starts;
  Summaries(push.summaries).of[m] = triangle_count | vertex_count << 8 | error << 16;
}

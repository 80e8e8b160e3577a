// Decodes one meshlet per invocation and writes what it found: a check that the shared decoder is GLSL, and what it gives there.
// The host has checked the blob's header, and that its streams fit MAX_STREAMS and MAX_LANES.
#version 450
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 32) in;
layout(std430, binding = 0) readonly buffer Blob { uint blob_words[]; };

struct Meshlet {
  uint problem;                            // an ERROR_ constant; nothing else is valid where it is not 0
  uint triangle_total;
  uint vertex_total;
  uint packed_triangles[64];
  uint lanes[20 * 64];                     // MAX_LANES x local ids
};
layout(std430, binding = 1) writeonly buffer Meshlets { Meshlet meshlets[]; };

#include "meshlet_decoder_prologue.glsl"
#include "meshlet_decoder.glsl"
#include "meshlet_decoder_epilogue.glsl"

void main() {
  uint m = gl_GlobalInvocationID.x;
  if (m >= uint(meshlets.length())) return;
  load_streams(0u, (load_word(1u) >> 8) & 255u);
  decode_meshlet(m);
  meshlets[m].problem = error;
  meshlets[m].triangle_total = triangle_count;
  meshlets[m].vertex_total = vertex_count;
  for (uint t = 0u; t < triangle_count; t++) meshlets[m].packed_triangles[t] = triangles[t];
  for (uint i = 0u; i < MAX_LANES * 64u; i++) meshlets[m].lanes[i] = values[i];
}

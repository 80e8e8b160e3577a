// Decodes all meshlets of a blob, one thread each. The engine's part is everything but the include:
// buffers, capacities, and where results go. Contract: docs/shaders.md.
#version 450
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 32) in;

layout(std430, binding = 0) readonly buffer Blob { uint blob[]; };
layout(std430, binding = 1) writeonly buffer Summaries { uint summaries[]; };
layout(std430, binding = 2) writeonly buffer Triangles { uint all_triangles[]; };
layout(std430, binding = 3) writeonly buffer Values { uint all_values[]; };
layout(push_constant) uniform Job { uint blob_words, meshlets, streams, elements; };

#define BLOB_WORD(i) blob[i]
#define blob_word_total blob_words
#define MAX_STREAMS 8u
#define MAX_ELEMENTS 20u
#include "gltf_meshlet.glsl"

void main() {
  uint m = gl_GlobalInvocationID.x;
  if (m >= meshlets) return;
  load_streams(0u, streams);
  decode_meshlet(m);
  summaries[m] = triangle_count | vertex_count << 8 | error << 16;
  if (error != ERROR_NONE) return;
  for (uint t = 0u; t < triangle_count; t++) all_triangles[64u * m + t] = triangles[t];
  for (uint e = 0u; e < elements; e++)
    for (uint v = 0u; v < vertex_count; v++)
      all_values[64u * (elements * m + e) + v] = values[64u * e + v];
}

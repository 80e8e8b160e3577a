// Decodes all meshlets of a blob, one thread each, in HLSL or Slang. The engine's part is
// everything but the include: buffers, capacities, and where results go. Contract: docs/shaders.md.
struct Job {
  uint blob_words, meshlets, streams, elements;
};
[[vk::push_constant]] ConstantBuffer<Job> job;
[[vk::binding(0)]] StructuredBuffer<uint> blob : register(t0);
[[vk::binding(1)]] RWStructuredBuffer<uint> summaries : register(u0);
[[vk::binding(2)]] RWStructuredBuffer<uint> all_triangles : register(u1);
[[vk::binding(3)]] RWStructuredBuffer<uint> all_values : register(u2);

#define BLOB_WORD(i) blob[i]
#define blob_word_total job.blob_words
#define MAX_STREAMS 8u
#define MAX_ELEMENTS 20u
#include "gltf_meshlet.hlsl"

[numthreads(32, 1, 1)] void main(uint3 id : SV_DispatchThreadID) {
  uint m = id.x;
  if (m >= job.meshlets) return;
  load_streams(0u, job.streams);
  decode_meshlet(m);
  summaries[m] = triangle_count | vertex_count << 8 | error << 16;
  if (error != ERROR_NONE) return;
  for (uint t = 0u; t < triangle_count; t++) all_triangles[64u * m + t] = triangles[t];
  for (uint e = 0u; e < job.elements; e++)
    for (uint v = 0u; v < vertex_count; v++)
      all_values[64u * (job.elements * m + e) + v] = values[64u * e + v];
}

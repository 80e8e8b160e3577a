// After ranges.comp: the indices of all triangles. Vertex v of meshlet m is vertex 64 m + v.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;
#include "decoders/decode_push.glsl"

void main() {
  uint m = push.first + gl_WorkGroupID.x;
  uint t = gl_LocalInvocationIndex;
  open_job(m);
  uint summary = SUMMARY(m);
  if (summary >> 16 != ERROR_NONE || t >= (summary & 127u)) return;
  uint triangle = TRIANGLE_AT(job_triangles(), t);
  uint at = 3u * (first_triangles[m] + t);
  for (uint c = 0u; c < 3u; c++)
    results[at + c] = MESHLET_VERTICES * m + ((triangle >> (8u * c)) & 63u);
}

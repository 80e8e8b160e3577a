// Decodes the triangles of one meshlet per workgroup, one lane per triangle: a check that the parallel decoder of connectivity is
// GLSL, and what it gives there. The host has checked the blob's header, and set every problem to 0.
#version 450
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Blob { uint blob_words[]; };

struct Connectivity {
  uint problem;                            // an ERROR_ constant; nothing else is valid where it is not 0
  uint triangle_total;
  uint packed_triangles[64];
};
layout(std430, binding = 1) buffer Meshlets { Connectivity meshlets[]; };

#include "meshlet_decoder_prologue.glsl"
#include "meshlet_decoder.glsl"
#include "meshlet_decoder_epilogue.glsl"

#define SHARED shared
#define OR_MASK(target, mask) (atomicOr((target).x, (mask).x), atomicOr((target).y, (mask).y))
#define ADD(target, value) atomicAdd(target, value)
#include "parallel_connectivity.glsl"

void main() {
  uint m = gl_WorkGroupID.x;
  uint t = gl_LocalInvocationID.x;
  load_streams(0u, 0u);
  error = ERROR_NONE;
  Header h = read_header(m);
  read_symbols(h.begin, h.triangles);
  parallel_step_0(t);
  barrier();
  parallel_step_1(t);
  barrier();
  parallel_step_2(t);
  barrier();
  parallel_step_3(t);
  barrier();
  parallel_step_4(t);
  barrier();
  parallel_step_5(t);
  barrier();
  parallel_step_6(t);
  if (m >= uint(meshlets.length())) return;
  if (error != ERROR_NONE) atomicMax(meshlets[m].problem, error);
  if (t == 0u) meshlets[m].triangle_total = triangle_count;
  if (t < triangle_count) meshlets[m].packed_triangles[t] = triangles[t];
}

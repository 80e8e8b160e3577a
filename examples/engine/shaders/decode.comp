// Decodes the meshlets of one page, one thread each, to floats.
#version 450
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 32) in;

layout(std430, binding = 0) readonly buffer Pages { uint pages[]; };
layout(std430, binding = 1) buffer Meshlets { uint meshlets[]; };
layout(std430, binding = 2) buffer Errors { uint malformed; };
layout(push_constant) uniform Job {
  uint page_begin, page_words;       // in `pages`
  uint first, count;                 // meshlets of the page, and where the first one goes
  uint stream_count, normal_stream;  // to decode; the stream of normals, or NO_NORMALS
};
const uint NO_NORMALS = 0xFFFFFFFFu;

#include "../layout.h"
#define BLOB_WORD(i) pages[page_begin + (i)]
#define blob_word_total page_words
#include "gltf_meshlet.glsl"

uint value(uint s, uint c, uint v) { return values[64u * (stream_element[s] + c) + v]; }

// Dequantisation, appendix B of the specification: a row of the stream table has the step after
// two words, then the offsets.
vec3 position(uint v) {
  uint row = STREAM_SHAPE_WORD(0u) + 2u;
  float step = uintBitsToFloat(BLOB_WORD(row));
  vec3 at;
  for (uint c = 0u; c < 3u; c++)
    at[c] = uintBitsToFloat(BLOB_WORD(row + 1u + c)) + float(value(0u, c, v)) * step;
  return at;
}

// Of two octahedral integers.
vec3 normal(uint s, uint v) {
  uint bits = (BLOB_WORD(STREAM_SHAPE_WORD(s)) >> 16) & 255u;
  float scale = 2.0 / float((1u << bits) - 2u);
  vec2 p = vec2(float(value(s, 0u, v)), float(value(s, 1u, v))) * scale - 1.0;
  float z = 1.0 - abs(p.x) - abs(p.y), fold = max(-z, 0.0);
  p.x -= p.x < 0.0 ? -fold : fold;
  p.y -= p.y < 0.0 ? -fold : fold;
  return normalize(vec3(p, z));
}

void put(uint at, vec3 v) {
  for (uint c = 0u; c < 3u; c++) meshlets[at + c] = floatBitsToUint(v[c]);
}

void main() {
  uint m = gl_GlobalInvocationID.x;
  if (m >= count) return;
  uint to = MESHLET_WORDS * (first + m);
  load_streams(0u, stream_count);
  decode_meshlet(m);
  if (error != ERROR_NONE) {
    meshlets[to + MESHLET_COUNT] = 0u;
    atomicAdd(malformed, 1u);
    return;
  }
  meshlets[to + MESHLET_COUNT] = triangle_count;
  for (uint t = 0u; t < triangle_count; t++) meshlets[to + MESHLET_CORNERS + t] = triangles[t];
  for (uint v = 0u; v < vertex_count; v++) {
    uint point = to + MESHLET_POINTS + POINT_WORDS * v;
    put(point, position(v));
    put(point + 3u, normal_stream == NO_NORMALS ? vec3(0.0) : normal(normal_stream, v));
  }
}

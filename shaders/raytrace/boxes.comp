// Compute stage, once when a scene is loaded: the boxes of the acceleration structure, one for
// every GROUP_TRIANGLES triangles of each meshlet. One thread per meshlet; decodes positions
// only. Unused boxes, and those of malformed meshlets, are points, which no ray hits. (Vulkan
// specifies NaN for inactive boxes, but not every driver honours it.)
//
// Inputs: the blob, or (PLAIN) uncompressed meshlets.
// Outputs: boxes, or a box per meshlet, or both.
// variants: boxes.comp= boxes_plain.comp=PLAIN
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "raytrace/rt_common.glsl"
#ifndef PLAIN
#include "decoders/serial_prologue.glsl"
#define RESIDUALS 4u
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"
#include "decoders/serial_positions.glsl"
#endif

layout(local_size_x = BOXES_THREADS) in;

layout(push_constant) uniform BoxesPush {
  uvec2 frame;
  uvec2 sources;
  uvec2 first_triangles;
  uvec2 boxes;   // output, VkAabbPositionsKHR; or 0
  uvec2 bounds;  // output per meshlet: the union of its boxes, 6 floats; or 0
  uint meshlets;
}
push;

#define MARGIN 4e-6  // relative padding of a box, see main
vec3 low;
vec3 high;

void add(vec3 p) {
  low = min(low, p);
  high = max(high, p);
}

#ifdef PLAIN

uint plain_begin;

// The number of the meshlet's triangles.
uint open(Primitive primitive, Source source, uint number) {
  Counts firsts = Counts(push.first_triangles);
  plain_begin = firsts.at[number] - firsts.at[number - source.meshlet];
  return firsts.at[number + 1u] - firsts.at[number];
}

void add_triangle(Primitive primitive, uint t) {
  for (uint k = 0u; k < 3u; k++) {
    uint v = VERTEX_FLOATS * SceneWords(primitive.index_data).at[3u * (plain_begin + t) + k];
    SceneFloats floats = SceneFloats(primitive.vertex_data);
    add(vec3(floats.at[v], floats.at[v + 1u], floats.at[v + 2u]));
  }
}

#else

uint open(Primitive primitive, Source source, uint number) {
  open_blob(primitive.blob, primitive.blob_words);
  load_streams(0u, 1u);
  decode_positions(source.meshlet);
  return error == ERROR_NONE ? triangle_count : 0u;
}

void add_triangle(Primitive primitive, uint t) {
  for (uint k = 0u; k < 3u; k++) {
    uint v = (triangles[t] >> (8u * k)) & 255u;
    uvec3 q = uvec3(values[v], values[64u + v], values[128u + v]);
    add(POSITION_FLOATS ? position_value(primitive.position, q) : vec3(q));
  }
}

#endif

void put_box(uvec2 boxes, uint place, vec3 low, vec3 high) {
  SceneFloatsOut floats = SceneFloatsOut(byte_offset(boxes, 6u, place));
  for (uint c = 0u; c < 3u; c++) {
    floats.at[c] = low[c];
    floats.at[3u + c] = high[c];
  }
}

void main() {
  uint number = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x +
                gl_LocalInvocationIndex;
  if (number >= push.meshlets) return;
  const uint groups = MESHLET_TRIANGLES / GROUP_TRIANGLES;
  Source source = Sources(push.sources).at[number];
  Primitive primitive = Primitives(Frame(push.frame).primitives).at[source.primitive];
  uint count = open(primitive, source, number);
  vec3 first = vec3(0.0);
  vec3 lowest = vec3(uintBitsToFloat(0x7F800000u));
  vec3 highest = -lowest;
  for (uint g = 0u; g < groups; g++) {
    low = vec3(uintBitsToFloat(0x7F800000u));
    high = -low;
    for (uint t = g * GROUP_TRIANGLES; t < min(count, (g + 1u) * GROUP_TRIANGLES); t++)
      add_triangle(primitive, t);
    // Pad for rounding in the driver's traversal, and give flat groups a thickness.
    vec3 farthest = max(abs(low), abs(high));
    float margin = max(farthest.x, max(farthest.y, farthest.z)) * MARGIN;
    low -= margin;
    high += margin;
    if (g == 0u && count > 0u) first = 0.5 * (low + high);
    if (g * GROUP_TRIANGLES >= count) low = high = first;
    lowest = min(lowest, low);
    highest = max(highest, high);
    if (push.boxes != uvec2(0u)) put_box(push.boxes, number * groups + g, low, high);
  }
  if (push.bounds != uvec2(0u)) put_box(push.bounds, number, lowest, highest);
}

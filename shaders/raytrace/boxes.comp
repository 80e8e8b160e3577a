// Compute stage, once when a scene is loaded: the boxes of the acceleration structure, one for
// every GROUP_TRIANGLES triangles of each meshlet. One thread per meshlet; decodes positions
// only. Unused boxes, and those of malformed meshlets, are points, which no ray hits. (Vulkan
// specifies NaN for inactive boxes, but not every driver honours it.)
//
// Inputs: the blob, or (PLAIN) uncompressed meshlets.
// Outputs: boxes, and if wanted a box per meshlet and the owners of its boundaries.
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
  uvec2 traced;
  uvec2 first_triangles;
  uvec2 boxes;  // VkAabbPositionsKHR
  uint primitive;
  uint meshlets;  // of the primitive
  uvec2 bounds;   // output per meshlet: the union of its boxes, 6 floats; or 0
  uvec2 owners;   // output per meshlet: NEIGHBOURS words of CacheState.owners; or 0
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

uint open(Traced traced, uint m) {
  Counts firsts = Counts(push.first_triangles);
  uint number = traced.first_meshlet + m;
  plain_begin = firsts.at[number] - firsts.at[traced.first_meshlet];
  return firsts.at[number + 1u] - firsts.at[number];
}

void add_triangle(Traced traced, uint t) {
  for (uint k = 0u; k < 3u; k++) {
    uint v = VERTEX_FLOATS * SceneWords(traced.indices).at[3u * (plain_begin + t) + k];
    SceneFloats floats = SceneFloats(traced.vertices);
    add(vec3(floats.at[v], floats.at[v + 1u], floats.at[v + 2u]));
  }
}

#else

Attribute position;

// The number of its triangles.
uint open(Traced traced, uint m) {
  open_blob(traced.blob, traced.blob_words);
  load_streams(0u, 1u);
  decode_positions(m);
  position = Primitives(Frame(push.frame).primitives).at[push.primitive].position;
  return error == ERROR_NONE ? triangle_count : 0u;
}

void add_triangle(Traced traced, uint t) {
  for (uint k = 0u; k < 3u; k++) {
    uint v = (triangles[t] >> (8u * k)) & 255u;
    uvec3 q = uvec3(values[v], values[64u + v], values[128u + v]);
    add(POSITION_FLOATS ? position_value(position, q) : vec3(q));
  }
}

// Writes the meshlets that own boundary vertices of the decoded one.
void write_owners(uint first_meshlet, uint m) {
  uint found[NEIGHBOURS];
  uint count = 0u;
  for (mask64 rest = opened.foreign_refs;
       mask_any(rest) && count < NEIGHBOURS && error == ERROR_NONE; rest = mask_clear_lsb(rest)) {
    uint owner = reference_owner[mask_lsb(rest)];
    bool listed = owner >= push.meshlets;
    for (uint i = 0u; i < count; i++) listed = listed || found[i] == owner;
    if (!listed) found[count++] = owner;
  }
  for (uint i = 0u; i < NEIGHBOURS; i++)
    Counts(push.owners).at[NEIGHBOURS * (first_meshlet + m) + i] =
        i < count ? first_meshlet + found[i] : NO_SLOT;
}

#endif

void main() {
  uint m = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x +
           gl_LocalInvocationIndex;
  if (m >= push.meshlets) return;
  const uint groups = MESHLET_TRIANGLES / GROUP_TRIANGLES;
  Traced traced = TracedList(push.traced).at[push.primitive];
  uint count = open(traced, m);
#ifndef PLAIN
  if (push.owners != uvec2(0u)) write_owners(traced.first_meshlet, m);
#endif
  SceneFloatsOut boxes = SceneFloatsOut(push.boxes);
  vec3 first = vec3(0.0);
  vec3 lowest = vec3(uintBitsToFloat(0x7F800000u));
  vec3 highest = -lowest;
  for (uint g = 0u; g < groups; g++) {
    low = vec3(uintBitsToFloat(0x7F800000u));
    high = -low;
    for (uint t = g * GROUP_TRIANGLES; t < min(count, (g + 1u) * GROUP_TRIANGLES); t++)
      add_triangle(traced, t);
    // Pad for rounding in the driver's traversal, and give flat groups a thickness.
    vec3 farthest = max(abs(low), abs(high));
    float margin = max(farthest.x, max(farthest.y, farthest.z)) * MARGIN;
    low -= margin;
    high += margin;
    if (g == 0u && count > 0u) first = 0.5 * (low + high);
    if (g * GROUP_TRIANGLES >= count) low = high = first;
    lowest = min(lowest, low);
    highest = max(highest, high);
    for (uint c = 0u; c < 3u; c++) {
      boxes.at[6u * (m * groups + g) + c] = low[c];
      boxes.at[6u * (m * groups + g) + 3u + c] = high[c];
    }
  }
  if (push.bounds == uvec2(0u)) return;
  SceneFloatsOut bounds = SceneFloatsOut(push.bounds);
  for (uint c = 0u; c < 3u; c++) {
    bounds.at[6u * (traced.first_meshlet + m) + c] = lowest[c];
    bounds.at[6u * (traced.first_meshlet + m) + 3u + c] = highest[c];
  }
}

// Compute stage, once when a scene is loaded: the boxes of the acceleration structure, one for
// every BOX_TRIANGLES triangles of each meshlet. One thread per meshlet; decodes positions
// only. Unused boxes, and those of malformed meshlets, are points, which no ray hits. (Vulkan
// specifies NaN for inactive boxes, but not every driver honours it.)
//
// Input: the blob.
// Output: boxes.
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "raytrace/rt_common.glsl"
#include "scene/positions.glsl"

layout(local_size_x = BOXES_THREADS) in;

struct Box {  // VkAabbPositionsKHR
  float low[3];
  float high[3];
};
layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer Boxes { Box at[]; };

layout(push_constant) uniform BoxesPush {
  uvec2 frame;
  uvec2 sources;
  uvec2 boxes;  // output: BOXES for each meshlet
  uint meshlets;
}
push;

#define MARGIN 4e-6  // relative padding of a box, see put_boxes

void put_boxes(uint number) {
  Source source = Sources(push.sources).at[number];
  Primitive primitive = Primitives(Frame(push.frame).primitives).at[source.primitive];
  uint count = open_positions(primitive, source.meshlet);
  vec3 first = vec3(0.0);
  for (uint g = 0u; g < BOXES; g++) {
    vec3 low = vec3(uintBitsToFloat(0x7F800000u));
    vec3 high = -low;
    for (uint t = g * BOX_TRIANGLES; t < min(count, (g + 1u) * BOX_TRIANGLES); t++) {
      for (uint k = 0u; k < 3u; k++) {
        uvec3 q = position_integers(corner_of(t, k));
        vec3 p = POSITION_FLOATS ? position_value(primitive.position, q) : vec3(q);
        low = min(low, p);
        high = max(high, p);
      }
    }
    // Pad for rounding in the driver's traversal, and give flat boxes a thickness.
    vec3 farthest = max(abs(low), abs(high));
    float margin = max(farthest.x, max(farthest.y, farthest.z)) * MARGIN;
    low -= margin;
    high += margin;
    if (g == 0u && count > 0u) first = 0.5 * (low + high);
    if (g * BOX_TRIANGLES >= count) low = high = first;
    Boxes(push.boxes).at[number * BOXES + g] =
        Box(float[3](low.x, low.y, low.z), float[3](high.x, high.y, high.z));
  }
}

void main() {
  uint threads = gl_NumWorkGroups.x * BOXES_THREADS;
  for (uint number = gl_GlobalInvocationID.x; number < push.meshlets; number += threads)
    put_boxes(number);
}

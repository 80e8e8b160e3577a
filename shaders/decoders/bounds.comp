// Compute stage, once when a scene is loaded: bounds of meshlets, one thread per meshlet. Decodes
// positions only. For rasterising, a word for culling per meshlet of a primitive; for ray tracing,
// the boxes of the acceleration structure, one for every BOX_TRIANGLES triangles of each meshlet.
// Unused boxes, and those of malformed meshlets, are points, which no ray hits. (Vulkan specifies
// NaN for inactive boxes, but not every driver honours it.) One shader for both: the decoder is
// most of it.
//
// Inputs: the blobs.
// Output: Primitive.bounds (bounds.glsl), or boxes.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "raytrace/rt_common.glsl"
#include "decoders/bounds.glsl"
#include "decoders/positions.glsl"
layout(local_size_x = BOUNDS_THREADS) in;

struct Box {  // VkAabbPositionsKHR
  float low[3];
  float high[3];
};
layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer Boxes { Box at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer BoundsWords {
  uint at[];
};

layout(push_constant) uniform BoundsPush {
  uvec2 primitives;
  uint primitive;  // for culling
  uint meshlets;   // of the primitive, or of all
  uvec2 sources;   // for ray tracing
  uvec2 boxes;     // BOXES for each meshlet; 0: for culling
}
push;

// --- for culling ---

// sin(angle at a corner) below which rounding makes a triangle's normal unreliable.
const float THINNEST = 1e-4;

// Returns the normal of triangle t in grid units, not normalised. Sets `thin` if its direction is
// unreliable.
vec3 triangle_normal(uint t, inout bool thin) {
  ivec3 a = ivec3(position_integers(corner_of(t, 0u)));
  vec3 ab = vec3(ivec3(position_integers(corner_of(t, 1u))) - a);
  vec3 av = vec3(ivec3(position_integers(corner_of(t, 2u))) - a);
  vec3 normal = cross(ab, av);
  float size = length(normal);
  if (size > 0.0 && size < THINNEST * length(ab) * length(av)) thin = true;
  return normal;
}

// Bits 18 .. 31 of the bounds: the cone around the mean normal, or no cone.
uint cone_word() {
  bool thin = false;
  vec3 sum = vec3(0.0);
  for (uint t = 0u; t < triangle_count; t++) {
    vec3 normal = triangle_normal(t, thin);
    if (dot(normal, normal) > 0.0) sum += normalize(normal);
  }
  if (thin || dot(sum, sum) < 1e-6) return NO_CONE << 28;
  uint axis = axis_word(normalize(sum));
  vec3 direction = unit_of_oct(uvec2(axis >> 18, axis >> 23) & 31u, AXIS_BITS);
  float cosine = 1.0;
  for (uint t = 0u; t < triangle_count; t++) {
    vec3 normal = triangle_normal(t, thin);
    if (dot(normal, normal) > 0.0) cosine = min(cosine, dot(normalize(normal), direction));
  }
  return axis | sine_word(cosine);
}

// Bits 0 .. 17 of the bounds: the sphere around the centre of the box.
uint sphere_word(Primitive primitive) {
  vec3 low = vec3(3.4e38), high = vec3(-3.4e38);
  for (uint v = 0u; v < vertex_count; v++) {
    vec3 p = position_value(primitive.position, position_integers(v));
    low = min(low, p);
    high = max(high, p);
  }
  uint word = center_word((low + high) * 0.5, primitive.box_low.xyz, primitive.box_size.xyz);
  vec3 center = bounds_of(word, primitive.box_low.xyz, primitive.box_size.xyz).center;
  float radius = 0.0;
  for (uint v = 0u; v < vertex_count; v++)
    radius =
        max(radius, distance(center, position_value(primitive.position, position_integers(v))));
  return word | radius_word(radius, primitive.box_size.xyz);
}

// --- for ray tracing ---

#define MARGIN 4e-6  // relative padding of a box, see put_boxes

void put_boxes(Primitive primitive, uint count, uint number) {
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
  bool boxes = push.boxes != uvec2(0u);
  uint threads = gl_NumWorkGroups.x * BOUNDS_THREADS;
  for (uint number = gl_GlobalInvocationID.x; number < push.meshlets; number += threads) {
    Source source = Source(push.primitive, number);
    if (boxes) source = Sources(push.sources).at[number];
    Primitive primitive = Primitives(push.primitives).at[source.primitive];
    uint count = open_positions(primitive, source.meshlet);
    if (boxes)
      put_boxes(primitive, count, number);
    else
      BoundsWords(primitive.bounds).at[number] =
          count > 0u ? sphere_word(primitive) | cone_word() : NO_BOUNDS;
  }
}

// Compute stage, once when a scene is loaded: culling bounds of all meshlets of a primitive, one
// thread per meshlet. Decodes positions only.
//
// Inputs: the primitive's blob.
// Output: Primitive.bounds, a word per meshlet (bounds.glsl).
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "scene/bounds.glsl"
layout(local_size_x = BOUNDS_THREADS) in;
#include "scene/positions.glsl"

layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer BoundsWords {
  uint at[];
};

layout(push_constant) uniform BoundsPush {
  uvec2 primitives;
  uint primitive;
}
push;

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

void main() {
  Primitive primitive = Primitives(push.primitives).at[push.primitive];
  uint m = gl_GlobalInvocationID.x;
  if (m >= primitive.meshlets) return;
  bool sound = open_positions(primitive, m) > 0u;
  BoundsWords(primitive.bounds).at[m] = sound ? sphere_word(primitive) | cone_word() : NO_BOUNDS;
}

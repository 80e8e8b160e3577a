// A decoded vertex's attributes as floats. The includer defines LANE_VALUE(lane, id): the integer of a lane of a local vertex.
#ifndef DECODED_VERTEX_GLSL
#define DECODED_VERTEX_GLSL

#include "scene.glsl"

// In the primitive's coordinates.
vec3 decoded_position(Primitive p, uint v) {
  return position_value(p.position, uvec3(LANE_VALUE(0u, v), LANE_VALUE(1u, v), LANE_VALUE(2u, v)));
}

uvec4 decoded_integers(Attribute a, uint v) {
  uvec4 q = uvec4(0u);
  for (uint c = 0u; c < min(attribute_components(a), 4u); c++) q[c] = LANE_VALUE(a.lane + c, v);
  return q;
}

// In the primitive's coordinates; zero where it has none.
vec3 decoded_normal(Primitive p, uint v) {
  if (p.normal.lane == NO_LANE) return vec3(0.0);
  return normal_value(p.normal, decoded_integers(p.normal, v).xyz);
}

vec2 decoded_texcoord(Primitive p, uint v) {
  if (p.texcoord.lane == NO_LANE) return vec2(0.0);
  return attribute_value(p.texcoord, decoded_integers(p.texcoord, v)).xy;
}

// White where there is none, opaque where there are three components.
vec4 decoded_color(Primitive p, uint v) {
  if (p.color.lane == NO_LANE) return vec4(1.0);
  vec4 color = attribute_value(p.color, decoded_integers(p.color, v));
  return attribute_components(p.color) == 4u ? color : vec4(color.rgb, 1.0);
}

#endif

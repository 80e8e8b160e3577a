// A decoded vertex's attributes as floats. The includer also defines the two functions that are
// declared below: decoders/slot_vertex.glsl or decoders/value_vertex.glsl does.
//
// needs: vertex_integer, vertex_position
#ifndef DECODED_VERTEX_GLSL
#define DECODED_VERTEX_GLSL

#include "decoders/slots.glsl"

// Element c of an attribute of vertex v. place: of the attribute's bits in a slot.
uint vertex_integer(Attribute a, uint place, uint c, uint v);
// In object coordinates.
vec3 vertex_position(Primitive p, uint v);

uvec4 decoded_integers(Attribute a, uint place, uint v) {
  uvec4 q = uvec4(0u);
  for (uint c = 0u; c < min(attribute_elements(a), 4u); c++) q[c] = vertex_integer(a, place, c, v);
  return q;
}

// Returns object coordinates; zero if the primitive has no normals.
vec3 vertex_normal(Primitive p, uint v) {
  if (p.normal.element == NO_ELEMENT) return vec3(0.0);
  return normal_value(p.normal, decoded_integers(p.normal, NORMAL_PLACE, v).xyz);
}

vec2 vertex_texcoord(Primitive p, uint v) {
  if (p.texcoord.element == NO_ELEMENT) return vec2(0.0);
  return attribute_value(p.texcoord, decoded_integers(p.texcoord, texcoord_place(p.normal), v)).xy;
}

// Returns white if the primitive has no colours; alpha is 1 if they have three elements.
vec4 vertex_color(Primitive p, uint v) {
  if (p.color.element == NO_ELEMENT) return vec4(1.0);
  vec4 color =
      attribute_value(p.color, decoded_integers(p.color, color_place(p.normal, p.texcoord), v));
  return attribute_elements(p.color) == 4u ? color : vec4(color.rgb, 1.0);
}

#endif

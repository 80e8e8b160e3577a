// A decoded vertex's attributes as floats. Before including this file, either define
// ELEMENT_VALUE(element, id), the integer of an element of a local vertex, or include slots.glsl
// and define SLOT, the address of the meshlet's slot.
#ifndef DECODED_VERTEX_GLSL
#define DECODED_VERTEX_GLSL

#include "scene/scene.glsl"

#ifdef SLOT
#ifndef VALUE  // an includer may define both, to read some meshlets from elsewhere
#define VALUE(a, place, c, v) \
  slot_bits(SLOT, v, (place) + (c) * attribute_field(a), attribute_bits(a))
#define POSITION(p, v) slot_object_position(SLOT, p.position, v)
#endif
#define PLACE(place) place  // offset of the attribute's bits in the vertex
#else
#define VALUE(a, place, c, v) ELEMENT_VALUE(a.element + (c), v)
#define POSITION(p, v)       \
  position_value(p.position, \
                 uvec3(ELEMENT_VALUE(0u, v), ELEMENT_VALUE(1u, v), ELEMENT_VALUE(2u, v)))
#define PLACE(place) 0u
#endif

// Returns object coordinates.
vec3 vertex_position(Primitive p, uint v) { return POSITION(p, v); }

uvec4 decoded_integers(Attribute a, uint place, uint v) {
  uvec4 q = uvec4(0u);
  for (uint c = 0u; c < min(attribute_elements(a), 4u); c++) q[c] = VALUE(a, place, c, v);
  return q;
}

// Returns object coordinates; zero if the primitive has no normals.
vec3 vertex_normal(Primitive p, uint v) {
  if (p.normal.element == NO_ELEMENT) return vec3(0.0);
  return normal_value(p.normal, decoded_integers(p.normal, PLACE(NORMAL_PLACE), v).xyz);
}

vec2 vertex_texcoord(Primitive p, uint v) {
  if (p.texcoord.element == NO_ELEMENT) return vec2(0.0);
  return attribute_value(p.texcoord,
                         decoded_integers(p.texcoord, PLACE(texcoord_place(p.normal)), v))
      .xy;
}

// Returns white if the primitive has no colours; alpha is 1 if they have three elements.
vec4 vertex_color(Primitive p, uint v) {
  if (p.color.element == NO_ELEMENT) return vec4(1.0);
  vec4 color = attribute_value(
      p.color, decoded_integers(p.color, PLACE(color_place(p.normal, p.texcoord)), v));
  return attribute_elements(p.color) == 4u ? color : vec4(color.rgb, 1.0);
}

#endif

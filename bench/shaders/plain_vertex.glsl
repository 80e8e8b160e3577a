// The uncompressed model, and a vertex's attributes by the names of decoded_vertex.glsl.
// PLAIN_ADDRESS: of a PlainPrimitive for each primitive of the scene.
//
// needs: ATTRIBUTES, PLAIN_ADDRESS
#ifndef PLAIN_VERTEX_GLSL
#define PLAIN_VERTEX_GLSL

#include "scene/scene.glsl"

struct PlainPrimitive {
  uvec2 vertices;  // floats: position 3, then normal 3, texture coordinates 2 and colour 4, each
                   // only if any primitive of the scene has it
  uvec2 indices;   // 3 words per triangle, in the order of the meshlets
  uvec2 meshlets;  // a PlainMeshlet each
  uvec2 words;     // of the meshlets: vertex numbers, then triangles a | b << 8 | v << 16
};
struct PlainMeshlet {
  uint first;   // in PlainPrimitive.words
  uint counts;  // vertices | triangles << 8
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer PlainPrimitives {
  PlainPrimitive at[];
};
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer PlainMeshlets {
  PlainMeshlet at[];
};
PlainPrimitive plain_primitive(uint primitive) {
  return PlainPrimitives(PLAIN_ADDRESS).at[primitive];
}

// Floats of the attributes whose bits are in `bits`.
uint attribute_floats(uint bits) {
  bits &= ATTRIBUTES;
  return ((bits & HAS_NORMAL) != 0u ? 3u : 0u) + ((bits & HAS_TEXCOORD) != 0u ? 2u : 0u) +
         ((bits & HAS_COLOR) != 0u ? 4u : 0u);
}

// Float `at` of vertex v.
float plain_float(PlainPrimitive p, uint v, uint at) {
  return SceneFloats(p.vertices).at[v * (3u + attribute_floats(~0u)) + at];
}

vec3 vertex_position(PlainPrimitive p, uint v) {
  return vec3(plain_float(p, v, 0u), plain_float(p, v, 1u), plain_float(p, v, 2u));
}

// Returns zero without normals.
vec3 vertex_normal(PlainPrimitive p, uint v) {
  if ((ATTRIBUTES & HAS_NORMAL) == 0u) return vec3(0.0);
  return vec3(plain_float(p, v, 3u), plain_float(p, v, 4u), plain_float(p, v, 5u));
}

vec2 vertex_texcoord(PlainPrimitive p, uint v) {
  if ((ATTRIBUTES & HAS_TEXCOORD) == 0u) return vec2(0.0);
  uint at = 3u + attribute_floats(HAS_NORMAL);
  return vec2(plain_float(p, v, at), plain_float(p, v, at + 1u));
}

// Returns white without colours.
vec4 vertex_color(PlainPrimitive p, uint v) {
  if ((ATTRIBUTES & HAS_COLOR) == 0u) return vec4(1.0);
  uint at = 3u + attribute_floats(HAS_NORMAL | HAS_TEXCOORD);
  return vec4(plain_float(p, v, at), plain_float(p, v, at + 1u), plain_float(p, v, at + 2u),
              plain_float(p, v, at + 3u));
}

#endif

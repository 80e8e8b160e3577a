// An uncompressed vertex's attributes, by the names of decoded_vertex.glsl. Include after
// scene.glsl and the constant ATTRIBUTES: the HAS_ bits of the vertices.
#ifndef PLAIN_VERTEX_GLSL
#define PLAIN_VERTEX_GLSL

// Floats of the attributes whose bits are in `bits`.
uint attribute_floats(uint bits) {
  bits &= ATTRIBUTES;
  return ((bits & HAS_NORMAL) != 0u ? 3u : 0u) + ((bits & HAS_TEXCOORD) != 0u ? 2u : 0u) +
         ((bits & HAS_COLOR) != 0u ? 4u : 0u);
}

// Float `at` of vertex v.
float plain_float(Primitive p, uint v, uint at) {
  return SceneFloats(p.vertex_data).at[v * (3u + attribute_floats(~0u)) + at];
}

vec3 vertex_position(Primitive p, uint v) {
  return vec3(plain_float(p, v, 0u), plain_float(p, v, 1u), plain_float(p, v, 2u));
}

// Returns zero without normals.
vec3 vertex_normal(Primitive p, uint v) {
  if ((ATTRIBUTES & HAS_NORMAL) == 0u) return vec3(0.0);
  return vec3(plain_float(p, v, 3u), plain_float(p, v, 4u), plain_float(p, v, 5u));
}

vec2 vertex_texcoord(Primitive p, uint v) {
  if ((ATTRIBUTES & HAS_TEXCOORD) == 0u) return vec2(0.0);
  uint at = 3u + attribute_floats(HAS_NORMAL);
  return vec2(plain_float(p, v, at), plain_float(p, v, at + 1u));
}

// Returns white without colours.
vec4 vertex_color(Primitive p, uint v) {
  if ((ATTRIBUTES & HAS_COLOR) == 0u) return vec4(1.0);
  uint at = 3u + attribute_floats(HAS_NORMAL | HAS_TEXCOORD);
  return vec4(plain_float(p, v, at), plain_float(p, v, at + 1u), plain_float(p, v, at + 2u),
              plain_float(p, v, at + 3u));
}

#endif

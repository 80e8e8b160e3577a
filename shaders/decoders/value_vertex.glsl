// The vertices of the meshlet that this workgroup or thread has decoded.
//
// needs: decoded_value
#ifndef VALUE_VERTEX_GLSL
#define VALUE_VERTEX_GLSL

#include "decoders/decoded_vertex.glsl"

uint vertex_integer(Attribute a, uint place, uint c, uint v) {
  return decoded_value(a.element + c, v);
}

vec3 vertex_position(Primitive p, uint v) {
  return position_value(p.position,
                        uvec3(decoded_value(0u, v), decoded_value(1u, v), decoded_value(2u, v)));
}

#endif

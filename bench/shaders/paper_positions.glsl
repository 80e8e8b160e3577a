// Decodes the positions of a meshlet with one thread, and returns them in the coordinates in which
// rays are traced.
#ifndef PAPER_POSITIONS_GLSL
#define PAPER_POSITIONS_GLSL

#include "decoders/slots.glsl"

#define MAX_ELEMENTS 3u
#include "serial_positions.glsl"

// Returns the number of triangles, 0 if the meshlet is malformed.
uint open_positions_of(Primitive primitive, uint meshlet) {
  open_blob(primitive.blob, primitive.blob_words);
  load_streams(0u, 1u);
  decode_positions(meshlet);
  return error == ERROR_NONE ? triangle_count : 0u;
}

// Corner k of triangle t.
vec3 corner(Primitive primitive, uint t, uint k) {
  uvec3 q = position_of((triangles[t] >> (8u * k)) & 255u);
  return POSITION_FLOATS ? position_value(primitive.position, q) : vec3(q);
}

#endif

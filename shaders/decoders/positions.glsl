// Decodes the positions of a meshlet with one thread, for the shaders that run once on loading.
#ifndef POSITIONS_GLSL
#define POSITIONS_GLSL

#include "scene/scene.glsl"

#define MAX_ELEMENTS 3u
#include "decoders/serial.glsl"

// Returns the number of triangles, 0 if the meshlet is malformed.
uint open_positions(Primitive primitive, uint meshlet) {
  open_blob(primitive.blob, primitive.blob_words);
  load_streams(0u, 1u);
  decode_meshlet(meshlet);
  return error == ERROR_NONE ? triangle_count : 0u;
}

// Of vertex v, on the grid.
uvec3 position_integers(uint v) { return uvec3(values[v], values[64u + v], values[128u + v]); }

// Vertex k of triangle t.
uint corner_of(uint t, uint k) { return (triangles[t] >> (8u * k)) & 63u; }

#endif

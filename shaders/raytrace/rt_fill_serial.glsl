// Decodes a meshlet for rt_fill.glsl with a thread.
#ifndef RT_FILL_SERIAL_GLSL
#define RT_FILL_SERIAL_GLSL

#include "decoders/serial_values.glsl"
#include "scene/scene.glsl"

uint fill_threads() { return 1u; }
uint fill_thread() { return 0u; }
uint packed_triangle(uint t) { return triangles[t]; }

void decode_for_fill(Primitive primitive, uint meshlet) {
  load_streams(0u, primitive.stream_end);
  decode_meshlet(meshlet);
}

#endif

// Decodes a meshlet into a slot. rt_fill_team.glsl or rt_fill_serial.glsl says how; push: has
// frame, sources and cache.
//
// needs: push, raytrace/rt_fill_serial.glsl
#ifndef RT_FILL_GLSL
#define RT_FILL_GLSL

#include "decoders/slot_output.glsl"
#include "raytrace/rt_common.glsl"

// Decodes meshlet `number` into a slot. A malformed meshlet gets no triangles.
void fill(uint number, uint slot_number) {
  Source source = Sources(push.sources).at[number];
  Primitive primitive = Primitives(Frame(push.frame).primitives).at[source.primitive];
  open_blob(primitive.blob, primitive.blob_words);
  decode_for_fill(primitive, source.meshlet);
  uvec2 slot = slot_address(push.cache, slot_number);
  Counts words = Counts(slot);
  uint count = error == ERROR_NONE ? triangle_count : 0u;
  for (uint t = fill_thread(); t < MESHLET_TRIANGLES; t += fill_threads())
    words.at[t] = t < count ? packed_triangle(t) & 0xFFFFFFu : 0u;
  for (uint v = fill_thread(); v < MESHLET_VERTICES && v < vertex_count && error == ERROR_NONE;
       v += fill_threads())
    put_vertex(slot, primitive, v);
}

#endif

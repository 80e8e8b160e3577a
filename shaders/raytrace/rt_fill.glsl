// Decodes a meshlet into a slot with the team decoder, or (SERIAL) with the serial decoder. Include
// after rt_common.glsl and push constants that have frame, sources and cache.
#include "decoders/serial_prologue.glsl"
#ifdef SERIAL
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"
#define THREADS 1u  // of a meshlet
#define MEMBER 0u
layout(local_size_x = 32) in;
uint packed_triangle(uint t) { return triangles[t]; }
#else
#define WORKGROUP 32u
#define THREADS WORKGROUP
#define MEMBER THREAD
#define OWN_GRID_POSITION
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"
#include "decoders/team_connectivity.glsl"
#include "decoders/team_values.glsl"
layout(local_size_x = WORKGROUP) in;
#endif
#include "decoders/slot_output.glsl"

// Decodes meshlet `number` into a slot. A malformed meshlet gets no triangles.
void fill(uint number, uint slot_number) {
  Source source = Sources(push.sources).at[number];
  Primitive primitive = Primitives(Frame(push.frame).primitives).at[source.primitive];
  open_blob(primitive.blob, primitive.blob_words);
#ifdef SERIAL
  load_streams(0u, primitive.stream_end);
  decode_meshlet(source.meshlet);
#else
  share_streams(primitive.stream_end);
  open_team();
  Header h = read_header(source.meshlet);
  read_team_symbols(h);
  decode_connectivity();
  team_decode(h);
#endif
  uvec2 slot = slot_address(push.cache, slot_number);
  Counts words = Counts(slot);
  uint count = error == ERROR_NONE ? triangle_count : 0u;
  for (uint t = MEMBER; t < MESHLET_TRIANGLES; t += THREADS)
    words.at[t] = t < count ? packed_triangle(t) & 0xFFFFFFu : 0u;
  for (uint v = MEMBER; v < MESHLET_VERTICES && v < vertex_count && error == ERROR_NONE;
       v += THREADS)
    put_vertex(slot, primitive, v);
}

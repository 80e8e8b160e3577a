// Compute stage: decodes meshlets into slots with the team decoder, one workgroup per meshlet.
//
// Inputs: meshlets that follow each other by number, or a list; the blobs.
// Output: slots.
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "raytrace/rt_common.glsl"
#define TEAM 32u
#include "decoders/serial_prologue.glsl"
#define OWN_GRID_POSITION
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"
#include "decoders/team_connectivity.glsl"
#include "decoders/team_values.glsl"
#include "decoders/slot_output.glsl"

layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Items { uvec2 at[]; };

layout(local_size_x = GROUP) in;

layout(push_constant) uniform FillPush {
  uvec2 frame;
  uvec2 sources;
  uvec2 cache;
  uvec2 items;  // (meshlet, slot) each; 0: the next meshlets get the first slots
  uint first;   // the first of them
  uint count;
}
push;

// Decodes meshlet `number` into a slot. A malformed meshlet gets no triangles.
void fill(uint number, uint slot_number) {
  Source source = Sources(push.sources).at[number];
  Primitive primitive = Primitives(Frame(push.frame).primitives).at[source.primitive];
  open_blob(primitive.blob, primitive.blob_words);
  group_streams(primitive.stream_end);
  open_team();
  Header h = read_header(source.meshlet);
  read_team_symbols(h);
  decode_connectivity();
  team_decode(h, true);
  uvec2 slot = slot_address(push.cache, slot_number);
  Counts words = Counts(slot);
  uint count = error == ERROR_NONE ? triangle_count : 0u;
  for (uint t = MEMBER; t < MESHLET_TRIANGLES; t += TEAM)
    words.at[t] = t < count ? packed_triangle(t) & 0xFFFFFFu : 0u;
  for (uint v = MEMBER; v < MESHLET_VERTICES && v < vertex_count && error == ERROR_NONE; v += TEAM)
    put_vertex(slot, primitive, v);
}

void main() {
  for (uint i = gl_WorkGroupID.x; i < push.count; i += gl_NumWorkGroups.x) {
    uvec2 item = uvec2(push.first + i, i);
    if (push.items != uvec2(0u)) item = Items(push.items).at[i];
    fill(item.x, item.y);
    barrier();
  }
}

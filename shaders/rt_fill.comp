// Decodes meshlets into slots, one workgroup each: before a frame those that it will need, later those that paths wait for.
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "rt_common.glsl"
#include "rt_cache.glsl"
#define TEAM 32u
#include "meshlet_team.glsl"
#include "meshlet_decoder_prologue.glsl"
#include "meshlet_decoder.glsl"
#include "meshlet_decoder_epilogue.glsl"
#include "meshlet_parallel.glsl"
#include "meshlet_workgroup.glsl"
#include "slot_output.glsl"

layout(local_size_x = GROUP) in;

// The primitive that a meshlet belongs to.
uint primitive_of(uint number, uint primitives) {
  uint low = 0u;
  uint high = primitives;
  while (high - low > 1u) {
    uint middle = (low + high) >> 1;
    if (TracedList(push.traced).at[middle].first_meshlet <= number) low = middle;
    else high = middle;
  }
  return low;
}

void fill(uint number, uint slot_number, uint primitives) {
  uint index = primitive_of(number, primitives);
  Traced traced = TracedList(push.traced).at[index];
  Primitive primitive = Primitives(Frame(push.frame).primitives).at[index];
  open_blob(traced.blob, traced.blob_words);
  group_streams(primitive.stream_end);
  uint m = number - traced.first_meshlet;
  open_team(m);
  Header h = read_header(m);
  read_symbols(h.begin, h.triangles);
  decode_connectivity();
  team_decode(h, true);
  uvec2 slot = slot_address(push.cache, slot_number);
  Counts words = Counts(slot);
  uint count = error == ERROR_NONE ? triangle_count : 0u;
  for (uint t = MEMBER; t < MESHLET_TRIANGLES; t += TEAM) words.at[t] = t < count ? packed_triangle(t) & 0xFFFFFFu : 0u;
  for (uint v = MEMBER; v < MESHLET_VERTICES && v < vertex_count && error == ERROR_NONE; v += TEAM) put_vertex(slot, primitive, v);
  if (MEMBER == 0u) Counts(push.slot_table).at[number] = slot_number;
}

// The slot for the `index`-th meshlet of a round, of which the first `kept` are to be kept. The slots of kept ones begin the order or end it;
// those between are given away in turn.
uint slot_for(CacheState state, uint index, uint kept, uint cursor) {
  uint place = index < kept ? index : state.kept + (cursor + index - kept) % max(state.ring, 1u);
  return Counts(push.order).at[place];
}

void main() {
  CacheState state = CacheState(push.state);
  uint kept = push.round == 0u ? state.kept : 0u;
  uint count = min(state.rounds[push.round].requested, kept + state.ring);
  uint cursor = state.cursor;
  for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
    uint number = Counts(push.wanted).at[i < kept || push.round != 0u ? i : state.stable + i - kept];
    uint slot = slot_for(state, i, kept, cursor);
    if (gl_LocalInvocationIndex == 0u) {
      uint before = Counts(push.slot_meshlets).at[slot];
      if (before != NO_SLOT) Counts(push.slot_table).at[before] = NO_SLOT;
      Counts(push.slot_meshlets).at[slot] = number;
    }
    fill(number, slot, state.primitives);
    barrier();
  }
  memoryBarrierBuffer();
  if (gl_LocalInvocationIndex == 0u && atomicAdd(state.rounds[push.round].filled, 1u) == gl_NumWorkGroups.x - 1u)
    state.cursor = (cursor + count - kept) % max(state.ring, 1u);
}

// Compute stage: decodes meshlets into slots with the team decoder, one workgroup per meshlet.
// Runs once at the start to fill all slots; then in each frame before the first launch (meshlets
// that it will probably need), during it (meshlets that may be needed next), and before each
// later round (meshlets that paths wait for).
//
// Inputs: the lists of CacheState, the blobs.
// Outputs: slots and slot table.
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "raytrace/rt_common.glsl"
#include "raytrace/rt_cache.glsl"
#define TEAM 32u
#include "decoders/serial_prologue.glsl"
#define OWN_GRID_POSITION
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"
#include "decoders/team_connectivity.glsl"
#include "decoders/team_values.glsl"
#include "decoders/slot_output.glsl"
#define LISTED(list) state.listed[listed_at(state.frame, list)]
#include "raytrace/rt_order.glsl"

layout(local_size_x = GROUP) in;

// The primitive of a meshlet, by binary search.
uint primitive_of(uint number, uint primitives) {
  uint low = 0u;
  uint high = primitives;
  while (high - low > 1u) {
    uint middle = (low + high) >> 1;
    if (TracedList(push.traced).at[middle].first_meshlet <= number)
      low = middle;
    else
      high = middle;
  }
  return low;
}

// Decodes meshlet `number` into a slot. A malformed meshlet gets no triangles.
void fill(uint number, uint slot_number, uint primitives) {
  uint index = primitive_of(number, primitives);
  Traced traced = TracedList(push.traced).at[index];
  Primitive primitive = Primitives(Frame(push.frame).primitives).at[index];
  open_blob(traced.blob, traced.blob_words);
  group_streams(primitive.stream_end);
  uint m = number - traced.first_meshlet;
  open_team();
  Header h = read_header(m);
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

// Evicts the slot's meshlet, if it has one, and gives the slot to meshlet `number`.
void move(uint number, uint slot) {
  uint before = Counts(push.slot_meshlets).at[slot];
  if (before != NO_SLOT) Counts(push.slot_table).at[before] = NO_SLOT;
  Counts(push.slot_meshlets).at[slot] = number;
  Counts(push.slot_table).at[number] = slot;
}

// Item i of the round: (meshlet, slot).
uvec2 work(CacheState state, uint i, bool waited_for, uint cursor) {
  if (ALL_CACHED) return uvec2(i);
  if (push.round == state.coming_round) {
    // rt_cache.comp has assigned the slot; COMING keeps the concurrent launch away from it.
    uint number = Counts(push.lists).at[meshlet_place(state, state.kept + i)];
    return uvec2(number, Counts(push.slot_table).at[number] & SLOT_BITS);
  }
  uint place = waited_for ? list_begin(state, REQUESTS) + i : meshlet_place(state, i);
  uint order = waited_for ? state.kept + (cursor + i) % max(state.ring, 1u) : i;
  return uvec2(Counts(push.lists).at[place], Counts(push.lists).at[slot_place(state, order)]);
}

void main() {
  CacheState state = CacheState(push.state);
  bool coming = push.round == state.coming_round;
  bool waited_for = push.round != 0u && !coming;
  uint cursor = state.cursor;
  uint count = state.rounds[push.round].requested;
  if (waited_for) count = min(count, state.ring);
  for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
    uvec2 found = work(state, i, waited_for, cursor);
    if (!coming && gl_LocalInvocationIndex == 0u) move(found.x, found.y);
    fill(found.x, found.y, state.primitives);
    barrier();
  }
  if (!waited_for) return;
  memoryBarrierBuffer();
  if (gl_LocalInvocationIndex == 0u &&
      atomicAdd(state.rounds[push.round].filled, 1u) == gl_NumWorkGroups.x - 1u)
    state.cursor = (cursor + count) % max(state.ring, 1u);
}

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

uint pending;                              // bits of a vertex's attributes that do not fill a word yet
uint pending_bits;
uint next_word;

void put_bits(Counts words, uint value, uint bits) {
  pending |= value << pending_bits;
  uint filled = pending_bits + bits;
  if (filled >= 32u) {
    words.at[next_word] = pending;
    next_word++;
    filled -= 32u;
    pending = filled == 0u ? 0u : value >> (bits - filled);
  }
  pending_bits = filled;
}

// Streams [1, end) of the primitive, in the order that Traced.bits assumes.
void put_attributes(Counts words, uint vertex, uint end) {
  next_word = slot_attributes() + vertex * ATTRIBUTE_WORDS;
  uint last = next_word + ATTRIBUTE_WORDS;
  pending = 0u;
  pending_bits = 0u;
  uint lane = 3u;
  for (uint s = 1u; s < end; s++) {
    uint shape = load_word(8u + 7u * s);
    for (uint c = 0u; c < ((shape >> 8) & 255u); c++, lane++)
      put_bits(words, team_values[0][min(lane, MAX_LANES - 1u) * 64u + vertex], (shape >> 16) & 255u);
  }
  if (next_word < last) words.at[next_word] = pending;
}

void put_position(uvec2 slot, uint vertex, Attribute position) {
  uvec3 q = uvec3(team_values[0][vertex], team_values[0][64u + vertex], team_values[0][128u + vertex]);
  if (POSITION_FLOATS) {
    vec3 p = position_value(position, q);
    for (uint c = 0u; c < 3u; c++) Counts(slot).at[SLOT_POSITIONS + 3u * vertex + c] = floatBitsToUint(p[c]);
  } else {
    Pairs(slot).at[SLOT_POSITIONS / 2u + vertex] = packed_position(q);
  }
}

void fill(uint number, uint slot_number, uint primitives) {
  uint index = primitive_of(number, primitives);
  Traced traced = TracedList(push.traced).at[index];
  uint end = Primitives(Frame(push.frame).primitives).at[index].stream_end;
  open_blob(traced.blob, traced.blob_words);
  group_streams(end);
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
  Attribute position = Primitives(Frame(push.frame).primitives).at[index].position;
  for (uint v = MEMBER; v < MESHLET_VERTICES && v < vertex_count && error == ERROR_NONE; v += TEAM) {
    put_position(slot, v, position);
    put_attributes(words, v, end);
  }
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
    uint number = Counts(push.wanted).at[i < kept || push.round != 0u ? i : state.capacity + i - kept];
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

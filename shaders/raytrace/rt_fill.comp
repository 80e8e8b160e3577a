// Compute stage: decodes meshlets into slots with the team decoder, one workgroup per meshlet. Runs
// before the launch of each pass, and once for all slots when a scene is loaded.
//
// Inputs: the pass, the lists of CacheState, the blobs.
// Outputs: slots and slot table; the size of the launch; the next pass.
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "raytrace/rt_common.glsl"
#include "raytrace/rt_cache.glsl"
#define TEAM 32u
#include "decoders/team_size.glsl"
#include "decoders/serial_prologue.glsl"
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"
#include "decoders/team_connectivity.glsl"
#include "decoders/team_values.glsl"
#include "decoders/slot_output.glsl"

layout(local_size_x = GROUP) in;

shared uint own_slot;

// Decodes meshlet `number` into a slot. A malformed meshlet gets no triangles.
void fill(uint number, uint slot_number) {
  Source source = Sources(push.sources).at[number];
  Primitive primitive = Primitives(Frame(push.frame).primitives).at[source.primitive];
  open_blob(primitive.blob, primitive.blob_words);
  group_streams(primitive.stream_end);
  open_team(source.meshlet);
  Header h = read_header(source.meshlet);
  read_symbols(h.begin, h.triangles);
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

// After a frame whose slots did not suffice although those of the frame before would have, so many
// frames sweep at once.
#define RETRY_FRAMES 16u

// How many meshlets the pass decodes.
uint pass_meshlets(CacheState state, Pass own, uint part) {
  if (push.kind == SWEEP) return own.waiting != 0u && own.resident != part ? state.slots : 0u;
  return own.requested <= state.free - min(own.begin, state.free) ? own.requested : 0u;
}

// Sets the size of the launch, and what the next pass needs to know.
void plan_next(CacheState state, Pass own, uint part, uint count) {
  uint next = push.pass + 1u;
  bool waiting = own.waiting != 0u;
  if (push.kind == RESUME && count < own.requested) {
    // Too many meshlets: leave the paths to the sweeps.
    state.passes[next].waiting = own.waiting;
    state.passes[next].requested = TOO_MANY;
    waiting = false;
  }
  uint paths = waiting ? min(state.records[push.turn], state.room) : 0u;
  if (push.kind != FIRST_RAYS)
    state.passes[push.pass].launch = uint[](paths * spread_of(paths), 1u, 1u);
  if (push.kind == SWEEP && waiting) {
    own.resident = part;
    if (push.step + 1u == state.parts) own.backward ^= 1u;  // the next sweep begins here
    if (state.free != 0u) state.retry = state.frame + RETRY_FRAMES;
  } else if (count > 0u) {
    own.resident = NO_PART;
  }
  state.passes[next].begin = own.begin + count;
  state.passes[next].backward = state.backward = own.backward;
  state.passes[next].resident = state.resident = own.resident;
}

void main() {
  CacheState state = CacheState(push.state);
  bool first = gl_LocalInvocationIndex == 0u;
  bool listed = push.kind < SWEEP;
  uint count = push.meshlets;
  uint begin = 0u;  // number of the first meshlet, or of the first victim
  if (push.kind != LOADING) {
    Pass own = state.passes[push.pass];
    uint part = part_of(state, own.backward, push.step);
    count = pass_meshlets(state, own, part);
    begin = listed ? own.begin : window_of(state, part);
    if (first && gl_WorkGroupID.x == 0u) plan_next(state, own, part, count);
  }
  for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
    uint number = listed ? Counts(state.missing).at[i] : begin + i;
    if (first) {
      own_slot = i;
      if (listed) {
        uint place = begin + i;
        if (place >= state.idle) place = state.slots - 1u - (place - state.idle);
        uint victim = Counts(state.victims).at[place];
        own_slot = Counts(push.slot_table).at[victim];
        Counts(push.slot_table).at[victim] = NO_SLOT;
      }
      if (push.kind != LOADING) Counts(push.slot_table).at[number] = own_slot;
    }
    barrier();
    fill(number, own_slot);
    barrier();
  }
}

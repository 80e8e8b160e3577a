// Compute stage, at the start of a frame: compares what the slots hold with what rays needed in the
// last frame, without the host. One thread per meshlet.
//
// Inputs: counters, slot table.
// Outputs: slot table, lists, CacheState.
//
// If the slots suffice for all that rays needed, meshlets without a slot are decoded before the
// first rays, in place of those that were not needed. Otherwise the slots stay as they are, and
// the paths that wait will sweep over the model.
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "raytrace/rt_common.glsl"
#include "raytrace/rt_cache.glsl"

layout(local_size_x = CHOOSE_THREADS) in;

// Meshlets that were needed in this many frames lose their slots after all others. With 32, six
// meshlets of sponza_like were missing in a frame instead of 17.
#define RECENT_FRAMES 32u
// The eighth part of the slots stays free for meshlets that come into view.
#define FITTING 7u / 8u

// Words that other workgroups write in this dispatch.
layout(buffer_reference, std430, buffer_reference_align = 4) coherent buffer SharedCounts {
  uint at[];
};

#define IDLE 0u
#define RECENT 1u
#define LACKING 2u
#define NONE 3u
shared uint counts[NONE];  // items that the workgroup adds to each list
shared uint begins[NONE];  // where

uint frame;  // the last one

// The meshlet's slot. After a sweep the slots hold a part.
uint slot_of(CacheState state, uint m) {
  uint entry = Counts(push.slot_table).at[m];
  if (state.resident == NO_PART) return entry < REQUESTED ? entry : NO_SLOT;
  uint place = m - window_of(state, state.resident);
  return place < state.slots ? place : NO_SLOT;
}

// Plans the frame.
void plan(CacheState state) {
  uint unneeded = state.idle + state.recent;
  bool fits = state.slots - unneeded + state.lacking <= state.slots * FITTING &&
              frame >= state.retry;
  state.frame = frame + 1u;
  state.free = fits ? unneeded : 0u;
  state.passes[0].requested = fits ? state.lacking : 0u;
  state.passes[0].backward = state.backward;
  state.passes[0].resident = state.resident;
}

void main() {
  CacheState state = CacheState(push.state);
  uint m = gl_GlobalInvocationID.x;
  uint local = gl_LocalInvocationIndex;
  frame = state.frame;
  if (local < NONE) counts[local] = 0u;
  barrier();
  uint list = NONE;
  uint rank = 0u;
  if (m < state.meshlets) {
    uint age = frame - Counts(push.counters).at[m];
    uint slot = slot_of(state, m);
    Counts(push.slot_table).at[m] = slot;
    if (slot == NO_SLOT)
      list = age == 0u ? LACKING : NONE;
    else if (age > 0u)
      list = age < RECENT_FRAMES ? RECENT : IDLE;
    if (list < NONE) rank = atomicAdd(counts[list], 1u);
  }
  barrier();
  if (local == 0u) {
    begins[IDLE] = atomicAdd(state.idle, counts[IDLE]);
    begins[RECENT] = atomicAdd(state.recent, counts[RECENT]);
    begins[LACKING] = atomicAdd(state.lacking, counts[LACKING]);
  }
  barrier();
  if (list < NONE) {
    uint place = begins[list] + rank;
    if (list == RECENT) place = state.slots - 1u - place;
    if (place < state.slots) Counts(list == LACKING ? state.missing : state.victims).at[place] = m;
  }
  memoryBarrierBuffer();
  barrier();
  if (local == 0u && atomicAdd(state.finished, 1u) == gl_NumWorkGroups.x - 1u) plan(state);
}

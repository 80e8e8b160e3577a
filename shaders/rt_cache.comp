// Which meshlets the slots hold when a frame begins, chosen without the host by what rays asked for in the last frame, in two steps.
// Those asked for most often are kept throughout the frame, in the stable slots. The other slots (rotating) keep what they have, but where
// nobody has asked for that, what rays will probably ask for takes its place. During the frame they are given to what rays wait for, in an
// order that is laid down here: by how often a slot's meshlet was asked for.
// variants: rt_cache_count.comp=COUNT rt_cache_choose.comp=CHOOSE
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "rt_common.glsl"
#include "rt_cache.glsl"

layout(local_size_x = 512) in;             // KEYS

shared uint counts[KEYS];
shared uint bases[KEYS];
shared bool last_group;

// Grows with the count, by eighths of a power of two; of two meshlets with about the same count, the one that is there is preferred, so
// that it is not decoded again. 0: no ray asked, and it is not there.
uint key_of(uint count, bool there) {
  uint exponent = uint(findMSB(count | 1u));
  uint scale = count < 8u ? count : (exponent - 2u) * 8u + ((count >> (exponent - 3u)) & 7u);
  return scale * 2u + (there ? 1u : 0u);
}

// Whether all other workgroups of the dispatch are done, and what they wrote with atomics or before this can be read.
bool is_last_group(CacheState state) {
  memoryBarrierBuffer();
  barrier();
  if (gl_LocalInvocationIndex == 0u) last_group = atomicAdd(state.finished, 1u) == gl_NumWorkGroups.x - 1u;
  barrier();
  memoryBarrierBuffer();
  if (last_group && gl_LocalInvocationIndex == 0u) state.finished = 0u;
  return last_group;
}

#ifdef COUNT

shared uint above[KEYS];                   // meshlets with this key or a larger one,
shared uint there_above[KEYS];             //   and those of them that have a slot

// The key from which on meshlets are kept, and where in the order of slots each key's begin.
void choose_threshold(CacheState state) {
  uint key = gl_LocalInvocationIndex;
  uint own = atomicExchange(state.histogram[key], 0u);
  if (key == 0u) own = 0u;
  above[key] = own;
  there_above[key] = (key & 1u) != 0u ? own : 0u;
  barrier();
  for (uint step = 1u; step < KEYS; step *= 2u) {
    uint added = key + step < KEYS ? above[key + step] : 0u;
    uint there_added = key + step < KEYS ? there_above[key + step] : 0u;
    barrier();
    above[key] += added;
    there_above[key] += there_added;
    barrier();
  }
  uint slots = state.stable + state.rotating;
  state.places[key] = slots - there_above[key];
  uint before = above[key] - own;
  if (before < state.stable && (above[key] >= state.stable || key == 0u)) {
    state.threshold = key;
    state.quota = key == 0u ? 0u : state.stable - before;
  }
  if (key != 0u) return;
  if (state.stable == 0u) {
    state.threshold = KEYS;
    state.quota = 0u;
  }
  state.idle = slots - there_above[2];
  state.taken = 0u;
  state.kept = 0u;
  state.predicted = 0u;
  state.empty = 0u;
  state.cursor = 0u;
}

void main() {
  CacheState state = CacheState(push.state);
  uint m = gl_GlobalInvocationID.x;
  uint local = gl_LocalInvocationIndex;
  counts[local] = 0u;
  barrier();
  if (m < state.meshlets) atomicAdd(counts[key_of(Counts(push.counters).at[m], Counts(push.slot_table).at[m] < SLOT_LIMIT)], 1u);
  barrier();
  if (counts[local] != 0u) atomicAdd(state.histogram[local], counts[local]);
  if (is_last_group(state)) choose_threshold(state);
}

#endif
#ifdef CHOOSE

// Puts a meshlet that has no slot on the list, if it shall have one.
void want(CacheState state, uint m, uint key) {
  Counts wanted = Counts(push.wanted);
  bool keep = key > state.threshold;
  if (key == state.threshold && key != 0u) keep = atomicAdd(state.taken, 1u) < state.quota;
  if (keep) {
    uint place = atomicAdd(state.kept, 1u);
    if (place < state.stable) wanted.at[place] = m;
  } else if (key > 1u && state.predict != 0u && state.rotating != 0u) {
    uint place = atomicAdd(state.predicted, 1u);
    if (place < state.rotating) wanted.at[state.stable + place] = m;
  }
}

// What is kept gets its slots; what is only predicted gets those that are idle then. Later the rotating slots are given away in turn, and
// all others that are idle.
void plan_fill(CacheState state) {
  uint kept = min(atomicAdd(state.kept, 0u), state.stable);
  uint predicted = min(min(atomicAdd(state.predicted, 0u), state.rotating), state.idle - min(kept, state.idle));
  state.kept = kept;
  state.predicted = predicted;
  state.ring = max(state.rotating, state.idle - min(kept, state.idle));
  state.rounds[0].requested = kept + predicted;
  state.rounds[0].fill_groups[0] = min(kept + predicted, FILL_GROUPS);
}

void main() {
  CacheState state = CacheState(push.state);
  uint m = gl_GlobalInvocationID.x;
  uint local = gl_LocalInvocationIndex;
  counts[local] = 0u;
  barrier();
  uint slot = NO_SLOT;
  uint key = 0u;
  uint rank = 0u;                          // among the workgroup's meshlets of this key
  if (m < state.meshlets) {
    slot = Counts(push.slot_table).at[m];
    key = key_of(Counts(push.counters).at[m], slot < SLOT_LIMIT);
    Counts(push.counters).at[m] = 0u;
    if (slot < SLOT_LIMIT) {
      rank = atomicAdd(counts[key], 1u);
    } else {
      Counts(push.slot_table).at[m] = NO_SLOT;
      want(state, m, key);
    }
  }
  barrier();
  if (counts[local] != 0u) bases[local] = atomicAdd(state.places[local], counts[local]);
  barrier();
  if (slot < SLOT_LIMIT) Counts(push.order).at[bases[key] + rank] = slot;
  if (m < state.stable + state.rotating && Counts(push.slot_meshlets).at[m] == NO_SLOT) Counts(push.order).at[atomicAdd(state.empty, 1u)] = m;
  if (is_last_group(state) && local == 0u) plan_fill(state);
}

#endif

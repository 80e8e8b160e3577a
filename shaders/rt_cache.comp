// Which meshlets the cache holds during the next frame: those that rays asked for most often during the last one. Three steps,
// without the host: how many meshlets there are of each key, the key from which on they fit, and who leaves and who comes.
// A fourth step runs between the rounds of a frame: the meshlets that paths wait for get scratch slots.
// variants: rt_cache_admit.comp=ADMIT rt_cache_count.comp=COUNT rt_cache_threshold.comp=THRESHOLD rt_cache_choose.comp=CHOOSE
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "rt_common.glsl"
#include "rt_cache.glsl"

layout(local_size_x = 512) in;             // KEYS

// Grows with the count, by eighths of a power of two; of two meshlets with about the same count, the one in the cache is preferred, so
// that it is not emptied for nothing. 0: no ray asked, and it is not there.
uint key_of(uint count, bool there) {
  uint exponent = uint(findMSB(count | 1u));
  uint scale = count < 8u ? count : (exponent - 2u) * 8u + ((count >> (exponent - 3u)) & 7u);
  return scale * 2u + (there ? 1u : 0u);
}

#ifdef COUNT

shared uint counts[KEYS];

void main() {
  CacheState state = CacheState(push.state);
  uint m = gl_GlobalInvocationID.x;
  uint local = gl_LocalInvocationIndex;
  counts[local] = 0u;
  barrier();
  if (m < state.meshlets) atomicAdd(counts[key_of(Counts(push.counters).at[m], Counts(push.slot_table).at[m] < state.capacity)], 1u);
  barrier();
  if (counts[local] != 0u) atomicAdd(state.histogram[local], counts[local]);
}

#endif
#ifdef THRESHOLD

shared uint above[KEYS];                   // meshlets with this key or a larger one

void main() {
  CacheState state = CacheState(push.state);
  uint key = gl_LocalInvocationIndex;
  uint own = key == 0u ? 0u : state.histogram[key];
  state.histogram[key] = 0u;
  above[key] = own;
  barrier();
  for (uint step = 1u; step < KEYS; step *= 2u) {
    uint added = key + step < KEYS ? above[key + step] : 0u;
    barrier();
    above[key] += added;
    barrier();
  }
  uint before = above[key] - own;
  if (before < state.capacity && (above[key] >= state.capacity || key == 0u)) {
    state.threshold = key;
    state.quota = key == 0u ? 0u : state.capacity - before;
  }
  if (key == 0u) {
    if (before >= state.capacity && state.capacity == 0u) {
      state.threshold = KEYS;
      state.quota = 0u;
    }
    state.taken = 0u;
    state.free_slots -= state.missing;     // those that the last frame filled
    state.missing = 0u;
    state.fill_groups[0] = 0u;
  }
}

#endif
#ifdef CHOOSE

void main() {
  CacheState state = CacheState(push.state);
  uint m = gl_GlobalInvocationID.x;
  if (m >= state.meshlets) return;
  uint slot = Counts(push.slot_table).at[m];
  bool there = slot < state.capacity;
  uint key = key_of(Counts(push.counters).at[m], there);
  Counts(push.counters).at[m] = 0u;
  bool wanted = key > state.threshold;
  if (key == state.threshold) wanted = atomicAdd(state.taken, 1u) < state.quota;
  if (wanted == there) return;
  if (wanted) {
    uint place = atomicAdd(state.missing, 1u);
    Counts(push.missing).at[place] = m;
    if (place < FILL_GROUPS) atomicAdd(state.fill_groups[0], 1u);
  } else {
    Counts(push.slot_table).at[m] = NO_SLOT;
    Counts(push.free_slots).at[atomicAdd(state.free_slots, 1u)] = slot;
  }
}

#endif
#ifdef ADMIT

shared uint given;                         // requests that have a slot

// Gives the scratch slot at `place`, whose meshlet is `before`, to the next request, if there is one.
void give(CacheState state, uint place, uint before, uint wanted) {
  uint i = atomicAdd(given, 1u);
  if (i >= wanted) return;
  Counts table = Counts(push.slot_table);
  if (before != NO_SLOT && table.at[before] == state.capacity + place) table.at[before] = NO_SLOT;
  Counts(push.free_slots).at[place] = Counts(push.missing).at[i];
  Counts(push.missing).at[push.scratch + i] = place;
}

// push.missing: the requests, and behind them their places; push.free_slots: of each scratch slot, the meshlet in it. First come the slots
// whose meshlets no ray has asked for in this frame, then the others in turn.
void main() {
  CacheState state = CacheState(push.state);
  uint requested = min(state.requested, push.scratch);
  uint wanted = push.last != 0u ? 0u : requested;
  uint ring = state.ring;
  if (gl_LocalInvocationIndex == 0u) given = 0u;
  barrier();
  for (uint pass = 0u; pass < 2u; pass++) {
    for (uint i = gl_LocalInvocationIndex; i < push.scratch && wanted != 0u; i += KEYS) {
      uint place = (ring + i) % push.scratch;
      uint before = Counts(push.free_slots).at[place];
      bool unused = before == NO_SLOT || Counts(push.slot_table).at[before] != state.capacity + place || Counts(push.counters).at[before] == 0u;
      // What the first pass has given away is asked for by now, and its place is not yet in the table.
      bool fresh = before != NO_SLOT && Counts(push.slot_table).at[before] == REQUESTED;
      if (!fresh && unused == (pass == 0u)) give(state, place, before, wanted);
    }
    barrier();
    memoryBarrierBuffer();
    barrier();
  }
  uint admitted = min(given, wanted);
  for (uint i = admitted + gl_LocalInvocationIndex; i < requested; i += KEYS) Counts(push.slot_table).at[Counts(push.missing).at[i]] = NO_SLOT;
  barrier();
  if (gl_LocalInvocationIndex != 0u) return;
  state.admitted = admitted;
  state.fill_groups[0] = min(admitted, FILL_GROUPS);
  state.ring = (ring + admitted) % max(push.scratch, 1u);
  state.requested = 0u;
  state.rays[0] = state.rays_wanted;
  state.rays_wanted = 0u;
}

#endif

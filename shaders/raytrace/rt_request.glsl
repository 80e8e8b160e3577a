// What the cache learns from rays: which meshlets they need, and which they wait for. To be
// included after rt_common.glsl and rt_cache.glsl.

// A ray needs the meshlet, whose entry in the table of slots is given. Of the many that need the
// same few meshlets in the first launch only one in sixteen counts, for all: atomics to one place
// queue.
void count(uint number, uint entry) {
  bool hot = !ALL_CACHED && push.round == 0u && entry < REQUESTED && (entry & HOT) != 0u;
  if (!hot)
    atomicAdd(Counts(push.counters).at[number], COUNTED_RAY);
  else if (((gl_LaunchIDEXT.x | gl_LaunchIDEXT.y) & 3u) == 0u)
    atomicAdd(Counts(push.counters).at[number], 16u * COUNTED_RAY);
}

// A ray has tested triangles of the meshlet, perhaps before or behind what it finds in the end.
void touch(uint number) {
  if (Counts(push.counters).at[number] == 0u)
    atomicOr(Counts(push.counters).at[number], TOUCHED_RAY);
}

// Puts a meshlet on the next round's list, if it is on none and there is room.
void request(uint number) {
  CacheState state = CacheState(push.state);
  // Most are on the list already, and reading costs less than an atomic.
  if (Counts(push.slot_table).at[number] != NO_SLOT ||
      state.rounds[push.record + 1u].requested >= state.ring)
    return;
  if (atomicCompSwap(Counts(push.slot_table).at[number], NO_SLOT, REQUESTED) != NO_SLOT) return;
  uint place = atomicAdd(state.rounds[push.record + 1u].requested, 1u);
  if (place < state.ring) {
    Counts(push.requests).at[place] = number;
    if (place < FILL_GROUPS) atomicAdd(state.rounds[push.record + 1u].fill_groups[0], 1u);
  } else {
    Counts(push.slot_table).at[number] = NO_SLOT;
  }
}

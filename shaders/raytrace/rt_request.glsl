// Feedback from rays to the cache: meshlets that they need and that they wait for. Include after
// rt_common.glsl and rt_cache.glsl.

// Counts a ray that needs the meshlet. entry: of the slot table. For hot meshlets, which many rays
// of the first launch need, one ray in 16 counts for all: atomics on one address are serialised.
void count(uint number, uint entry) {
  bool hot = !ALL_CACHED && push.round == 0u && entry < REQUESTED && (entry & HOT) != 0u;
  if (!hot)
    atomicAdd(Counts(push.counters).at[number], COUNTED_RAY);
  else if (((gl_LaunchIDEXT.x | gl_LaunchIDEXT.y) & 3u) == 0u)
    atomicAdd(Counts(push.counters).at[number], 16u * COUNTED_RAY);
}

// Marks a meshlet whose triangles a ray has tested, perhaps without hitting them.
void touch(uint number) {
  if (Counts(push.counters).at[number] == 0u)
    atomicOr(Counts(push.counters).at[number], TOUCHED_RAY);
}

// Adds a meshlet to the next round's requests, unless it is requested already or the list is full.
void request(uint number) {
  CacheState state = CacheState(push.state);
  // Most are requested already, and a read is cheaper than an atomic.
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

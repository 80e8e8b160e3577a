// Asking for meshlets that paths wait for. To be included after rt_common.glsl and rt_cache.glsl.

// Puts a meshlet on the next round's list, if it is on none and there is room.
void request(uint number) {
  CacheState state = CacheState(push.state);
  // Most are on the list already, and reading costs less than an atomic.
  if (Counts(push.slot_table).at[number] != NO_SLOT || state.rounds[push.record + 1u].requested >= state.ring) return;
  if (atomicCompSwap(Counts(push.slot_table).at[number], NO_SLOT, REQUESTED) != NO_SLOT) return;
  uint place = atomicAdd(state.rounds[push.record + 1u].requested, 1u);
  if (place < state.ring) {
    Counts(push.requests).at[place] = number;
    if (place < FILL_GROUPS) atomicAdd(state.rounds[push.record + 1u].fill_groups[0], 1u);
  } else {
    Counts(push.slot_table).at[number] = NO_SLOT;
  }
}

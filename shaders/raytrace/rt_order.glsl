// Order of slots and meshlets by class. Include after rt_cache.glsl; define LISTED(list), the
// length of a list, before.

// Offset in the lists of slot number `index`, the lowest class first.
uint slot_place(CacheState state, uint index) {
  uint c = IDLE;
  for (; c < CLASSES - 1u && index >= LISTED(c); c++) index -= LISTED(c);
  return list_begin(state, c) + index;
}

// The same for meshlets without a slot, the highest class first.
uint meshlet_place(CacheState state, uint index) {
  uint c = CLASSES - 1u;
  for (; c > IDLE + 1u && index >= LISTED(CLASSES + c); c--) index -= LISTED(CLASSES + c);
  return list_begin(state, CLASSES + c) + index;
}

// The meshlet whose box a ray meets. For the shaders of hits; include after rt_common.glsl.

Placed placed;
uint number;  // of the meshlet

void open_box() {
  placed = PlacedPieces(push.placed).at[gl_InstanceCustomIndexEXT & PLACED_INDEX];
  number = placed.first + uint(gl_PrimitiveID) / GROUPS;
}

// The meshlet's number in its primitive.
uint meshlet() { return SWEEPS ? Sources(push.sources).at[number].meshlet : number - placed.first; }

uint hit_id(uint triangle) { return meshlet() * MESHLET_TRIANGLES + triangle; }

// The meshlet's slot, or NO_SLOT.
uint slot_entry() {
#ifdef PAPER
  return Counts(push.slot_table).at[number];
#else
  return number - push.first;
#endif
}

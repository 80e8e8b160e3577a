// The meshlet whose box a ray meets. For the shaders of hits.
#ifndef RT_MESHLET_GLSL
#define RT_MESHLET_GLSL

#include "raytrace/rt_common.glsl"
#include "raytrace/rt_push.glsl"

Placed placed;
uint number;  // of the meshlet

void open_box() {
  placed = PlacedPieces(push.placed).at[gl_InstanceCustomIndexEXT & PLACED_INDEX];
  number = placed.first + uint(gl_PrimitiveID) / BOXES;
}

// The meshlet's number in its primitive.
uint meshlet() { return SWEEPS ? Sources(push.sources).at[number].meshlet : number - placed.first; }

uint hit_id(uint triangle) { return meshlet() * MESHLET_TRIANGLES + triangle; }

// The address of the meshlet's slot.
uvec2 open_slot() { return slot_address(push.cache, number - push.first); }

#endif

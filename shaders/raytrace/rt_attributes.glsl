// The hit triangle of a meshlet in the cache. Call open_hit first.
#ifndef RT_ATTRIBUTES_GLSL
#define RT_ATTRIBUTES_GLSL

#include "raytrace/rt_common.glsl"

#include "raytrace/rt_hit.glsl"
#include "raytrace/rt_meshlet.glsl"

uint id;  // meshlet * 64 + triangle
uvec3 corners;
vec3 weights;  // of the corners
uvec2 slot;
#include "decoders/slot_vertex.glsl"
hitAttributeEXT HitAttributes found;

#define PRIMITIVE Primitives(Frame(push.frame).primitives).at[placed.primitive]

void open_hit() {
  open_box();
  id = hit_id(found.triangle);
  weights = vec3(1.0 - found.barycentrics.x - found.barycentrics.y, found.barycentrics);
  slot = open_slot();
  uint packed = SceneWords(slot).at[found.triangle];
  corners = uvec3(packed, packed >> 8, packed >> 16) & 63u;
}

#endif

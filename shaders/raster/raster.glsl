// What the stages of all raster paths share: push constants, specialisation constants, and a vertex
// from a meshlet's integers.
#ifndef RASTER_GLSL
#define RASTER_GLSL

#include "scene/scene.glsl"

// Ids 0 and 1 are the decoder's capacities.
layout(constant_id = 2) const uint ATTRIBUTES =
    7u;  // HAS_ of what any primitive of the scene has: nothing else is written or read
layout(constant_id = 3) const
    bool CULLING = true;  // meshlets outside the view or facing away are left out

layout(push_constant) uniform Push {
  uvec2 frame;
  uint instance;
  uint first;  // meshlet of the draw's first workgroup or point
  // Path `stream` alone (vk_backend/stream.py):
  uint meshlets;    // that are decoded or drawn,
  uint first_slot;  //   and the first one's slot
  uvec2 slots;      // the ring, and what decode_buffers.glsl has for each slot
  uvec2 summaries;
  uvec2 connectivity;
  uvec2 segments;  // of the batch, see stream_push.glsl
  uint segment_count;
}
push;

// The instance that is looked at: an includer may have another idea.
#ifndef INSTANCE
#define INSTANCE push.instance
#endif

Frame the_frame() { return Frame(push.frame); }
Instance the_instance() { return Instances(the_frame().instances).at[INSTANCE]; }
uint the_primitive() { return Instances(the_frame().instances).at[INSTANCE].primitive; }
mat4 object_to_clip() { return Matrices(the_frame().object_to_clip).at[INSTANCE]; }

// Floats of an uncompressed vertex.
uint vertex_floats() {
  return 3u + ((ATTRIBUTES & HAS_NORMAL) != 0u ? 3u : 0u) +
         ((ATTRIBUTES & HAS_TEXCOORD) != 0u ? 2u : 0u) + ((ATTRIBUTES & HAS_COLOR) != 0u ? 4u : 0u);
}

// In world space, not of unit length: the fragment shader normalises. A zero vector stands for a
// missing normal.
vec3 world_normal(vec3 normal) {
  return transpose(mat3(Instances(the_frame().instances).at[INSTANCE].world_to_object)) * normal;
}

#endif

// Compute stage of rt-paper: decodes a list of meshlets into slots, one workgroup per meshlet.
//
// Inputs: the list, the blobs.
// Output: slots.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "raytrace/rt_common.glsl"

layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Items { uvec2 at[]; };

layout(push_constant) uniform PaperPush {
  uvec2 frame;
  uvec2 sources;
  uvec2 cache;
  uvec2 items;  // (meshlet, slot) each
  uint count;
}
push;

#define WORKGROUP 32u
#include "raytrace/rt_fill_team.glsl"
#include "raytrace/rt_fill.glsl"
layout(local_size_x = WORKGROUP) in;

void main() {
  for (uint i = gl_WorkGroupID.x; i < push.count; i += gl_NumWorkGroups.x) {
    uvec2 item = Items(push.items).at[i];
    fill(item.x, item.y);
    barrier();
  }
}

// Compute stage: decodes meshlets into slots with the team decoder, one workgroup per meshlet, or
// (SERIAL) with the serial decoder, one thread per meshlet: faster for many of them.
//
// Inputs: meshlets that follow each other by number; the blobs.
// Output: slots.
// variants: rt_fill.comp= rt_fill_serial.comp=SERIAL
#version 460
#extension GL_GOOGLE_include_directive : require

#include "raytrace/rt_common.glsl"

layout(push_constant) uniform FillPush {
  uvec2 frame;
  uvec2 sources;
  uvec2 cache;
  uint first;  // the meshlet for the first slot
  uint count;
}
push;

#ifdef SERIAL
#include "raytrace/rt_fill_serial.glsl"
#else
#define WORKGROUP 32u
#include "raytrace/rt_fill_team.glsl"
#endif
#include "raytrace/rt_fill.glsl"
layout(local_size_x = 32) in;

void main() {
#ifdef SERIAL
  uint begin = gl_GlobalInvocationID.x;
  uint step = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
#else
  uint begin = gl_WorkGroupID.x;
  uint step = gl_NumWorkGroups.x;
#endif
  for (uint i = begin; i < push.count; i += step) {
    fill(push.first + i, i);
#ifndef SERIAL
    barrier();
#endif
  }
}

// Closest-hit stage of rt-paper: as rt_surface.rchit.
//
// Input: the hit.
// Output: the payload Surface.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_tracing : require
#extension GL_EXT_nonuniform_qualifier : require

#include "raytrace/rt_common.glsl"
#include "paper_attributes.glsl"
#include "raytrace/rt_surface.glsl"

layout(location = 0) rayPayloadInEXT Surface surface;

void main() {
  open_hit();
  surface = found_surface();
}

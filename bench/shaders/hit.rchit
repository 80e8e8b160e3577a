// Closest-hit stage of rt-paper and rt-triangles: as rt_surface.rchit.
//
// Input: the hit.
// Output: the payload Surface.
// variants: paper.rchit=PAPER triangles.rchit=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_tracing : require
#extension GL_EXT_nonuniform_qualifier : require

#include "raytrace/rt_common.glsl"
#ifdef PAPER
#include "paper_attributes.glsl"
#else
#include "triangles_attributes.glsl"
#endif
#include "raytrace/rt_surface.glsl"

layout(location = 0) rayPayloadInEXT Surface surface;

void main() {
  open_hit();
  surface = found_surface();
}

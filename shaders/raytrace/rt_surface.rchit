// Closest-hit stage: normals, albedo and emission of the nearest hit.
//
// Inputs: the hit; the cache.
// Output: the payload Surface.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_tracing : require
#extension GL_EXT_nonuniform_qualifier : require

#include "raytrace/rt_common.glsl"
#include "raytrace/rt_attributes.glsl"
#include "raytrace/rt_surface.glsl"

layout(location = 0) rayPayloadInEXT Surface surface;

void main() {
  open_hit();
  surface = found_surface();
}

// Miss stage: the ray leaves the scene.
//
// Output: t = -1.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_tracing : require

#include "raytrace/rt_hit.glsl"

layout(location = 0) rayPayloadInEXT Surface surface;

void main() { surface.hit.t = -1.0; }

// Path `geometry`, vertex stage: one point per meshlet of each instance; passes their numbers on.
//
// Outputs: out_meshlet, out_instance. The position is a dummy.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "raster/raster_push.glsl"
#include "raster/raster.glsl"

layout(location = 0) flat out uint out_meshlet;
layout(location = 1) flat out uint out_instance;

void main() {
  out_meshlet = push.first + uint(gl_VertexIndex);
  out_instance = push.instance + uint(gl_InstanceIndex);
  gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}

// Path `geometry`, vertex stage: one point per meshlet; passes the meshlet's number on.
//
// Output: out_meshlet. The position is a dummy.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "raster/raster.glsl"

layout(location = 0) flat out uint out_meshlet;

void main() {
  out_meshlet = push.first + uint(gl_VertexIndex);
  gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}

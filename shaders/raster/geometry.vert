// Path `geometry`, vertex stage: a point per meshlet, of which only the number matters.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "raster/raster.glsl"

layout(location = 0) flat out uint out_meshlet;

void main() {
  out_meshlet = push.first + uint(gl_VertexIndex);
  gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}

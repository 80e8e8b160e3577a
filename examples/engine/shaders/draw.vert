// Vertex pulling: an instance is a meshlet, a vertex one of its 192 corners.
#version 450
#extension GL_GOOGLE_include_directive : require

layout(std430, binding = 1) readonly buffer Meshlets { uint meshlets[]; };
layout(push_constant) uniform Frame {
  mat4 clip;  // from POSITION
  vec4 eye;   // in coordinates of POSITION
};
layout(location = 0) out vec3 to_eye;
layout(location = 1) out vec3 facing;

#include "../layout.h"

vec3 vector(uint at) {
  return vec3(uintBitsToFloat(meshlets[at]), uintBitsToFloat(meshlets[at + 1u]),
              uintBitsToFloat(meshlets[at + 2u]));
}

void main() {
  uint from = MESHLET_WORDS * uint(gl_InstanceIndex), t = uint(gl_VertexIndex) / 3u;
  to_eye = facing = vec3(0.0);
  gl_Position = vec4(0.0);  // all corners: no triangle
  if (t >= meshlets[from + MESHLET_COUNT]) return;
  uint corners = meshlets[from + MESHLET_CORNERS + t];
  uint v = (corners >> (8u * (uint(gl_VertexIndex) % 3u))) & 255u;
  vec3 position = vector(from + MESHLET_POINTS + POINT_WORDS * v);
  facing = vector(from + MESHLET_POINTS + POINT_WORDS * v + 3u);
  to_eye = eye.xyz - position;
  gl_Position = clip * vec4(position, 1.0);
}

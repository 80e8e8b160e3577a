// A lamp at the eye.
#version 450

layout(location = 0) in vec3 to_eye;
layout(location = 1) in vec3 facing;
layout(location = 0) out vec4 color;

void main() {
  vec3 n = facing;
  if (dot(n, n) == 0.0) n = cross(dFdx(to_eye), dFdy(to_eye));  // a model without normals
  float light = abs(dot(normalize(n), normalize(to_eye)));
  color = vec4(vec3(0.1 + 0.8 * light), 1.0);
}

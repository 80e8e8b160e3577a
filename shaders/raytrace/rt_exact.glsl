// GLSL's dot and cross, written out: drivers may fuse products and sums inside the built-ins, even
// where the SPIR-V says NoContraction (tools/build_shaders.py).
#ifndef RT_EXACT_GLSL
#define RT_EXACT_GLSL

float dot_product(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
vec3 cross_product(vec3 a, vec3 b) {
  return vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

#endif

// Unit vectors and light in few bits, for payloads and records. All paths round in the same
// places, whether they wait or not, so that pictures are the same.
#ifndef RT_PACKING_GLSL
#define RT_PACKING_GLSL

#include "decoders/slots.glsl"

// Octahedral, 16 bits each.
uint packed_unit(vec3 n) {
  vec3 size = abs(n);
  vec2 p = n.xy / (size.x + size.y + size.z);
  if (n.z < 0.0)
    p = vec2(p.x < 0.0 ? abs(p.y) - 1.0 : 1.0 - abs(p.y),
             p.y < 0.0 ? abs(p.x) - 1.0 : 1.0 - abs(p.x));
  uvec2 q = uvec2(p * 32767.5 + 32768.0);
  return min(q.x, 65535u) | min(q.y, 65535u) << 16;
}
vec3 unpacked_unit(uint packed) { return unit_of_oct(uvec2(packed & 0xFFFFu, packed >> 16), 16u); }

// Three mantissas of 9 bits and an exponent of 5.
uint packed_light(vec3 light) {
  vec3 c = clamp(light, 0.0, 65535.0);
  uint exponent = max(floatBitsToUint(max(c.r, max(c.g, c.b))) >> 23, 112u);
  uvec3 q = min(uvec3(c * uintBitsToFloat((262u - exponent) << 23) + 0.5), 511u);
  return q.r | q.g << 9 | q.b << 18 | (exponent - 112u) << 27;
}
vec3 unpacked_light(uint packed) {
  return vec3(packed & 511u, packed >> 9 & 511u, packed >> 18 & 511u) *
         uintBitsToFloat(((packed >> 27) + 104u) << 23);
}

// Three floats that are not negative, with mantissas of 12 bits.
uvec2 packed_sum(vec3 sum) { return packed_position((floatBitsToUint(sum) + 0x400u) >> 11); }
vec3 unpacked_sum(uvec2 packed) { return uintBitsToFloat(unpacked_position(packed) << 11); }

#endif

// From a stream's integers to values (spec, appendix B).
#pragma once
#include <cmath>
#include <cstdint>

// Not with registers of 80 bits (x87): roundings in between would go, and floats differ.
#if defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ != 0
#error "compile for SSE2 (-msse2 -mfpmath=sse): values would depend on the compiler"
#endif

namespace gltf_meshlet_codec {
// GRID. One rounding, at the end: offset + q * step is exact enough in double.
inline float grid_value(uint32_t q, double step, double offset) {
  return float(offset + double(int32_t(q)) * step);
}

// SIGN: 0 is -1, 1 is +1.
inline float sign_value(uint32_t q) { return grid_value(q, 2.0, -1.0); }

// FLOAT32: the bits of the float.
inline uint32_t float_bits(uint32_t q) { return q >> 31 ? q ^ 0x80000000u : ~q; }

// OCT: the factor that maps integers of `bits` bits, at most 2^bits - 2, to [0, 2].
inline float octahedral_scale(uint32_t bits) { return 2.0f / float((1u << bits) - 2u); }

// OCT: the unit vector of a pair. References, not a Vec3, so that loops over vertices vectorise.
inline void octahedral_direction(uint32_t u, uint32_t v, float scale, float& out_x, float& out_y,
                                 float& out_z) {
  float x = float(int32_t(u)) * scale - 1.0f, y = float(int32_t(v)) * scale - 1.0f;
  float z = 1.0f - std::fabs(x) - std::fabs(y);
  float fold = z < 0.0f ? -z : 0.0f;
  x -= std::copysign(fold, x);
  y -= std::copysign(fold, y);
  float inverse = 1.0f / std::sqrt(x * x + y * y + z * z);
  out_x = x * inverse + 0.0f;  // no -0
  out_y = y * inverse + 0.0f;
  out_z = z * inverse + 0.0f;
}

}  // namespace gltf_meshlet_codec

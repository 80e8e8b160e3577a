// The elements of a vertex as a vector of four integers, modulo 2^32, and the predictions of
// EXT_meshlet_edgebreaker on them (its section A.7), for decoder and unpacker.
#ifndef DECODE_VERTEX_H
#define DECODE_VERTEX_H
#include <cstdint>
#include <cstring>

#include "common/bits.h"
#include "decode/build.h"
#include "format/constants.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
using Vertex = uint32_t __attribute__((vector_size(16)));
using SignedVertex = int32_t __attribute__((vector_size(16)));

inline Vertex load(const uint32_t* values, size_t vertex) {
  Vertex v;
  std::memcpy(&v, values + 4 * vertex, sizeof v);
  return v;
}
inline void store(uint32_t* values, size_t vertex, Vertex v) {
  std::memcpy(values + 4 * vertex, &v, sizeof v);
}
inline Vertex all_of(uint32_t x) { return Vertex{x, x, x, x}; }
// Signed.
inline Vertex shifted_right(Vertex v, uint32_t n) { return Vertex(SignedVertex(v) >> int32_t(n)); }
inline Vertex absolute(Vertex v) {
  const Vertex sign = shifted_right(v, 31);
  return (v ^ sign) - sign;
}
inline uint32_t sum(Vertex v) {
  v += Vertex{v[2], v[3], v[0], v[1]};
  return v[0] + v[1];
}
inline uint32_t any(Vertex v) { return v[0] | v[1] | v[2] | v[3]; }
// Signed; low <= high.
inline Vertex clamped(Vertex v, Vertex low, Vertex high) {
  const SignedVertex x = SignedVertex(v), l = SignedVertex(low), h = SignedVertex(high);
  const Vertex above = Vertex(x > h), below = Vertex(x < l);
  return (v & ~above & ~below) | (high & above) | (low & below);
}
inline uint32_t dot(Vertex a, Vertex b) { return sum(a * b); }
inline uint32_t magnitude(uint32_t x) {
  const uint32_t sign = 0u - (x >> 31);
  return (x ^ sign) - sign;
}
inline Vertex cross(Vertex e, Vertex f) {
  return Vertex{e[1], e[2], e[0], 0} * Vertex{f[2], f[0], f[1], 0} -
         Vertex{e[2], e[0], e[1], 0} * Vertex{f[1], f[2], f[0], 0};
}

// Integers in 1/256: v is about a + s (b - a) + u (o - a).
struct VertexWeights {
  int32_t s, u;
};

// Returns false if there are none. The fourth element of points is 0.
#ifdef __wasm__
__attribute__((noinline))  // 1 kB of web/unpacker.wasm
#endif
inline bool affine_weights(Vertex a, Vertex b, Vertex o, Vertex v, VertexWeights& w) {
  Vertex e = b - a, f = o - a, r = v - a;
  const uint32_t length = bit_length(any(absolute(e) | absolute(f) | absolute(r)));
  if (length > 14) {
    e = shifted_right(e, length - 14);
    f = shifted_right(f, length - 14);
    r = shifted_right(r, length - 14);
  }
  int32_t ee = int32_t(dot(e, e)), ef = int32_t(dot(e, f)), ff = int32_t(dot(f, f)),
          re = int32_t(dot(r, e)), rf = int32_t(dot(r, f));
  const uint32_t n =
      bit_length(uint32_t(ee | ff) | magnitude(uint32_t(re)) | magnitude(uint32_t(rf)));
  const uint32_t right = n > 15 ? n - 15 : 0, left = n > 15 ? 0 : 15 - n;
  for (int32_t* x : {&ee, &ef, &ff, &re, &rf}) *x = int32_t(uint32_t(*x >> right) << left);
  const int32_t p = ee * ff, determinant = p - ef * ef, divisor = determinant >> 8;
  if (determinant <= p >> 5 || divisor == 0) return false;
  w.s = int32_t(uint32_t(re) * uint32_t(ff) - uint32_t(rf) * uint32_t(ef)) / divisor;
  w.u = int32_t(uint32_t(rf) * uint32_t(ee) - uint32_t(re) * uint32_t(ef)) / divisor;
  const int32_t limit = AFFINE_WEIGHT_LIMIT;
  return w.s > -limit && w.s < limit && w.u > -limit && w.u < limit;
}
// Likewise of v projected onto the line from a to b: without o.
inline bool line_weights(Vertex a, Vertex b, Vertex v, VertexWeights& w) {
  Vertex e = b - a, r = v - a;
  const uint32_t length = bit_length(any(absolute(e) | absolute(r)));
  if (length > 10) {
    e = shifted_right(e, length - 10);
    r = shifted_right(r, length - 10);
  }
  const int32_t ee = int32_t(dot(e, e)), re = int32_t(dot(r, e));
  if (ee <= 0 || re < 0 || re > ee) return false;
  w = {(256 * re + ee / 2) / ee, 0};
  return true;
}
inline Vertex affine(Vertex x, Vertex y, Vertex z, VertexWeights w) {
  return x +
         shifted_right(all_of(uint32_t(w.s)) * (y - x) + all_of(uint32_t(w.u)) * (z - x) + 128u, 8);
}

// The next point on the way from a to b, n edges away, rounded: a + floor((b - a + n / 2) / n) for
// 2 <= n <= MESHLET_VERTICES; a and b have PREDICT_MAX_BITS.
#if MESHLET_AVX2
// x / n = x * factor >> shift for x < n << 25, with a factor of 32 bits: it is too large by less
// than 1, so the quotient is too large by less than n 2^25 / 2^shift <= 1 / n.
struct VertexReciprocals {
  uint64_t factor[65] = {}, shift[65] = {};
  constexpr VertexReciprocals() {
    for (uint64_t n = 2; n <= 64; n++) {
      shift[n] = 31;
      while (n > 1ull << (shift[n] - 31)) shift[n]++;
      factor[n] = ((1ull << shift[n]) + n - 1) / n;
    }
  }
};
inline Vertex step_toward(Vertex a, Vertex b, uint32_t n) {
  static constexpr VertexReciprocals reciprocals;
  const __m128i factor = _mm_set1_epi64x(int64_t(reciprocals.factor[n])),
                shift = _mm_cvtsi64_si128(int64_t(reciprocals.shift[n]));
  const __m128i x = __m128i(b - a + ((n >> 1) + (n << 24)));  // the bias keeps it positive
  const __m128i even = _mm_srl_epi64(_mm_mul_epu32(x, factor), shift),
                odd = _mm_srl_epi64(_mm_mul_epu32(_mm_srli_epi64(x, 32), factor), shift);
  return a + Vertex(_mm_or_si128(even, _mm_slli_epi64(odd, 32))) - (1u << 24);
}
#elif defined(__wasm_simd128__)
using Doubles = double __attribute__((vector_size(32)));
using Words = uint32_t __attribute__((vector_size(32)));
// The last sum rounds the quotient, which is nowhere half-way between two integers, and leaves it
// in the low word.
inline Vertex step_toward(Vertex a, Vertex b, uint32_t n) {
  const double half = n % 2u == 0u ? 0.5 : 0.0, factor = 1.0 / n;
  const Doubles way = __builtin_convertvector(SignedVertex(b - a), Doubles);
  const Words sum = Words((way + half) * factor + 0x1.8p52);
  return a + __builtin_shufflevector(sum, sum, 0, 2, 4, 6);
}
#else
inline Vertex step_toward(Vertex a, Vertex b, uint32_t n) {
  const Vertex x = b - a + n / 2, sign = shifted_right(x, 31), size = x ^ sign;
  const uint64_t reciprocal = ~0u / n + 1;  // exact for numbers below 2^32 / n
  Vertex quotient;
  for (uint32_t c = 0; c < 4; c++) quotient[c] = uint32_t(size[c] * reciprocal >> 32);
  return a + (quotient ^ sign);
}
#endif

// Of a traversed vertex by its gate's vertices a and b and the vertex o across the gate; without
// that, PREDICT_COPY or PREDICT_MEAN.
template <uint32_t predictor>
Vertex predicted(Vertex a, Vertex b, Vertex o) {
  if (predictor == PREDICT_COPY) return a;
  if (predictor == PREDICT_MEAN) return (a + b) >> 1;
  if (predictor == PREDICT_DAMPED) return shifted_right((a + b) * 3 - o * 2 + 2, 2);
  return a + b - o;
}

// The octahedral integers of a direction, of `bits` bits.
inline Vertex octahedral(Vertex n, uint32_t bits) {
  const uint32_t M = (1u << bits) - 2;
  const Vertex a = absolute(n);
  const uint32_t length = bit_length(a[0] | a[1] | a[2]), k = length > 13 ? length - 13 : 0;
  const uint32_t x = a[0] >> k, y = a[1] >> k, z = a[2] >> k, d = x + y + z;
  if (d == 0) return Vertex{M >> 1, M >> 1, 0, 0};
  const bool below = int32_t(n[2]) < 0;
  uint32_t X = below ? d - y : x, Y = below ? d - x : y;
  X = int32_t(n[0]) < 0 ? d - X : d + X;
  Y = int32_t(n[1]) < 0 ? d - Y : d + Y;
  return Vertex{(X * M + d) / (2 * d), (Y * M + d) / (2 * d), 0, 0};
}

}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

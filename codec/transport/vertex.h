// The elements of a vertex as a vector of four integers, modulo 2^32, and the predictions of
// EXT_meshlet_edgebreaker on them (its section A.7).
#ifndef TRANSPORT_VERTEX_H
#define TRANSPORT_VERTEX_H
#include <cstdint>
#include <cstring>

#include "format/constants.h"
#include "transport/adaptive_coder.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

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
inline Vertex shifted(Vertex v, uint32_t n) { return Vertex(SignedVertex(v) >> int32_t(n)); }
inline Vertex absolute(Vertex v) {
  const Vertex sign = shifted(v, 31);
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
struct Weights {
  int32_t s, u;
};

// Returns false if there are none. The fourth element of points is 0.
inline bool affine_weights(Vertex a, Vertex b, Vertex o, Vertex v, Weights& w) {
  Vertex e = b - a, f = o - a, r = v - a;
  const uint32_t length = bit_length(any(absolute(e) | absolute(f) | absolute(r)));
  if (length > 14) {
    e = shifted(e, length - 14);
    f = shifted(f, length - 14);
    r = shifted(r, length - 14);
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
inline Vertex affine(Vertex x, Vertex y, Vertex z, Weights w) {
  return x + shifted(all_of(uint32_t(w.s)) * (y - x) + all_of(uint32_t(w.u)) * (z - x) + 128u, 8);
}

// p + floor((e - p + d / 2) / d) for 2 <= d <= MESHLET_VERTICES; p and e have PREDICT_MAX_BITS.
inline Vertex toward(Vertex p, Vertex e, uint32_t d) {
  const Vertex n = e - p + d / 2, sign = shifted(n, 31), size = n ^ sign;
  const uint64_t reciprocal = ~0u / d + 1;  // exact for numbers below 2^32 / d
  Vertex quotient;
  for (uint32_t c = 0; c < 4; c++) quotient[c] = uint32_t(size[c] * reciprocal >> 32);
  return p + (quotient ^ sign);
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

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

// Bits of numbers.
#pragma once
#include <cstdint>

namespace gltf_meshlet_codec {

// Position of the highest one, from 1; of 0, 0.
inline uint32_t bit_length(uint32_t x) { return x ? 32u - uint32_t(__builtin_clz(x)) : 0u; }
inline uint32_t count_of(uint64_t mask) { return uint32_t(__builtin_popcountll(mask)); }

// The zigzag number of a difference of integers of `bits` bits, which counts modulo 2^bits.
inline uint32_t zigzag(uint32_t difference, uint32_t bits) {
  const uint32_t unused = 32 - bits;
  difference = uint32_t(int32_t(difference << unused) >> unused);
  return difference << 1 ^ (0u - (difference >> 31));
}

}  // namespace gltf_meshlet_codec

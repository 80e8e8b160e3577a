// Sizes of residuals under a code: Rice with separate planes, or fixed widths (spec, appendix A.5,
// section C).
#pragma once
#include <cstdint>
#include <vector>

#include "format/constants.h"

namespace meshlet {

inline uint32_t zigzag(uint32_t difference) { return difference << 1 ^ (0u - (difference >> 31)); }
inline uint32_t bit_length(uint32_t u) { return u ? 32u - uint32_t(__builtin_clz(u)) : 0u; }

// Bits of the residuals under Rice parameter k, without the parameter itself. Returns a huge number
// if a quotient exceeds MAX_QUOTIENT.
inline uint64_t rice_bits(const std::vector<uint32_t>& residuals, uint32_t k) {
  uint64_t bits = residuals.size() * uint64_t(k + 1);
  uint32_t largest = 0;
  for (uint32_t u : residuals) {
    bits += u >> k;
    largest |= u >> k;
  }
  return largest > MAX_QUOTIENT ? ~0ull >> 8 : bits;
}

// The Rice parameter with the fewest bits, searched for around the mean's bit length.
inline uint32_t best_rice(const std::vector<uint32_t>& residuals) {
  uint64_t sum = 0;
  for (uint32_t u : residuals) sum += u;
  uint32_t k = residuals.empty() ? 0 : bit_length(uint32_t(sum / residuals.size()));
  uint32_t best = k > 1 ? k - 2 : 0;
  for (uint32_t i = best + 1; i <= k + 1 && i <= RICE_MAX; i++)
    if (rice_bits(residuals, i) < rice_bits(residuals, best)) best = i;
  return best;
}

}  // namespace meshlet

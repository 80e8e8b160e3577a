// The Hilbert curve through a cube of 1024 x 1024 x 1024 cells (J. Skilling, Programming the
// Hilbert curve, AIP Conference Proceedings 707, 2004).
#pragma once

#include <array>
#include <cstdint>

namespace meshlet {

constexpr int kHilbertBits = 10;  // per axis

// The place of a cell on the curve: Skilling's transposed index, interleaved.
inline uint32_t hilbert_index(std::array<uint32_t, 3> x) {
  for (uint32_t q = 1u << (kHilbertBits - 1); q > 1; q >>= 1) {
    for (int i = 0; i < 3; i++) {
      if (x[i] & q) {
        x[0] ^= q - 1;
      } else {
        const uint32_t swap = (x[0] ^ x[i]) & (q - 1);
        x[0] ^= swap;
        x[i] ^= swap;
      }
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  uint32_t flip = 0;
  for (uint32_t q = 1u << (kHilbertBits - 1); q > 1; q >>= 1)
    if (x[2] & q) flip ^= q - 1;
  uint32_t index = 0;
  for (int b = kHilbertBits - 1; b >= 0; --b)
    for (int i = 0; i < 3; i++) index = index << 1 | ((x[i] ^ flip) >> b & 1);
  return index;
}

}  // namespace meshlet

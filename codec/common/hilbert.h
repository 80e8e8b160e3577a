// The Hilbert curve through a cube of 1024 x 1024 x 1024 cells (J. Skilling, Programming the
// Hilbert curve, AIP Conference Proceedings 707, 2004).
#pragma once

#include <array>
#include <cstdint>

namespace meshlet {

constexpr int kHilbertBits = 10;  // per axis

// Skilling's algorithm as an automaton from the highest bit of the coordinates to the lowest. Its
// state is what higher bits do to lower ones: an order of the axes, which of them are inverted, and
// the parity of the Gray code.
class HilbertTable {
 public:
  constexpr HilbertTable() : steps_() {
    for (uint32_t state = 0; state < kStates; state++)
      for (uint32_t bits = 0; bits < 8; bits++) steps_[state][bits] = step(state, bits);
  }

  // The place of a cell on the curve.
  uint32_t index(const std::array<uint32_t, 3>& cell) const {
    uint32_t state = 0, index = 0;
    for (int b = kHilbertBits - 1; b >= 0; --b) {
      const uint32_t bits = (cell[0] >> b & 1) << 2 | (cell[1] >> b & 1) << 1 | (cell[2] >> b & 1);
      index = index << 3 | (steps_[state][bits] & 7);
      state = steps_[state][bits] >> 3;
    }
    return index;
  }

 private:
  static constexpr uint32_t kStates = 96;  // order << 4 | inverted z, y, x | parity

  // Returns the next state << 3 | three bits of the index. bits: x << 2 | y << 1 | z.
  static constexpr uint16_t step(uint32_t state, uint32_t bits) {
    constexpr uint32_t orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                       {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    uint32_t axis[3] = {}, inverted[3] = {}, digit[3] = {};
    for (uint32_t i = 0; i < 3; i++) {
      axis[i] = orders[state >> 4][i];
      inverted[i] = state >> (1 + i) & 1;
      digit[i] = (bits >> (2 - axis[i]) & 1) ^ inverted[i];
    }
    for (uint32_t i = 0; i < 3; i++) {
      if (digit[i]) {
        inverted[0] ^= 1;
        continue;
      }
      const uint32_t former_axis = axis[0], former_inverted = inverted[0];
      axis[0] = axis[i], inverted[0] = inverted[i];
      axis[i] = former_axis, inverted[i] = former_inverted;
    }
    const uint32_t parity = state & 1, y = digit[1] ^ digit[0], z = digit[2] ^ y;
    uint32_t order = 0;
    while (orders[order][0] != axis[0] || orders[order][1] != axis[1]) order++;
    const uint32_t next =
        order << 4 | inverted[2] << 3 | inverted[1] << 2 | inverted[0] << 1 | (parity ^ z);
    return uint16_t(next << 3 | (digit[0] ^ parity) << 2 | (y ^ parity) << 1 | (z ^ parity));
  }

  uint16_t steps_[kStates][8];
};

// The place of a cell on the curve.
inline uint32_t hilbert_index(const std::array<uint32_t, 3>& cell) {
  static constexpr HilbertTable table;
  return table.index(cell);
}

}  // namespace meshlet

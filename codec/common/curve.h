// Sorts along the Hilbert curve through a cube of 1024 x 1024 x 1024 cells (J. Skilling,
// Programming the Hilbert curve, AIP Conference Proceedings 707, 2004).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "common/array.h"
#include "common/parallel.h"
#include "common/vec3.h"

namespace gltf_meshlet_codec {

constexpr int kCurveBits = 10;  // per axis
constexpr int kCurveCells = 1 << kCurveBits;

// Skilling's algorithm as an automaton from the highest bits of the coordinates to the lowest. Its
// state is what higher bits do to lower ones: an order of the axes, which of them are inverted, and
// the parity of the Gray code.
class HilbertTable {
 public:
  constexpr HilbertTable() : steps_() {
    uint16_t single[kStates][8] = {};
    for (uint32_t state = 0; state < kStates; state++)
      for (uint32_t bits = 0; bits < 8; bits++) single[state][bits] = step(state, bits);
    for (uint32_t state = 0; state < kStates; state++)
      for (uint32_t bits = 0; bits < 64; bits++) {
        const uint32_t high = single[state][bits >> 3], low = single[high >> 3][bits & 7];
        steps_[state][bits] = uint16_t(low >> 3 << 6 | (high & 7) << 3 | (low & 7));
      }
  }

  // The place of a cell on the curve.
  uint32_t index(const std::array<uint32_t, 3>& cell) const {
    const uint32_t mixed = spread(cell[0]) << 2 | spread(cell[1]) << 1 | spread(cell[2]);
    uint32_t state = 0, index = 0;
    for (int b = 3 * kCurveBits - 6; b >= 0; b -= 6) {
      const uint32_t next = steps_[state][mixed >> b & 63];
      index = index << 6 | (next & 63);
      state = next >> 6;
    }
    return index;
  }

 private:
  static constexpr uint32_t kStates = 96;  // order << 4 | inverted z, y, x | parity

  // Moves bit i to bit 3 i.
  static uint32_t spread(uint32_t bits) {
    static_assert(kCurveBits == 10);
    bits = (bits | bits << 16) & 0x030000FFu;
    bits = (bits | bits << 8) & 0x0300F00Fu;
    bits = (bits | bits << 4) & 0x030C30C3u;
    return (bits | bits << 2) & 0x09249249u;
  }

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

  // By two bits of each coordinate: the next state << 6 | six bits of the index.
  uint16_t steps_[kStates][64];
};

// Returns 0 .. codes.size() - 1 by code, equal ones by number. Codes have 3 * kCurveBits bits.
Array<uint32_t> sorted_by_code(Array<uint32_t> codes, int threads);

// Returns the numbers of at least one point along the curve, through their box with `cells` cells
// on its longest side.
Array<uint32_t> order_in_box(const std::vector<Vec3>& points, int cells);

// Returns the numbers of the points along the curve, those in one cell by number. point(i): the
// position of point i < count, in cells; points outside the cube are moved to its border.
template <class Point>
Array<uint32_t> order_along_curve(size_t count, int threads, Point&& point) {
  static constexpr HilbertTable table;
  const auto cell = [](float x) {
    return x > 0 ? uint32_t(std::min(x, float(kCurveCells - 1))) : 0;  // 0 also for NaN
  };
  Array<uint32_t> codes(count);
  for_blocks(threads, count, 1 << 15, [&](size_t, size_t first, size_t last) {
    for (size_t i = first; i < last; i++) {
      const Vec3 p = point(i);
      codes[i] = table.index({cell(p.x), cell(p.y), cell(p.z)});
    }
  });
  return sorted_by_code(std::move(codes), threads);
}

}  // namespace gltf_meshlet_codec

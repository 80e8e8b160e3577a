#include "common/curve.h"

#include <vector>

namespace gltf_meshlet_codec {
namespace {

constexpr size_t kBlock = 1 << 15;  // codes per parallel item

}  // namespace

// A radix sort of kCurveBits at a time. Each block counts and places its own codes, after those of
// the blocks before it.
Array<uint32_t> sorted_by_code(Array<uint32_t> codes, int threads) {
  using Counts = std::array<uint32_t, kCurveCells>;
  const size_t count = codes.size();
  Array<uint32_t> order(count), next_order(count), next_codes(count);
  std::vector<Counts> places(block_count(count, kBlock));
  for (int shift = 0; shift < 3 * kCurveBits; shift += kCurveBits) {
    const auto digit = [&](uint32_t code) { return code >> shift & (kCurveCells - 1); };
    for_blocks(threads, count, kBlock, [&](size_t b, size_t first, size_t last) {
      places[b].fill(0);
      for (size_t i = first; i < last; i++) ++places[b][digit(codes[i])];
    });
    uint32_t begin = 0;
    for (size_t d = 0; d < kCurveCells; d++)
      for (Counts& block : places) {
        const uint32_t size = block[d];
        block[d] = begin;
        begin += size;
      }
    for_blocks(threads, count, kBlock, [&](size_t b, size_t first, size_t last) {
      for (size_t i = first; i < last; i++) {
        const uint32_t to = places[b][digit(codes[i])]++;
        next_order[to] = shift == 0 ? uint32_t(i) : order[i];
        next_codes[to] = codes[i];
      }
    });
    order.swap(next_order);
    codes.swap(next_codes);
  }
  return order;
}

Array<uint32_t> order_in_box(const std::vector<Vec3>& points, int cells) {
  const Box box = box_of(points);
  const float longest = box.longest_side(), scale = longest > 0 ? float(cells) / longest : 0;
  return order_along_curve(points.size(), 1,
                           [&](size_t i) { return (points[i] - box.low) * scale; });
}

}  // namespace gltf_meshlet_codec

#include "texcoord_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace meshlet_shape {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr uint64_t kFewEntries = 1 << 16;
constexpr uint64_t kEntriesPerItem = 16;

// The cell of a texture coordinate on its axis, of n.
uint32_t cell_of(float coordinate, uint32_t n) {
  const double cell = std::floor(double(coordinate) * n);
  return uint32_t(cell - n * std::floor(cell / n));
}

// The number of cells between two texture coordinates, both included: each cell once.
uint32_t cells_between(float low, float high, uint32_t n) {
  const double cells = std::floor(double(high) * n) - std::floor(double(low) * n) + 1;
  return uint32_t(std::min(cells, double(n)));
}

}  // namespace

void TexcoordCells::add(uint32_t item, const std::vector<float>& corners) {
  Extent extent{item, {kInfinity, kInfinity}, {-kInfinity, -kInfinity}};
  for (size_t i = 0; i < corners.size(); i++) {
    if (!std::isfinite(corners[i])) continue;
    extent.low[i % 2] = std::min(extent.low[i % 2], corners[i]);
    extent.high[i % 2] = std::max(extent.high[i % 2], corners[i]);
  }
  if (extent.low[0] <= extent.high[0] && extent.low[1] <= extent.high[1])
    extents_.push_back(extent);
}

uint64_t TexcoordCells::entries() const {
  uint64_t total = 0;
  for (const Extent& e : extents_)
    total += uint64_t(cells_between(e.low[0], e.high[0], per_axis)) *
             cells_between(e.low[1], e.high[1], per_axis);
  return total;
}

template <class Function>
void TexcoordCells::for_each_cell(const Extent& e, Function&& f) const {
  const uint32_t x = cell_of(e.low[0], per_axis),
                 columns = cells_between(e.low[0], e.high[0], per_axis);
  const uint32_t y = cell_of(e.low[1], per_axis),
                 rows = cells_between(e.low[1], e.high[1], per_axis);
  for (uint32_t row = y; row < y + rows; row++)
    for (uint32_t column = x; column < x + columns; column++)
      f(row % per_axis * per_axis + column % per_axis);
}

void TexcoordCells::sort() {
  const uint64_t most = std::max(kFewEntries, kEntriesPerItem * extents_.size());
  while (per_axis > 1 && entries() > most) per_axis /= 2;
  first.assign(per_axis * per_axis + 1, 0);
  for (const Extent& e : extents_) for_each_cell(e, [&](uint32_t cell) { first[cell + 1]++; });
  for (size_t c = 1; c < first.size(); c++) first[c] += first[c - 1];
  items.resize(first.back());
  std::vector<uint32_t> next = first;
  for (const Extent& e : extents_)
    for_each_cell(e, [&](uint32_t cell) { items[next[cell]++] = e.item; });
  extents_ = {};
}

uint32_t TexcoordCells::cell(const float (&uv)[2]) const {
  return cell_of(uv[1], per_axis) * per_axis + cell_of(uv[0], per_axis);
}

}  // namespace meshlet_shape

#include "texcoord_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace meshlet_shape {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// The cell of a texture coordinate on its axis.
uint32_t cell_of(float coordinate) {
  const double cell = std::floor(double(coordinate) * kUvCells);
  return uint32_t(cell - kUvCells * std::floor(cell / kUvCells));
}

// The number of cells between two texture coordinates, both included: each cell once.
uint32_t cells_between(float low, float high) {
  const double cells = std::floor(double(high) * kUvCells) - std::floor(double(low) * kUvCells) + 1;
  return uint32_t(std::min(cells, double(kUvCells)));
}

}  // namespace

void TexcoordCells::add(uint32_t item, const std::vector<float>& corners) {
  float low[2] = {kInfinity, kInfinity}, high[2] = {-kInfinity, -kInfinity};
  for (size_t i = 0; i < corners.size(); i++) {
    if (!std::isfinite(corners[i])) continue;
    low[i % 2] = std::min(low[i % 2], corners[i]);
    high[i % 2] = std::max(high[i % 2], corners[i]);
  }
  if (low[0] > high[0] || low[1] > high[1]) return;  // no number is finite
  const uint32_t x = cell_of(low[0]), columns = cells_between(low[0], high[0]);
  const uint32_t y = cell_of(low[1]), rows = cells_between(low[1], high[1]);
  for (uint32_t row = y; row < y + rows; row++)
    for (uint32_t column = x; column < x + columns; column++)
      found_.push_back({row % kUvCells * kUvCells + column % kUvCells, item});
}

void TexcoordCells::sort() {
  std::stable_sort(found_.begin(), found_.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  first.assign(kUvCells * kUvCells + 1, 0);
  items.clear();
  for (const auto& [cell, item] : found_) {
    first[cell + 1]++;
    items.push_back(item);
  }
  for (size_t c = 1; c < first.size(); c++) first[c] += first[c - 1];
  found_ = {};
}

uint32_t TexcoordCells::cell(const float (&uv)[2]) {
  return cell_of(uv[1]) * kUvCells + cell_of(uv[0]);
}

}  // namespace meshlet_shape

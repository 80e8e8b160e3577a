// A grid over wrapped texture coordinates, by which emitters with textures find points.
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

namespace meshlet_shape {

constexpr uint32_t kUvCells = 64;  // per axis

// Items (triangles, or meshlets of them) and their cells.
struct TexcoordCells {
  // Cell c has items[first[c] .. first[c + 1]).
  std::vector<uint32_t> first, items;

  // corners: pairs of texture coordinates of an item's vertices. Those that are not finite count
  // for nothing.
  void add(uint32_t item, const std::vector<float>& corners);
  // After the last item.
  void sort();

  // The cell of texture coordinates, which repeat; in double, no finite one overflows.
  static uint32_t cell(const float (&uv)[2]);

 private:
  std::vector<std::pair<uint32_t, uint32_t>> found_;  // cell, item
};

}  // namespace meshlet_shape

// A grid over wrapped texture coordinates, by which emitters with textures find points.
#pragma once
#include <cstdint>
#include <vector>

namespace meshlet_shape {

// Items (triangles, or meshlets of them) and their cells.
struct TexcoordCells {
  // Cells per axis. Fewer where textures repeat over most items, which would lie in all cells.
  uint32_t per_axis = 64;
  // Cell c has items[first[c] .. first[c + 1]).
  std::vector<uint32_t> first, items;

  // corners: pairs of texture coordinates of an item's vertices. Those that are not finite count
  // for nothing.
  void add(uint32_t item, const std::vector<float>& corners);
  // After the last item.
  void sort();

  // The cell of texture coordinates, which repeat; in double, no finite one overflows.
  uint32_t cell(const float (&uv)[2]) const;

 private:
  struct Extent {
    uint32_t item;
    float low[2], high[2];
  };

  uint64_t entries() const;
  template <class Function>
  void for_each_cell(const Extent& extent, Function&& f) const;

  std::vector<Extent> extents_;
};

}  // namespace meshlet_shape

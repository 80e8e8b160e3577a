// Parts of a partition, as they are put together.
#pragma once

#include <cstdint>
#include <vector>

#include "segment/disks.h"

namespace meshlet {

// Some meshlets, laid out as in Meshlets.
struct Piece {
  std::vector<uint32_t> triangles;
  std::vector<uint32_t> disk_begin{0};
  std::vector<uint32_t> meshlet_begin{0};
  std::vector<uint32_t> vertices;  // of each meshlet

  uint32_t count() const { return static_cast<uint32_t>(vertices.size()); }
  // Where the meshlet's triangles begin; those of the last one end at first_triangle(count()).
  uint32_t first_triangle(uint32_t meshlet) const { return disk_begin[meshlet_begin[meshlet]]; }

  // Adds all meshlets of another piece.
  void append(const Piece& other);
  // Adds one meshlet that consists of these disks.
  void append_meshlet(const Disks& disks);
  // Adds one meshlet that consists of all components of these meshlets of another piece.
  void append_joined(const Piece& other, const std::vector<uint32_t>& meshlets);
};

}  // namespace meshlet

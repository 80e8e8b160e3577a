// A list of meshlets that grows while the mesh is partitioned.
#pragma once

#include <cstdint>
#include <vector>

#include "segment/disks.h"

namespace meshlet {

// Laid out as in Meshlets.
struct MeshletList {
  std::vector<uint32_t> triangles;
  std::vector<uint32_t> disk_begin{0};
  std::vector<uint32_t> meshlet_begin{0};
  std::vector<uint32_t> vertices;  // number of vertices of each meshlet

  uint32_t count() const { return uint32_t(vertices.size()); }
  // Index of the meshlet's first triangle; first_triangle(count()) is the end.
  uint32_t first_triangle(uint32_t meshlet) const { return disk_begin[meshlet_begin[meshlet]]; }

  // Appends all meshlets of another list.
  void append(const MeshletList& other);
  // Appends one meshlet of these disks.
  void append_meshlet(const Disks& disks);
  // Appends one meshlet of all disks of these meshlets of another list.
  void append_joined(const MeshletList& other, const std::vector<uint32_t>& meshlets);
};

}  // namespace meshlet

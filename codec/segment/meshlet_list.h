// A list of meshlets of a mesh.
#pragma once

#include <cstdint>
#include <vector>

#include "segment/disks.h"

namespace gltf_meshlet_codec {

// A meshlet is a range of disks, a disk a range of triangles.
struct MeshletList {
  std::vector<uint32_t> triangles;         // their numbers in the mesh
  std::vector<uint32_t> disk_begin{0};     // disk k: triangles[disk_begin[k] .. disk_begin[k + 1])
  std::vector<uint32_t> meshlet_begin{0};  // meshlet m: disks from meshlet_begin[m] on, likewise
  std::vector<uint32_t> vertices;  // number of vertices of each meshlet; empty for a caller's

  uint32_t count() const { return uint32_t(meshlet_begin.size() - 1); }
  // Place of the meshlet's first triangle; first_triangle(count()) is the end.
  uint32_t first_triangle(size_t meshlet) const { return disk_begin[meshlet_begin[meshlet]]; }

  // Appends all meshlets of another list.
  void append(const MeshletList& other);
  // Appends one meshlet of these disks.
  void append_meshlet(const Disks& disks);
  // Appends one meshlet of all disks of these meshlets of another list.
  void append_joined(const MeshletList& other, const std::vector<uint32_t>& meshlets);
};

}  // namespace gltf_meshlet_codec

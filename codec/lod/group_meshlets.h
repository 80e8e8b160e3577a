// Meshlets inside groups of triangles: the clusters of a level of detail.
#pragma once
#include <cstdint>
#include <vector>

#include "segment/generate_meshlets.h"

namespace meshlet {

// Meshlets as ranges of disks, disks as ranges of triangles, as in Meshlets; group g holds meshlets
// group_begin[g] .. group_begin[g + 1].
struct GroupMeshlets {
  std::vector<uint32_t> triangles;  // their numbers in the mesh
  std::vector<uint32_t> disk_begin, meshlet_begin, group_begin;
};

// Generates meshlets that never cross groups. Group g is the mesh's triangles triangle_begin[g] ..
// triangle_begin[g + 1], at least one. Otherwise as generate_meshlets.
GroupMeshlets generate_in_groups(const MeshView& mesh, const std::vector<uint32_t>& triangle_begin,
                                 const GenerationOptions& options);

}  // namespace meshlet

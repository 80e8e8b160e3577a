// Meshlets inside groups of triangles: the clusters of a level of detail.
#pragma once
#include <cstdint>
#include <vector>

#include "segment/generate_meshlets.h"

namespace gltf_meshlet_codec {

// Group g holds meshlets group_begin[g] .. group_begin[g + 1].
struct GroupMeshlets : MeshletList {
  std::vector<uint32_t> group_begin{0};
};

// Generates meshlets that never cross groups. Group g is the mesh's triangles triangle_begin[g] ..
// triangle_begin[g + 1], at least one. Otherwise as generate_meshlets.
GroupMeshlets generate_in_groups(const MeshView& mesh, const std::vector<uint32_t>& triangle_begin,
                                 const GenerationOptions& options);

}  // namespace gltf_meshlet_codec

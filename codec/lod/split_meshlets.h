// Meshlets of a caller, cut into disks.
#pragma once
#include <cstdint>
#include <vector>

#include "lod/group_meshlets.h"

namespace gltf_meshlet_codec {

// Meshlet m is the triangles order[meshlet_begin[m]] .. order[meshlet_begin[m + 1]], which need not
// hang together. It becomes one meshlet of disks if it has at most 64 triangles and its disks at
// most 64 vertices, else several: group m of the result. Throws std::invalid_argument unless
// `order` holds each triangle once and the begins increase to its end.
GroupMeshlets split_meshlets(const MeshView& mesh, const std::vector<uint32_t>& order,
                             const std::vector<uint32_t>& meshlet_begin,
                             const GenerationOptions& options);

}  // namespace gltf_meshlet_codec

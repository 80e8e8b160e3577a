// The mesh that the encoder reads.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gltf_meshlet_codec {

// triangles: at least one, below 2^31 / 3; three different vertex numbers each. position_ids[v] <
// vertex_count is equal for two vertices if and only if their positions are bit-identical.
// positions: three finite floats per vertex.
struct MeshView {
  const uint32_t* triangles;
  size_t triangle_count;
  const uint32_t* position_ids;
  const float* positions;
  size_t vertex_count;
};

}  // namespace gltf_meshlet_codec

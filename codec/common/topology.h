// Counts that say whether a mesh is closed and in how many pieces.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gltf_meshlet_codec {

struct Topology {
  uint64_t vertices = 0;        // of triangles
  uint64_t boundary_edges = 0;  // that exactly one triangle has
  uint64_t islands = 0;         // connected by vertices
};

// triangles: three vertex numbers each, below vertex_count.
Topology topology_of(const uint32_t* triangles, size_t triangle_count, size_t vertex_count);

}  // namespace gltf_meshlet_codec

// Matches half-edges: which triangles share an edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/array.h"
#include "segment/mesh_view.h"

namespace gltf_meshlet_codec {

inline uint32_t next_in_triangle(uint32_t half_edge) {
  return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1;
}

// Half-edge 3t+k runs from corner k to corner (k+1)%3 of triangle t. Two half-edges are opposite if
// they alone share an edge, belong to different triangles, and run in opposite directions.
class HalfEdges {
 public:
  // match_half_edges makes it.
  explicit HalfEdges(Array<int32_t> opposite) : opposite_(std::move(opposite)) {}

  size_t size() const { return opposite_.size(); }

  // The opposite half-edge between the same vertices; negative if there is none.
  int32_t by_vertex(size_t half_edge) const { return opposite_[half_edge]; }

  // The same, or else the opposite one between the same positions, among those without an opposite
  // one by vertex; -1 if there is none.
  int32_t by_position(size_t half_edge) const {
    const int32_t other = opposite_[half_edge];
    return other <= kByPosition ? kByPosition - other : other;
  }

  static constexpr int32_t kNone = -1;
  static constexpr int32_t kByPosition = -2;  // minus the opposite half-edge's number

 private:
  Array<int32_t> opposite_;
};

HalfEdges match_half_edges(const MeshView& mesh, int threads);

}  // namespace gltf_meshlet_codec

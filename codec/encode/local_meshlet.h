// One meshlet with local numbers, small enough for a core's first-level cache.
#pragma once
#include <cstdint>

#include "encode/boundaries.h"
#include "format/constants.h"

namespace gltf_meshlet_codec {

// The encoder's input.
struct EncoderInput {
  const MeshView& mesh;
  const HalfEdges& half_edges;  // match_half_edges of the mesh
  const Meshlets& meshlets;
  const VertexValues& values;
};

// The disks of a meshlet, added one by one. Vertices of each disk: first those of its boundary loop
// in loop order, then the others. Half-edge 3 * t + k as everywhere.
class LocalMeshlet {
 public:
  static constexpr uint32_t kHalfEdges = 3 * MESHLET_TRIANGLES;
  static constexpr uint8_t kNoHalfEdge = 255;

  LocalMeshlet(const EncoderInput& input, const Boundaries& boundaries)
      : input_(input), boundaries_(boundaries) {}

  void clear() { triangle_count_ = vertex_count_ = 0; }
  // Throws std::logic_error if the disk is none, or the meshlet exceeds a limit.
  void add_disk(uint32_t disk);

  uint32_t triangle_count() const { return triangle_count_; }
  uint32_t vertex_count() const { return vertex_count_; }
  // The number of a local vertex in the mesh.
  uint32_t vertex(uint32_t local) const { return vertex_[local]; }
  // The local vertex at the start of a half-edge.
  uint32_t start(uint32_t half_edge) const { return start_[half_edge]; }
  // The opposite half-edge in the same disk, or kNoHalfEdge.
  uint32_t opposite(uint32_t half_edge) const { return opposite_[half_edge]; }

  // These describe the disk added last.
  uint32_t first_triangle() const { return first_triangle_; }
  uint32_t first_vertex() const { return first_vertex_; }
  uint32_t loop_length() const { return loop_length_; }
  // The half-edge of a place of its loop, from 0.
  uint32_t loop_half_edge(uint32_t place) const { return loop_half_edge_[place]; }

 private:
  const EncoderInput& input_;
  const Boundaries& boundaries_;
  uint32_t triangle_count_ = 0, vertex_count_ = 0;
  uint32_t first_triangle_ = 0, first_vertex_ = 0, loop_length_ = 0;
  uint8_t start_[kHalfEdges], opposite_[kHalfEdges];
  uint32_t vertex_[MESHLET_VERTICES];
  uint8_t loop_half_edge_[MESHLET_VERTICES];
};

}  // namespace gltf_meshlet_codec

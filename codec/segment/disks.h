// Cuts a set of triangles into disks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "segment/half_edges.h"

namespace gltf_meshlet_codec {

// Disks, each a range of `triangles` (numbers in the mesh).
struct Disks {
  std::vector<uint32_t> triangles;
  std::vector<uint32_t> begin;     // disk k: triangles[begin[k] .. begin[k + 1])
  std::vector<uint32_t> vertices;  // number of vertices of each disk
  size_t vertex_count;             // sum over the disks

  size_t count() const { return begin.size() - 1; }
};

// Cuts sets of triangles of one mesh into disks. One thread at a time.
class DiskCutter {
 public:
  // Both must outlive this object.
  DiskCutter(const uint32_t* triangles, const HalfEdges& half_edges)
      : mesh_(triangles), half_edges_(half_edges) {}

  // Cuts at most MESHLET_TRIANGLES triangles into few, large disks.
  void cut(const uint32_t* triangles, size_t count, Disks& disks);

 private:
  static constexpr uint32_t kMaxTriangles = 64, kMaxVertices = 3 * kMaxTriangles;
  // A set of vertices.
  struct VertexSet {
    uint64_t words[kMaxVertices / 64] = {};
    bool test(uint32_t v) const { return words[v / 64] >> v % 64 & 1; }
    void insert(uint32_t v) { words[v / 64] |= 1ull << v % 64; }
  };

  void load(const uint32_t* triangles, size_t count);
  void grow_disk(const uint32_t* triangles, uint32_t first, Disks& disks);

  const uint32_t* mesh_;
  const HalfEdges& half_edges_;
  // These describe the set's triangles, by local numbers from 0.
  uint8_t corners_[kMaxTriangles][3];    // vertices
  int8_t neighbours_[kMaxTriangles][3];  // triangle across the half-edge from corner k, or -1
  uint8_t queue_[4 * kMaxTriangles];
  uint64_t taken_;  // triangles that are in a disk
};

}  // namespace gltf_meshlet_codec

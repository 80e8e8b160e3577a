// Cuts a set of triangles into disks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace meshlet {

// Some triangles of the mesh, with local numbers from 0 for triangles and vertices.
struct Cluster {
  std::vector<uint32_t> triangles;  // number in the mesh of local triangle i
  std::vector<uint16_t> corners;    // local vertex at corner k of triangle i: corners[3 * i + k]
  std::vector<int16_t> neighbours;  // local triangle across half-edge 3 * i + k, or -1
  size_t vertex_count;
};

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
  // half_edges: match_half_edges over vertices. Both arrays must outlive this object.
  DiskCutter(const uint32_t* triangles, const int32_t* half_edges)
      : mesh_(triangles), half_edges_(half_edges) {}

  // Cuts at most 2^14 triangles into few, large disks.
  void cut(const uint32_t* triangles, size_t count, Disks& disks);

 private:
  void load(const uint32_t* triangles, size_t count);
  void number_vertices();
  void join_triangles();
  void grow_disk(int16_t first, Disks& disks);
  bool keeps_disk(int16_t triangle, int shared_edges) const;
  void add(int16_t triangle, int shared_edges, Disks& disks);
  int shared_edges(int16_t triangle) const;

  const uint32_t* mesh_;
  const int32_t* half_edges_;
  Cluster cluster_;
  std::vector<uint32_t> hash_keys_;
  std::vector<uint16_t> hash_values_;
  std::vector<int32_t> disk_of_triangle_;  // -1: none yet
  std::vector<int32_t> disk_of_vertex_;    // last disk that took the vertex
  std::vector<int16_t> queue_;
  int32_t disk_ = 0;
  int boundary_ = 0;  // edges of the growing disk's boundary
};

}  // namespace meshlet

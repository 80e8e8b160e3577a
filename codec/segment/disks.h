// A few dozen triangles taken out of the mesh, with local numbers, and their partition into disks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace meshlet {

// Triangles and vertices of a cluster are numbered from 0.
struct Cluster {
  std::vector<uint32_t> triangles;  // the mesh's triangle behind local triangle i
  std::vector<uint16_t>
      corners;  // local vertex at corner k of local triangle i: corners[3 * i + k]
  std::vector<int16_t>
      neighbours;  // local triangle across half-edge 3 * i + k, joined by vertices; -1: none
  size_t vertex_count;
};

// Disks of a cluster, each a range of `triangles` (the mesh's numbers).
struct Disks {
  std::vector<uint32_t> triangles;
  std::vector<uint32_t> begin;     // disk k: triangles[begin[k] .. begin[k + 1])
  std::vector<uint32_t> vertices;  // of each disk
  size_t vertex_count;             // sum over the disks

  size_t count() const { return begin.size() - 1; }
};

// Takes clusters out of one mesh and cuts them into disks. An instance is used by one thread at a
// time.
class DiskCutter {
 public:
  // triangles: three vertices each. half_edges: match_half_edges over vertices. Both must outlive
  // this object.
  DiskCutter(const uint32_t* triangles, const int32_t* half_edges)
      : mesh_(triangles), half_edges_(half_edges) {}

  // Cuts the given triangles (at most 2^14) into few, large disks.
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
  std::vector<int32_t> disk_of_vertex_;    // the last disk that took the vertex
  std::vector<int16_t> queue_;
  int32_t disk_ = 0;
  int boundary_ = 0;  // edges of the growing disk's boundary
};

}  // namespace meshlet

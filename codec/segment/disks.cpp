#include "segment/disks.h"

#include "common/hash_map.h"
#include "format/constants.h"

namespace gltf_meshlet_codec {

void DiskCutter::cut(const uint32_t* triangles, size_t count, Disks& disks) {
  static_assert(kMaxTriangles == MESHLET_TRIANGLES);
  load(triangles, count);
  disks.triangles.clear();
  disks.triangles.reserve(count);
  disks.begin.assign(1, 0);
  disks.vertices.clear();
  disks.vertex_count = 0;
  taken_ = 0;
  for (uint32_t t = 0; t < count; t++)
    if (!(taken_ >> t & 1)) grow_disk(triangles, t, disks);
}

void DiskCutter::load(const uint32_t* triangles, size_t count) {
  HashMap<uint32_t, uint8_t, 8> place;
  HashMap<uint32_t, uint8_t, 9> vertex;
  for (uint32_t t = 0; t < count; t++) place.insert(triangles[t], uint8_t(t));
  uint32_t vertices = 0;
  for (uint32_t t = 0; t < count; t++) {
    for (uint32_t k = 0; k < 3; k++) {
      const size_t half_edge = 3 * size_t(triangles[t]) + k;
      const auto [id, is_new] = vertex.insert(mesh_[half_edge], uint8_t(vertices));
      vertices += is_new;
      corners_[t][k] = id;
      const int32_t other = half_edges_.by_vertex(half_edge);
      const uint8_t* found = other < 0 ? nullptr : place.find(uint32_t(other) / 3);
      neighbours_[t][k] = found ? int8_t(*found) : int8_t(-1);
    }
  }
}

// Adds triangles while the set stays a disk (a shelling). That never gets stuck inside a disk:
// triangles that can form one disk do.
void DiskCutter::grow_disk(const uint32_t* triangles, uint32_t first, Disks& disks) {
  uint64_t disk = 0;
  VertexSet vertices;
  int boundary = 0;  // edges
  uint32_t vertex_count = 0, head = 0, tail = 0;
  const auto add = [&](uint32_t t, int shared) {
    disk |= 1ull << t;
    taken_ |= 1ull << t;
    disks.triangles.push_back(triangles[t]);
    boundary += 3 - 2 * shared;
    for (int k = 0; k < 3; k++) {
      vertex_count += !vertices.test(corners_[t][k]);
      vertices.insert(corners_[t][k]);
      const int other = neighbours_[t][k];
      if (other >= 0 && !(taken_ >> other & 1)) queue_[tail++] = uint8_t(other);
    }
  };
  add(first, 0);
  // A rejected triangle is queued again whenever another neighbour joins: at most three times.
  for (; head < tail; head++) {
    const uint32_t t = queue_[head];
    if (taken_ >> t & 1) continue;
    int shared = 0, edge = 0;
    for (int k = 0; k < 3; k++) {
      const int other = neighbours_[t][k];
      if (other < 0 || !(disk >> other & 1)) continue;
      shared++;
      edge = k;
    }
    const bool keeps_disk =
        shared == 2 ? boundary > 3 : shared == 1 && !vertices.test(corners_[t][(edge + 2) % 3]);
    if (keeps_disk) add(t, shared);
  }
  disks.vertices.push_back(vertex_count);
  disks.vertex_count += vertex_count;
  disks.begin.push_back(uint32_t(disks.triangles.size()));
}

}  // namespace gltf_meshlet_codec

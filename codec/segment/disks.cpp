#include "segment/disks.h"

namespace meshlet {
namespace {

constexpr uint32_t kNoKey = ~0u;

// Open addressing: returns the slot of `key`, or the free slot to put it in. The table's size is a
// power of two.
size_t find_slot(const std::vector<uint32_t>& keys, uint32_t key) {
  const size_t mask = keys.size() - 1;
  size_t at = (key * 0x9E3779B1u >> 7) & mask;
  while (keys[at] != kNoKey && keys[at] != key) at = (at + 1) & mask;
  return at;
}

}  // namespace

void DiskCutter::cut(const uint32_t* triangles, size_t count, Disks& disks) {
  load(triangles, count);
  disks.triangles.clear();
  disks.begin.assign(1, 0);
  disks.vertices.clear();
  disks.vertex_count = 0;
  disk_of_triangle_.assign(count, -1);
  disk_of_vertex_.assign(cluster_.vertex_count, -1);
  disk_ = 0;
  for (size_t t = 0; t < count; t++) {
    if (disk_of_triangle_[t] >= 0) continue;
    disks.vertices.push_back(0);
    grow_disk(int16_t(t), disks);
    disks.begin.push_back(uint32_t(disks.triangles.size()));
    disks.vertex_count += disks.vertices.back();
    disk_++;
  }
}

void DiskCutter::load(const uint32_t* triangles, size_t count) {
  cluster_.triangles.assign(triangles, triangles + count);
  number_vertices();
  join_triangles();
}

void DiskCutter::number_vertices() {
  const size_t count = cluster_.triangles.size();
  size_t capacity = 64;
  while (capacity < 6 * count) capacity *= 2;
  hash_keys_.assign(capacity, kNoKey);
  hash_values_.resize(capacity);
  cluster_.corners.resize(3 * count);
  cluster_.vertex_count = 0;
  for (size_t i = 0; i < 3 * count; i++) {
    const uint32_t vertex = mesh_[3 * size_t(cluster_.triangles[i / 3]) + i % 3];
    const size_t at = find_slot(hash_keys_, vertex);
    if (hash_keys_[at] == kNoKey) {
      hash_keys_[at] = vertex;
      hash_values_[at] = uint16_t(cluster_.vertex_count++);
    }
    cluster_.corners[i] = hash_values_[at];
  }
}

void DiskCutter::join_triangles() {
  const size_t count = cluster_.triangles.size();
  hash_keys_.assign(hash_keys_.size(), kNoKey);
  for (size_t t = 0; t < count; t++) {
    const size_t at = find_slot(hash_keys_, cluster_.triangles[t]);
    hash_keys_[at] = cluster_.triangles[t];
    hash_values_[at] = uint16_t(t);
  }
  cluster_.neighbours.resize(3 * count);
  for (size_t i = 0; i < 3 * count; i++) {
    const int32_t other = half_edges_[3 * size_t(cluster_.triangles[i / 3]) + i % 3];
    cluster_.neighbours[i] = -1;
    if (other < 0) continue;
    const size_t at = find_slot(hash_keys_, uint32_t(other) / 3);
    if (hash_keys_[at] != kNoKey) cluster_.neighbours[i] = int16_t(hash_values_[at]);
  }
}

int DiskCutter::shared_edges(int16_t triangle) const {
  int shared = 0;
  for (int k = 0; k < 3; k++) {
    const int16_t other = cluster_.neighbours[3 * triangle + k];
    shared += other >= 0 && disk_of_triangle_[other] == disk_;
  }
  return shared;
}

// Does the set stay a disk with this triangle? Adding such triangles (a shelling) never gets stuck
// inside a disk: triangles that can form one disk do.
bool DiskCutter::keeps_disk(int16_t triangle, int shared) const {
  if (shared == 2) return boundary_ > 3;
  if (shared != 1) return false;
  for (int k = 0; k < 3; k++) {
    const int16_t other = cluster_.neighbours[3 * triangle + k];
    if (other >= 0 && disk_of_triangle_[other] == disk_)
      return disk_of_vertex_[cluster_.corners[3 * triangle + (k + 2) % 3]] != disk_;
  }
  return false;
}

void DiskCutter::add(int16_t triangle, int shared, Disks& disks) {
  disk_of_triangle_[triangle] = disk_;
  disks.triangles.push_back(cluster_.triangles[triangle]);
  boundary_ += 3 - 2 * shared;
  for (int k = 0; k < 3; k++) {
    int32_t& disk = disk_of_vertex_[cluster_.corners[3 * triangle + k]];
    disks.vertices.back() += disk != disk_;
    disk = disk_;
    const int16_t other = cluster_.neighbours[3 * triangle + k];
    if (other >= 0 && disk_of_triangle_[other] < 0) queue_.push_back(other);
  }
}

void DiskCutter::grow_disk(int16_t first, Disks& disks) {
  queue_.clear();
  boundary_ = 0;
  add(first, 0, disks);
  // A rejected triangle is queued again whenever another neighbour joins.
  for (size_t head = 0; head < queue_.size(); head++) {
    const int16_t triangle = queue_[head];
    if (disk_of_triangle_[triangle] >= 0) continue;
    const int shared = shared_edges(triangle);
    if (keeps_disk(triangle, shared)) add(triangle, shared, disks);
  }
}

}  // namespace meshlet

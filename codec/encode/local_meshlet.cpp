#include "encode/local_meshlet.h"

#include <stdexcept>

#include "common/hash_map.h"

namespace gltf_meshlet_codec {

void LocalMeshlet::add_disk(uint32_t disk) {
  const Meshlets& meshlets = input_.meshlets;
  const uint32_t begin = meshlets.disk_begin[disk], count = meshlets.disk_begin[disk + 1] - begin;
  const Loop& loop = boundaries_.loops[disk];
  first_triangle_ = triangle_count_;
  first_vertex_ = vertex_count_;
  loop_length_ = loop.count;
  HashMap<uint32_t, uint8_t, 8> numbers;
  const auto number_of = [&](uint32_t vertex) {
    const auto [number, is_new] = numbers.insert(vertex, uint8_t(vertex_count_));
    if (!is_new) return number;
    if (vertex_count_ == MESHLET_VERTICES)
      throw std::logic_error("a meshlet has more than 64 vertices");
    vertex_[vertex_count_++] = vertex;
    return number;
  };
  const auto local_half_edge = [&](uint32_t half_edge) {
    return uint8_t(3 * (first_triangle_ + boundaries_.place_of[half_edge / 3] - begin) +
                   half_edge % 3);
  };
  if (first_triangle_ + count > MESHLET_TRIANGLES)
    throw std::logic_error("a meshlet has more than 64 triangles");
  for (uint32_t i = 0; i < loop.count; i++) {
    if (number_of(boundaries_.vertex[loop.begin + i]) != first_vertex_ + i)
      throw std::logic_error("the segmentation made a disk that is none");
    loop_half_edge_[i] = local_half_edge(boundaries_.half_edge[loop.begin + i]);
  }
  for (uint32_t i = 0; i < count; i++) {
    const uint32_t first = 3 * meshlets.triangles[begin + i];
    for (uint32_t k = 0; k < 3; k++) {
      const uint32_t local = 3 * (first_triangle_ + i) + k;
      start_[local] = number_of(input_.mesh.triangles[first + k]);
      const int32_t other = input_.half_edges.by_vertex(first + k);
      const uint32_t place = other < 0 ? count : boundaries_.place_of[uint32_t(other) / 3] - begin;
      opposite_[local] = place < count
                             ? uint8_t(3 * (first_triangle_ + place) + uint32_t(other) % 3)
                             : kNoHalfEdge;
    }
  }
  if (2 * (vertex_count_ - first_vertex_) != count + loop.count + 2)  // by Euler's formula
    throw std::logic_error("the segmentation made a disk that is none");
  triangle_count_ += count;
}

}  // namespace gltf_meshlet_codec

#include "segment/spatial_mesh.h"

#include <algorithm>

#include "common/curve.h"

namespace gltf_meshlet_codec {
namespace {

// Items per parallel task.
constexpr size_t kBlock = 1 << 15;

// body(i) for every i < count.
template <class Body>
void for_items(int threads, size_t count, Body&& body) {
  for_blocks(threads, count, kBlock, [&](size_t, size_t first, size_t last) {
    for (size_t i = first; i < last; i++) body(i);
  });
}

struct Frame {
  double origin[3] = {0, 0, 0};
  double scale = 0;  // 1 / longest side
};

// Fits the frame to the vertices that have a triangle.
Frame fit_frame(const MeshView& mesh, int threads) {
  const auto position = [&](size_t corner) {
    const float* p = mesh.positions + 3 * size_t(mesh.triangles[corner]);
    return Vec3{p[0], p[1], p[2]};
  };
  Box box{position(0), position(0)};
  std::vector<Box> boxes(block_count(mesh.triangle_count, kBlock), box);
  for_blocks(threads, mesh.triangle_count, kBlock, [&](size_t b, size_t first, size_t last) {
    Box own = box;
    for (size_t i = 3 * first; i < 3 * last; i++) own.add(position(i));
    boxes[b] = own;
  });
  for (const Box& other : boxes) {
    box.add(other.low);
    box.add(other.high);
  }
  Frame frame;
  double side = 0;
  for (int c = 0; c < 3; c++) {
    frame.origin[c] = box.low[c];
    side = std::max(side, double(box.high[c]) - double(box.low[c]));
  }
  frame.scale = side > 0 ? 1 / side : 0;
  return frame;
}

// The vertices of a block of corners, in order of first use.
std::vector<uint32_t> vertices_of(const uint32_t* corners, size_t count, size_t vertex_count) {
  std::vector<uint64_t> seen((vertex_count + 63) / 64, 0);
  std::vector<uint32_t> vertices;
  vertices.reserve(count / 4);
  for (const uint32_t* v = corners; v < corners + count; v++) {
    uint64_t& word = seen[*v / 64];
    const uint64_t bit = 1ull << *v % 64;
    if (word & bit) continue;
    word |= bit;
    vertices.push_back(*v);
  }
  return vertices;
}

// Numbers the vertices in order of first use.
void number_vertices(SpatialMesh& sorted, size_t vertex_count, int threads) {
  constexpr uint32_t none = ~0u;
  constexpr size_t kCorners = 6 * kBlock;  // few blocks repeat a vertex
  const size_t corners = sorted.triangles.size();
  std::vector<std::vector<uint32_t>> of_block(block_count(corners, kCorners));
  for_blocks(threads, corners, kCorners, [&](size_t b, size_t first, size_t last) {
    of_block[b] = vertices_of(&sorted.triangles[first], last - first, vertex_count);
  });
  Array<uint32_t> number(vertex_count);
  for_items(threads, vertex_count, [&](size_t v) { number[v] = none; });
  sorted.source_vertex.reserve(vertex_count);
  for (const std::vector<uint32_t>& vertices : of_block)
    for (const uint32_t v : vertices) {
      if (number[v] != none) continue;
      number[v] = uint32_t(sorted.source_vertex.size());
      sorted.source_vertex.push_back(v);
    }
  for_items(threads, corners, [&](size_t i) { sorted.triangles[i] = number[sorted.triangles[i]]; });
}

}  // namespace

SpatialMesh sort_in_space(const MeshView& mesh, int threads) {
  const Frame frame = fit_frame(mesh, threads);
  Array<Vec3> points(mesh.vertex_count);
  for_items(threads, points.size(), [&](size_t v) {
    for (int c = 0; c < 3; c++)
      points[v][c] =
          float((double(mesh.positions[3 * v + size_t(c)]) - frame.origin[c]) * frame.scale);
  });
  SpatialMesh sorted;
  sorted.triangles.resize(3 * mesh.triangle_count);
  sorted.source_triangle = order_along_curve(mesh.triangle_count, threads, [&](size_t t) {
    const uint32_t* v = mesh.triangles + 3 * t;
    return (points[v[0]] + points[v[1]] + points[v[2]]) * (1.0f / 3.0f) * kCurveCells;
  });
  for_items(threads, mesh.triangle_count, [&](size_t i) {
    std::copy_n(mesh.triangles + 3 * size_t(sorted.source_triangle[i]), 3,
                &sorted.triangles[3 * i]);
  });
  number_vertices(sorted, mesh.vertex_count, threads);
  sorted.points.resize(sorted.source_vertex.size());
  sorted.position_ids.resize(sorted.source_vertex.size());
  for_items(threads, sorted.points.size(),
            [&](size_t v) { sorted.points[v] = points[sorted.source_vertex[v]]; });
  // Renumbered too: an id is the first vertex that has it.
  constexpr uint32_t none = ~0u;
  Array<uint32_t> first(mesh.vertex_count);
  for_items(threads, mesh.vertex_count, [&](size_t v) { first[v] = none; });
  for (uint32_t v = 0; v < sorted.position_ids.size(); v++) {
    uint32_t& id = first[mesh.position_ids[sorted.source_vertex[v]]];
    if (id == none) id = v;
    sorted.position_ids[v] = id;
  }
  return sorted;
}

}  // namespace gltf_meshlet_codec

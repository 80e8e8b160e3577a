#include "segment/spatial_mesh.h"

#include <algorithm>
#include <array>

#include "common/hilbert.h"
#include "common/parallel.h"

namespace meshlet {
namespace {

// Items per parallel task.
constexpr size_t kBlock = 1 << 15;

size_t block_count(size_t count) { return (count + kBlock - 1) / kBlock; }

// body(i) for every i < count.
template <class Body>
void for_items(int threads, size_t count, Body&& body) {
  parallel_for(threads, block_count(count), [&](size_t b) {
    for (size_t i = b * kBlock; i < std::min((b + 1) * kBlock, count); i++) body(i);
  });
}

struct Frame {
  double origin[3] = {0, 0, 0};
  double scale = 0;  // 1 / longest side
};

struct Box {
  float low[3], high[3];

  void add(const float* point) {
    for (int c = 0; c < 3; c++) {
      low[c] = std::min(low[c], point[c]);
      high[c] = std::max(high[c], point[c]);
    }
  }
};

// Of the vertices that have a triangle.
Frame fit_frame(const MeshView& mesh, int threads) {
  const auto position = [&](size_t corner) {
    return mesh.positions + 3 * size_t(mesh.triangles[corner]);
  };
  const float* first = position(0);
  Box box{{first[0], first[1], first[2]}, {first[0], first[1], first[2]}};
  std::vector<Box> boxes(block_count(mesh.triangle_count), box);
  parallel_for(threads, boxes.size(), [&](size_t b) {
    Box own = box;
    const size_t end = 3 * std::min((b + 1) * kBlock, mesh.triangle_count);
    for (size_t i = 3 * b * kBlock; i < end; i++) own.add(position(i));
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

uint32_t to_cell(float coordinate) {
  constexpr int cells = 1 << kHilbertBits;
  return uint32_t(std::min(std::max(int(coordinate * cells), 0), cells - 1));
}

uint32_t code_of(Vec3 point) {
  return hilbert_index({to_cell(point.x), to_cell(point.y), to_cell(point.z)});
}

// Returns 0 .. codes.size() - 1 by code, equal ones by number: a radix sort of kHilbertBits at a
// time. Each block counts and places its own codes, after those of the blocks before it.
Array<uint32_t> sorted_by_code(Array<uint32_t> codes, int threads) {
  constexpr size_t kDigits = size_t(1) << kHilbertBits;
  using Counts = std::array<uint32_t, kDigits>;
  const size_t count = codes.size(), blocks = block_count(count);
  Array<uint32_t> order(count), next_order(count), next_codes(count);
  std::vector<Counts> places(blocks);
  for (int shift = 0; shift < 3 * kHilbertBits; shift += kHilbertBits) {
    const auto digit = [&](uint32_t code) { return code >> shift & (kDigits - 1); };
    parallel_for(threads, blocks, [&](size_t b) {
      places[b].fill(0);
      for (size_t i = b * kBlock; i < std::min((b + 1) * kBlock, count); i++)
        ++places[b][digit(codes[i])];
    });
    uint32_t begin = 0;
    for (size_t d = 0; d < kDigits; d++)
      for (Counts& block : places) {
        const uint32_t size = block[d];
        block[d] = begin;
        begin += size;
      }
    parallel_for(threads, blocks, [&](size_t b) {
      for (size_t i = b * kBlock; i < std::min((b + 1) * kBlock, count); i++) {
        const uint32_t to = places[b][digit(codes[i])]++;
        next_order[to] = shift == 0 ? uint32_t(i) : order[i];
        next_codes[to] = codes[i];
      }
    });
    order.swap(next_order);
    codes.swap(next_codes);
  }
  return order;
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
  std::vector<std::vector<uint32_t>> of_block((corners + kCorners - 1) / kCorners);
  parallel_for(threads, of_block.size(), [&](size_t b) {
    of_block[b] = vertices_of(&sorted.triangles[b * kCorners],
                              std::min(kCorners, corners - b * kCorners), vertex_count);
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
  {
    Array<uint32_t> codes(mesh.triangle_count);
    for_items(threads, codes.size(), [&](size_t t) {
      const uint32_t* v = mesh.triangles + 3 * t;
      codes[t] = code_of((points[v[0]] + points[v[1]] + points[v[2]]) * (1.0f / 3.0f));
    });
    sorted.source_triangle = sorted_by_code(std::move(codes), threads);
    for_items(threads, mesh.triangle_count, [&](size_t i) {
      std::copy_n(mesh.triangles + 3 * size_t(sorted.source_triangle[i]), 3,
                  &sorted.triangles[3 * i]);
    });
  }
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

Array<uint32_t> order_along_curve(const std::vector<Vec3>& points, int threads) {
  Array<uint32_t> codes(points.size());
  for_items(threads, codes.size(), [&](size_t i) { codes[i] = code_of(points[i]); });
  return sorted_by_code(std::move(codes), threads);
}

}  // namespace meshlet

#include "segment/patches.h"

#include <algorithm>
#include <array>

#include "common/hilbert.h"
#include "common/parallel.h"

namespace meshlet {
namespace {

// Items per parallel task.
constexpr size_t kBlock = 1 << 14;

size_t block_count(size_t count) { return (count + kBlock - 1) / kBlock; }

struct Frame {
  double origin[3] = {0, 0, 0};
  double scale = 0;  // 1 / longest side
};

Frame fit_frame(const MeshView& mesh) {
  double low[3], high[3];
  for (int c = 0; c < 3; c++) low[c] = high[c] = mesh.positions[3 * size_t(mesh.triangles[0]) + c];
  for (size_t i = 0; i < 3 * mesh.triangle_count; i++) {
    for (int c = 0; c < 3; c++) {
      const double value = mesh.positions[3 * size_t(mesh.triangles[i]) + c];
      low[c] = std::min(low[c], value);
      high[c] = std::max(high[c], value);
    }
  }
  Frame frame;
  double side = 0;
  for (int c = 0; c < 3; c++) frame.origin[c] = low[c], side = std::max(side, high[c] - low[c]);
  frame.scale = side > 0 ? 1 / side : 0;
  return frame;
}

Vec3 corner_position(const MeshView& mesh, const Frame& frame, size_t corner) {
  const float* p = mesh.positions + 3 * size_t(mesh.triangles[corner]);
  return {float((p[0] - frame.origin[0]) * frame.scale),
          float((p[1] - frame.origin[1]) * frame.scale),
          float((p[2] - frame.origin[2]) * frame.scale)};
}

uint32_t to_cell(float coordinate) {
  constexpr int cells = 1 << kHilbertBits;
  return uint32_t(std::min(std::max(int(coordinate * cells), 0), cells - 1));
}

}  // namespace

TriangleShapes measure_triangles(const MeshView& mesh, int threads) {
  TriangleShapes shapes;
  shapes.centres.resize(mesh.triangle_count);
  shapes.normals.resize(mesh.triangle_count);
  const Frame frame = fit_frame(mesh);
  parallel_for(threads, block_count(mesh.triangle_count), [&](size_t b) {
    for (size_t t = b * kBlock; t < std::min((b + 1) * kBlock, mesh.triangle_count); t++) {
      const Vec3 p = corner_position(mesh, frame, 3 * t);
      const Vec3 q = corner_position(mesh, frame, 3 * t + 1);
      const Vec3 r = corner_position(mesh, frame, 3 * t + 2);
      const Vec3 normal = cross(q - p, r - p);
      const float norm = length(normal);
      shapes.centres[t] = (p + q + r) * (1.0f / 3.0f);
      shapes.normals[t] = norm > 0 ? normal * (1.0f / norm) : Vec3{0, 0, 0};
    }
  });
  return shapes;
}

std::vector<uint32_t> order_along_curve(const std::vector<Vec3>& points, int threads) {
  std::vector<uint32_t> codes(points.size()), order(points.size()), sorted(points.size());
  parallel_for(threads, block_count(points.size()), [&](size_t b) {
    for (size_t i = b * kBlock; i < std::min((b + 1) * kBlock, points.size()); i++) {
      codes[i] = hilbert_index({to_cell(points[i].x), to_cell(points[i].y), to_cell(points[i].z)});
      order[i] = uint32_t(i);
    }
  });
  // Stable radix sort, kHilbertBits at a time.
  for (int shift = 0; shift < 3 * kHilbertBits; shift += kHilbertBits) {
    std::array<uint32_t, (1 << kHilbertBits) + 1> begin{};
    const uint32_t mask = (1u << kHilbertBits) - 1;
    for (const uint32_t code : codes) ++begin[(code >> shift & mask) + 1];
    for (size_t digit = 1; digit < begin.size(); digit++) begin[digit] += begin[digit - 1];
    for (const uint32_t i : order) sorted[begin[codes[i] >> shift & mask]++] = i;
    order.swap(sorted);
  }
  return order;
}

void group_connected(const std::vector<int32_t>& half_edges, std::vector<uint32_t>& order) {
  constexpr uint32_t unseen = ~0u;
  std::vector<uint32_t> part(order.size(), unseen), stack;
  std::vector<uint32_t> begin{0};  // of each part in the new order
  for (const uint32_t start : order) {
    if (part[start] != unseen) continue;
    const uint32_t label = uint32_t(begin.size() - 1);
    part[start] = label;
    stack.assign(1, start);
    uint32_t size = 0;
    for (; !stack.empty(); size++) {
      const size_t triangle = stack.back();
      stack.pop_back();
      for (size_t h = 3 * triangle; h < 3 * triangle + 3; h++) {
        if (half_edges[h] < 0) continue;
        const uint32_t other = uint32_t(half_edges[h]) / 3;
        if (part[other] != unseen) continue;
        part[other] = label;
        stack.push_back(other);
      }
    }
    begin.push_back(begin.back() + size);
  }
  std::vector<uint32_t> grouped(order.size());
  for (const uint32_t t : order) grouped[begin[part[t]]++] = t;
  order.swap(grouped);
}

Patch extract_patch(const std::vector<uint32_t>& order, size_t first, size_t last,
                    const std::vector<uint32_t>& slot, const std::vector<int32_t>& half_edges,
                    const TriangleShapes& shapes) {
  Patch patch;
  patch.triangles.assign(order.begin() + std::ptrdiff_t(first),
                         order.begin() + std::ptrdiff_t(last));
  patch.neighbours.resize(3 * patch.size());
  patch.facets.resize(patch.size());
  for (size_t t = 0; t < patch.size(); t++) {
    const size_t triangle = patch.triangles[t];
    patch.facets[t] = {shapes.centres[triangle], shapes.normals[triangle]};
    for (size_t k = 0; k < 3; k++) {
      const int32_t other = half_edges[3 * triangle + k];
      const size_t place = other < 0 ? last : slot[size_t(other) / 3];
      patch.neighbours[3 * t + k] =
          place >= first && place < last ? int32_t(3 * (place - first)) + other % 3 : -1;
    }
  }
  return patch;
}

}  // namespace meshlet

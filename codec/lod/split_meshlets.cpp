#include "lod/split_meshlets.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "segment/check_meshlets.h"
#include "segment/disks.h"
#include "segment/half_edges.h"

namespace gltf_meshlet_codec {
namespace {

// Half-edges are those of the whole mesh: an edge that two triangles of a meshlet share, and others
// of the mesh, does not join them in the page either.
class Splitter {
 public:
  Splitter(const MeshView& mesh, const HalfEdges& half_edges, const GenerationOptions& options)
      : mesh_(mesh), options_(options), cutter_(mesh.triangles, half_edges) {}

  // Appends the triangles as one meshlet, or in halves.
  void add(std::vector<uint32_t> triangles, MeshletList& list) {
    if (triangles.size() <= size_t(options_.max_triangles)) {
      cutter_.cut(triangles.data(), triangles.size(), disks_);
      if (disks_.vertex_count <= size_t(options_.max_vertices)) return list.append_meshlet(disks_);
    }
    const auto middle = triangles.begin() + std::ptrdiff_t(triangles.size() / 2);
    sort_from_end(triangles);
    add({triangles.begin(), middle}, list);
    add({middle, triangles.end()}, list);
  }

 private:
  // In double: squares of any floats are finite.
  using Point = std::array<double, 3>;

  Point centre(uint32_t triangle) const {
    Point sum{};
    for (int k = 0; k < 3; k++) {
      const float* p = mesh_.positions + 3 * size_t(mesh_.triangles[3 * size_t(triangle) + k]);
      for (size_t c = 0; c < 3; c++) sum[c] += double(p[c]) / 3;
    }
    return sum;
  }

  double distance(uint32_t triangle, const Point& from) const {
    const Point p = centre(triangle);
    double sum = 0;
    for (size_t c = 0; c < 3; c++) sum += (p[c] - from[c]) * (p[c] - from[c]);
    return sum;
  }

  // By their distance from the one that is farthest from all.
  void sort_from_end(std::vector<uint32_t>& triangles) const {
    Point mean{};
    for (const uint32_t t : triangles)
      for (size_t c = 0; c < 3; c++) mean[c] += centre(t)[c] / double(triangles.size());
    uint32_t end = triangles[0];
    for (const uint32_t t : triangles)
      if (distance(t, mean) > distance(end, mean)) end = t;
    const Point from = centre(end);
    std::sort(triangles.begin(), triangles.end(), [&](uint32_t a, uint32_t b) {
      const double da = distance(a, from), db = distance(b, from);
      return da != db ? da < db : a < b;
    });
  }

  const MeshView& mesh_;
  const GenerationOptions& options_;
  DiskCutter cutter_;
  Disks disks_;
};

}  // namespace

GroupMeshlets split_meshlets(const MeshView& mesh, const std::vector<uint32_t>& order,
                             const std::vector<uint32_t>& meshlet_begin,
                             const GenerationOptions& options) {
  check_order(order, mesh.triangle_count);
  if (!are_begins(meshlet_begin, order.size()))
    throw std::invalid_argument("the meshlets' begins are not valid");
  const HalfEdges half_edges = match_half_edges(mesh, options.threads);
  Splitter splitter(mesh, half_edges, options);
  GroupMeshlets all;
  for (size_t m = 0; m + 1 < meshlet_begin.size(); m++) {
    splitter.add({order.begin() + meshlet_begin[m], order.begin() + meshlet_begin[m + 1]}, all);
    all.group_begin.push_back(all.count());
  }
  return all;
}

}  // namespace gltf_meshlet_codec

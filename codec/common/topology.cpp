#include "common/topology.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "common/forest.h"

namespace gltf_meshlet_codec {
namespace {

// Calls visit(lower vertex, higher vertex) for all edges that have two ends.
template <class Visit>
void for_edges(const uint32_t* triangles, size_t triangle_count, const Visit& visit) {
  for (size_t i = 0; i < 3 * triangle_count; i += 3)
    for (size_t k = 0; k < 3; k++) {
      const uint32_t a = triangles[i + k], b = triangles[i + (k + 1) % 3];
      if (a != b) visit(std::min(a, b), std::max(a, b));
    }
}

uint64_t count_boundary_edges(const uint32_t* triangles, size_t triangle_count,
                              size_t vertex_count) {
  std::vector<size_t> end(vertex_count + 1, 0);  // of the edges of each lower vertex
  for_edges(triangles, triangle_count, [&](uint32_t low, uint32_t) { end[low]++; });
  std::exclusive_scan(end.begin(), end.end(), end.begin(), size_t(0));
  std::vector<uint32_t> highs(end.back());
  for_edges(triangles, triangle_count,
            [&](uint32_t low, uint32_t high) { highs[end[low]++] = high; });
  uint64_t count = 0;
  for (size_t v = 0, first = 0; v < vertex_count; first = end[v++]) {
    std::sort(highs.begin() + ptrdiff_t(first), highs.begin() + ptrdiff_t(end[v]));
    for (size_t i = first; i < end[v]; i++) {
      const bool same_before = i > first && highs[i - 1] == highs[i];
      const bool same_after = i + 1 < end[v] && highs[i + 1] == highs[i];
      count += !same_before && !same_after;
    }
  }
  return count;
}

}  // namespace

Topology topology_of(const uint32_t* triangles, size_t triangle_count, size_t vertex_count) {
  std::vector<uint32_t> parent(vertex_count);
  std::iota(parent.begin(), parent.end(), 0u);
  std::vector<bool> is_used(vertex_count, false);
  Topology result;
  for (size_t i = 0; i < 3 * triangle_count; i++) {
    const uint32_t v = triangles[i];
    if (!is_used[v]) {
      is_used[v] = true;
      result.vertices++;
      result.islands++;
    }
    result.islands -= unite(parent.data(), triangles[i - i % 3], v);
  }
  result.boundary_edges = count_boundary_edges(triangles, triangle_count, vertex_count);
  return result;
}

}  // namespace gltf_meshlet_codec

#include "segment/patches.h"

#include <utility>

#include "common/forest.h"
#include "common/parallel.h"

namespace gltf_meshlet_codec {

namespace {

// Triangles per parallel item.
constexpr uint32_t kBlock = 1 << 15;

// The first triangle of each triangle's connected component.
Array<uint32_t> component_roots(const HalfEdges& half_edges, int threads) {
  const size_t count = half_edges.size() / 3;
  Array<uint32_t> parent(count);
  // Edges to triangles in earlier blocks: these trees belong to other threads.
  std::vector<std::vector<std::pair<uint32_t, uint32_t>>> outside(block_count(count, kBlock));
  for_blocks(threads, count, kBlock, [&](size_t block, size_t begin, size_t end) {
    for (uint32_t t = uint32_t(begin); t < end; t++) {
      parent[t] = t;
      for (size_t h = 3 * size_t(t); h < 3 * size_t(t) + 3; h++) {
        const int32_t opposite = half_edges.by_vertex(h);
        const uint32_t other = uint32_t(opposite) / 3;
        if (opposite < 0 || other > t) continue;
        if (other >= begin)
          unite(parent.data(), t, other);
        else
          outside[block].emplace_back(t, other);
      }
    }
  });
  for (const auto& edges : outside)
    for (const auto& [t, other] : edges) unite(parent.data(), t, other);
  for (uint32_t& root : parent) root = parent[root];  // parents come first
  return parent;
}

}  // namespace

ConnectedOrder order_by_component(const HalfEdges& half_edges, int threads) {
  ConnectedOrder order;
  order.place = component_roots(half_edges, threads);  // then each is replaced by the place
  const uint32_t count = uint32_t(order.place.size());
  // At the root of each component: first its size, then the place of its next triangle.
  std::vector<uint32_t> next(count, 0);
  for (const uint32_t root : order.place) ++next[root];
  uint32_t begin = 0;
  for (uint32_t t = 0; t < count; t++)
    if (order.place[t] == t) begin += std::exchange(next[t], begin);
  for (uint32_t& place : order.place) place = next[place]++;
  order.triangles.resize(count);
  for_blocks(threads, count, kBlock, [&](size_t, size_t first, size_t last) {
    for (size_t t = first; t < last; t++) order.triangles[order.place[t]] = uint32_t(t);
  });
  return order;
}

Patch extract_patch(const SpatialMesh& mesh, const HalfEdges& half_edges,
                    const ConnectedOrder& order, size_t first, size_t last) {
  Patch patch;
  patch.triangles.assign(order.triangles.begin() + std::ptrdiff_t(first),
                         order.triangles.begin() + std::ptrdiff_t(last));
  patch.neighbours.resize(3 * patch.size());
  patch.facets.resize(patch.size());
  for (size_t t = 0; t < patch.size(); t++) {
    const size_t triangle = patch.triangles[t];
    patch.facets[t] = mesh.facet(triangle);
    for (size_t k = 0; k < 3; k++) {
      const int32_t other = half_edges.by_vertex(3 * triangle + k);
      const size_t place = other < 0 ? last : order.place[size_t(other) / 3];
      patch.neighbours[3 * t + k] =
          place >= first && place < last ? int32_t(3 * (place - first)) + other % 3 : -1;
    }
  }
  return patch;
}

}  // namespace gltf_meshlet_codec

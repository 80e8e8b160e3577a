#include "segment/patches.h"

namespace meshlet {

ConnectedOrder order_by_part(const HalfEdges& half_edges) {
  constexpr uint32_t unseen = ~0u;
  ConnectedOrder order;
  order.part.assign(half_edges.size() / 3, unseen);
  std::vector<uint32_t> stack;
  std::vector<uint32_t> begin{0};  // of each part in the new order
  for (uint32_t start = 0; start < order.part.size(); start++) {
    if (order.part[start] != unseen) continue;
    const uint32_t label = uint32_t(begin.size() - 1);
    order.part[start] = label;
    stack.assign(1, start);
    uint32_t size = 0;
    for (; !stack.empty(); size++) {
      const size_t triangle = stack.back();
      stack.pop_back();
      for (size_t h = 3 * triangle; h < 3 * triangle + 3; h++) {
        if (half_edges.by_vertex(h) < 0) continue;
        const uint32_t other = uint32_t(half_edges.by_vertex(h)) / 3;
        if (order.part[other] != unseen) continue;
        order.part[other] = label;
        stack.push_back(other);
      }
    }
    begin.push_back(begin.back() + size);
  }
  order.triangles.resize(order.part.size());
  order.place.resize(order.part.size());
  for (uint32_t t = 0; t < order.part.size(); t++) {
    order.place[t] = begin[order.part[t]]++;
    order.triangles[order.place[t]] = t;
  }
  return order;
}

Patch extract_patch(const SpatialMesh& mesh, const HalfEdges& half_edges,
                    const ConnectedOrder& order, size_t first, size_t last) {
  Patch patch;
  patch.triangles.assign(order.triangles.begin() + std::ptrdiff_t(first),
                         order.triangles.begin() + std::ptrdiff_t(last));
  patch.neighbours.resize(3 * patch.size());
  patch.facets.resize(patch.size());
  patch.part.resize(patch.size());
  for (size_t t = 0; t < patch.size(); t++) {
    const size_t triangle = patch.triangles[t];
    patch.facets[t] = mesh.facet(triangle);
    patch.part[t] = order.part[triangle];
    for (size_t k = 0; k < 3; k++) {
      const int32_t other = half_edges.by_vertex(3 * triangle + k);
      const size_t place = other < 0 ? last : order.place[size_t(other) / 3];
      patch.neighbours[3 * t + k] =
          place >= first && place < last ? int32_t(3 * (place - first)) + other % 3 : -1;
    }
  }
  return patch;
}

}  // namespace meshlet

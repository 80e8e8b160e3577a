// Cuts the mesh into patches: triangles that one thread partitions into regions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/array.h"
#include "segment/half_edges.h"
#include "segment/spatial_mesh.h"

namespace gltf_meshlet_codec {

// Some tens of thousands of triangles, with local numbers from 0.
struct Patch {
  std::vector<uint32_t> triangles;  // number in the mesh of triangle t, in curve order
  // Local half-edge across half-edge 3 * t + k; -1: none, or in another patch.
  Array<int32_t> neighbours;
  Array<Facet> facets;
  std::vector<int32_t> region;  // of each triangle
  int32_t region_count = 0;

  size_t size() const { return triangles.size(); }
};

// The triangles of a mesh in the order of its connected components.
struct ConnectedOrder {
  Array<uint32_t> triangles;
  Array<uint32_t> place;  // of each triangle in `triangles`
};

// Orders triangles so that connected components of the mesh stay together, in the order of their
// first triangles.
ConnectedOrder order_by_component(const HalfEdges& half_edges, int threads);

// Copies the triangles order.triangles[first .. last).
Patch extract_patch(const SpatialMesh& mesh, const HalfEdges& half_edges,
                    const ConnectedOrder& order, size_t first, size_t last);

}  // namespace gltf_meshlet_codec

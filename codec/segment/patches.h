// Cuts the mesh into patches for parallel work.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/array.h"
#include "segment/half_edges.h"
#include "segment/patch.h"

namespace meshlet {

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

}  // namespace meshlet

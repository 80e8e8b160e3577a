// The mesh cut into patches for parallel work.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "segment/segment.h"
#include "segment/patch.h"

namespace meshlet {

TriangleShapes measure_triangles(const MeshView& mesh, int threads);

// Numbers of the points (in a box of longest side 1) in the order of a Hilbert curve; equal codes
// by number.
std::vector<uint32_t> order_along_curve(const std::vector<Vec3>& points, int threads);

// Reorders the mesh's triangles such that each edge-connected component (half_edges:
// match_half_edges) stays together, the components in order of their first triangles.
void group_components(const std::vector<int32_t>& half_edges, std::vector<uint32_t>& order);

// Copies the part of the mesh that consists of order[first .. last). slot[t] is the place of
// triangle t in order, half_edges is match_half_edges over vertices.
Patch extract_patch(const std::vector<uint32_t>& order, size_t first, size_t last,
                    const std::vector<uint32_t>& slot, const std::vector<int32_t>& half_edges,
                    const TriangleShapes& shapes);

}  // namespace meshlet

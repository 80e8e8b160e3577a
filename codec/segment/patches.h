// Cuts the mesh into patches for parallel work.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "segment/generate_meshlets.h"
#include "segment/patch.h"

namespace meshlet {

TriangleShapes measure_triangles(const MeshView& mesh, int threads);

// Returns the numbers of the points (in a box of longest side 1) in the order of a Hilbert curve;
// points in one cell by number.
std::vector<uint32_t> order_along_curve(const std::vector<Vec3>& points, int threads);

// Reorders triangles so that edge-connected parts of the mesh stay together, in the order of their
// first triangles. half_edges: match_half_edges.
void group_connected(const std::vector<int32_t>& half_edges, std::vector<uint32_t>& order);

// Copies the triangles order[first .. last). slot[t]: place of triangle t in `order`; half_edges:
// match_half_edges over vertices.
Patch extract_patch(const std::vector<uint32_t>& order, size_t first, size_t last,
                    const std::vector<uint32_t>& slot, const std::vector<int32_t>& half_edges,
                    const TriangleShapes& shapes);

}  // namespace meshlet

// Which triangles share an edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace meshlet {

// Half-edge 3t+k runs from corner k to corner (k+1)%3 of triangle t. Returns, for each of the
// 3*triangle_count half-edges, the one that runs along the same edge the other way, or -1 where the
// edge is not shared by exactly two oppositely directed half-edges of two different triangles.
// ids[v], or v itself when ids is null, names the end points of edges; every such name is below
// id_count. triangle_count is below 2^31 / 3.
std::vector<int32_t> match_half_edges(const uint32_t* triangles, size_t triangle_count,
                                      const uint32_t* ids, size_t id_count, int threads);

}  // namespace meshlet

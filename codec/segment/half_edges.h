// Matches half-edges: which triangles share an edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace meshlet {

// Half-edge 3t+k runs from corner k to corner (k+1)%3 of triangle t. Returns for each half-edge the
// opposite one on the same edge, or -1 unless exactly two half-edges, of different triangles and in
// opposite directions, share the edge. Edges end at ids[v] < id_count, or at v itself if ids is
// null. triangle_count < 2^31 / 3.
std::vector<int32_t> match_half_edges(const uint32_t* triangles, size_t triangle_count,
                                      const uint32_t* ids, size_t id_count, int threads);

}  // namespace meshlet

// Joins small meshlets.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/array.h"

namespace gltf_meshlet_codec {

// Size of a meshlet, and its box on a grid.
struct Load {
  uint32_t triangles, vertices;
  std::array<int32_t, 3> low, high;
};

// Meshlets a < b share a border. A larger weight means a larger gain from joining them.
struct Contact {
  uint32_t a, b, weight;
};

// Joins meshlets into sets within the limits. First along contacts, heaviest first. Then without
// contact, meshlets that are close on a space-filling curve (curve_order: a permutation of the
// meshlets), as long as values stored relative to one of their vertices do not grow by more than
// max_spread bits. Returns the set of each meshlet, numbered from 0 by smallest member.
std::vector<uint32_t> join_meshlets(const std::vector<Load>& loads, std::vector<Contact> contacts,
                                    const Array<uint32_t>& curve_order, uint32_t max_triangles,
                                    uint32_t max_vertices, int32_t max_spread);

}  // namespace gltf_meshlet_codec

// Small meshlets share one.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace meshlet {

// What a meshlet holds, and where: its box on a grid.
struct Load {
  uint32_t triangles, vertices;
  std::array<int32_t, 3> low, high;
};

// Meshlets a < b touch along a border; the larger the weight, the better it is to join them.
struct Contact {
  uint32_t a, b, weight;
};

// Joins meshlets while no group exceeds the limits: first along contacts, heaviest first; then
// without contact, those that are near each other in the given order (a permutation of the meshlets
// that follows a space-filling curve) and lie so close that what is stored relative to one of their
// vertices does not grow much. Returns the group of each meshlet, numbered from 0 by smallest
// member.
std::vector<uint32_t> pack_meshlets(const std::vector<Load>& loads, std::vector<Contact> contacts,
                                    const std::vector<uint32_t>& curve_order,
                                    uint32_t max_triangles, uint32_t max_vertices);

}  // namespace meshlet

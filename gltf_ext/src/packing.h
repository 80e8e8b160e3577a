// Small meshlets share one.
#pragma once

#include <cstdint>
#include <vector>

namespace meshlet {

// What a meshlet holds.
struct Load {
    uint32_t triangles, vertices;
};

// Meshlets a < b touch along a border; the larger the weight, the better it is to join them.
struct Contact {
    uint32_t a, b, weight;
};

// Joins meshlets while no group exceeds the limit: first along contacts, heaviest first, then those that are near each
// other in the given order (a permutation of the meshlets that follows a space-filling curve). Returns the group of each
// meshlet, numbered from 0 by smallest member.
std::vector<uint32_t> pack_meshlets(const std::vector<Load>& loads, std::vector<Contact> contacts,
                                    const std::vector<uint32_t>& curve_order, Load limit);

}  // namespace meshlet

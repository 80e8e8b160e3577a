// Sets of numbers as a forest: the parent of a number is a lower one of its set, or itself. The
// root of a set is its lowest number.
#pragma once

#include <cstdint>

namespace gltf_meshlet_codec {

// Returns the root of v's set, and halves the way to it.
inline uint32_t root_of(uint32_t* parent, uint32_t v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

// Joins the sets of a and b. Returns whether they were two.
inline bool unite(uint32_t* parent, uint32_t a, uint32_t b) {
  a = root_of(parent, a);
  b = root_of(parent, b);
  parent[a < b ? b : a] = a < b ? a : b;
  return a != b;
}

}  // namespace gltf_meshlet_codec

// Distances to triangle surfaces.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/vec3.h"

namespace gltf_meshlet_codec {

// Some triangles, for distances to them. Bounding volume hierarchy: nodes of four boxes, leaves of
// four triangles, along a Hilbert curve.
class TriangleTree {
 public:
  // triangles: numbers of three positions each. group_begin: cuts the triangles into groups,
  // neighbours as a rule, that are sorted in parallel. Begins with 0, ends with the number of
  // triangles; no group is empty.
  TriangleTree(const float* positions, const uint32_t* triangles,
               const std::vector<uint32_t>& group_begin, int threads);

  // Squared distance from the point to the nearest triangle, or to any that is no farther than
  // `enough`, a squared distance. hint: a place that may be near; becomes that of the one found.
  float squared_distance(Vec3 point, uint32_t& hint, float enough = 0) const;

  // The same for the triangles of one group. hint: a place in this group.
  float squared_distance_to_group(size_t group, Vec3 point, uint32_t& hint, float enough = 0) const;

  // The same for all triangles, if the group's own distance and the place there are known.
  float squared_distance_beyond(size_t group, float own, Vec3 point, uint32_t hint,
                                float enough) const;

  // A place in a group.
  uint32_t place_in_group(size_t group) const { return kLanes * group_leaf_[group]; }

  // The number, among those given, of the triangle at a place.
  uint32_t number(uint32_t place) const { return numbers_[place]; }

 private:
  static constexpr uint32_t kLanes = 4;

  // Corners a, b, c of four triangles: x, y, z of each.
  struct alignas(16) Leaf {
    float corners[9][kLanes];
  };
  // Boxes of four children. Those that are missing come last, with an infinite distance.
  struct alignas(16) Node {
    float low[3][kLanes], high[3][kLanes];
    uint32_t child[kLanes];  // number of a node or, with kIsLeaf, of a leaf
  };
  struct Child {
    Box box;
    uint32_t number;
  };
  class Builder;

  uint32_t group_root(size_t group) const { return group_node_[group + 1] - 1; }
  // Returns `best`, the squared distance to the leaf of the hint, or a smaller one below the node
  // `root`, but not below `without`.
  float search(uint32_t root, uint32_t without, Vec3 point, uint32_t& hint, float best,
               float enough) const;
  float nearest_in_leaf(uint32_t leaf, Vec3 point, uint32_t& place) const;

  std::vector<Leaf> leaves_;
  std::vector<uint8_t> is_wide_;                   // leaves whose distances need doubles
  std::vector<uint32_t> numbers_;                  // at each place: kLanes of each leaf
  std::vector<Node> nodes_;                        // after their children
  std::vector<uint32_t> group_leaf_, group_node_;  // begins
  uint32_t root_ = 0;
};

}  // namespace gltf_meshlet_codec

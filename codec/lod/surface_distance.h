// Distances between triangle surfaces.
#pragma once
#include <cstdint>
#include <vector>

#include "common/vec3.h"

namespace meshlet {

// Some triangles, for distances to them. Bounding volume hierarchy with boxes, split at medians.
class TriangleTree {
 public:
  // points: the corners of triangles, three each; at least one triangle.
  explicit TriangleTree(std::vector<Vec3> corners);

  // Squared distance from the point to the nearest triangle, or to any that is no farther than
  // `enough`, a squared distance. hint: a triangle that may be near; becomes the one found.
  float squared_distance(Vec3 point, uint32_t& hint, float enough = 0) const;

 private:
  struct Node {
    Vec3 low, high;
    uint32_t first;  // triangle of a leaf, or number of the first of two children
    uint32_t count;  // triangles of a leaf; 0 for an inner node
  };

  void build(uint32_t node, uint32_t first, uint32_t last, const std::vector<Vec3>& centres,
             std::vector<uint32_t>& order);
  float squared(Vec3 point, uint32_t triangle) const;

  std::vector<Vec3> corners_;  // in the order of the leaves
  std::vector<Node> nodes_;
};

// The surfaces of one group before and after simplification: ranges of triangles of two lists that
// share their vertices. Begins have an end for each group.
struct Surfaces {
  const float* positions;  // three per vertex
  const uint32_t* before;
  const uint32_t* after;
  std::vector<uint32_t> before_begin, after_begin;
};

// Largest distance between the two surfaces of each group, both ways: from the vertices
// that are gone, where it is largest as a rule, and from centres and middles of edges after.
std::vector<float> group_distances(const Surfaces& surfaces, int threads);

}  // namespace meshlet

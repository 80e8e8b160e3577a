// Distances to triangle surfaces.
#pragma once
#include <cstdint>
#include <vector>

#include "common/vec3.h"

namespace meshlet {

// Some triangles, for distances to them. Bounding volume hierarchy with boxes, split at medians.
class TriangleTree {
 public:
  struct Node {
    Vec3 low, high;
    uint32_t first;  // triangle of a leaf, or number of the first of two children
    uint32_t count;  // triangles of a leaf; 0 for an inner node
  };

  // corners: of triangles, three each; at least one triangle.
  explicit TriangleTree(std::vector<Vec3> corners);

  // part_begin: cuts the triangles into parts, neighbours as a rule, that are sorted in parallel.
  // Begins with 0, ends with the number of triangles; no part is empty.
  TriangleTree(std::vector<Vec3> corners, std::vector<uint32_t> part_begin, int threads);

  // Squared distance from the point to the nearest triangle, or to any that is no farther than
  // `enough`, a squared distance. hint: a place that may be near; becomes that of the one found.
  float squared_distance(Vec3 point, uint32_t& hint, float enough = 0) const {
    return search(0, point, hint, enough);
  }

  // The same for the triangles of one part. hint: a place in this part.
  float squared_distance_to_part(size_t part, Vec3 point, uint32_t& hint, float enough = 0) const {
    return search(part_root_[part], point, hint, enough);
  }

  // The number, among those given, of the triangle at a place. Those of a part have places in the
  // same range.
  uint32_t number(uint32_t place) const { return numbers_[place]; }

 private:
  void join(uint32_t node, uint32_t first, uint32_t last, std::vector<std::vector<Node>>& parts,
            std::vector<uint32_t>& order);
  void add_part(uint32_t node, std::vector<Node>& part);
  float search(uint32_t root, Vec3 point, uint32_t& hint, float enough) const;
  float squared(Vec3 point, uint32_t place) const;

  std::vector<Vec3> corners_;  // in the order of the leaves
  std::vector<uint32_t> numbers_;
  std::vector<Node> nodes_;
  std::vector<uint32_t> part_root_;  // nodes
};

}  // namespace meshlet

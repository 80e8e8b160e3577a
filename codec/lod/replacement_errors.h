// Errors of groups of triangles that are replaced by fewer: distances to and from level 0.
#pragma once
#include <cstdint>
#include <vector>

#include "lod/surface_distance.h"

namespace meshlet {

// Triangles of one group after the other: three vertices each, and begins with an end.
struct GroupTriangles {
  const uint32_t* triangles;
  std::vector<uint32_t> begin;

  size_t groups() const { return begin.size() - 1; }
};

// Vertices of level 0 that are gone, in groups. The triangle is the one of the group's replacement
// that is nearest: with it the vertex goes on to the next level.
struct CarriedVertices {
  std::vector<uint32_t> vertices, triangles, begin;
};

// Level 0, to measure its replacements.
class ReplacementErrors {
 public:
  // shapes: positions of all vertices, three each: at rest, and with each morph target. The caller
  // keeps them. level_0: at least one triangle in each group.
  ReplacementErrors(std::vector<const float*> shapes, const GroupTriangles& level_0, int threads);

  // Largest distance found for each chosen group in any shape, both ways: from `carried` and the
  // vertices that go now to `after`, where they are farthest as a rule; and from centres and
  // middles of edges of `after` to level 0.
  //
  // after: a whole level. carried: of the chosen groups; replaced by some of these vertices.
  std::vector<float> measure(const GroupTriangles& before, const GroupTriangles& after,
                             const std::vector<uint32_t>& chosen, CarriedVertices& carried,
                             int threads) const;

 private:
  std::vector<const float*> shapes_;
  std::vector<TriangleTree> level_0_;  // of each shape
};

}  // namespace meshlet

// Errors of groups of triangles that are replaced by fewer: distances to and from level 0.
#pragma once
#include <cstdint>
#include <vector>

#include "lod/surface_distance.h"

namespace gltf_meshlet_codec {

// Triangles of one group after the other: three vertices each, and begins with an end.
struct GroupTriangles {
  const uint32_t* triangles;
  std::vector<uint32_t> begin;

  size_t groups() const { return begin.size() - 1; }
  size_t count() const { return begin.back(); }
  size_t size(size_t group) const { return begin[group + 1] - begin[group]; }
  const uint32_t* corners(size_t group) const { return triangles + 3 * size_t(begin[group]); }
  // A copy of a group's triangles.
  std::vector<uint32_t> of(size_t group) const { return {corners(group), corners(group + 1)}; }
};

// Vertices of level 0 that are gone, in groups. The triangle is the one of the group's replacement
// that is nearest: with it the vertex goes on to the next level.
struct CarriedVertices {
  std::vector<uint32_t> vertices, triangles, begin;
  std::vector<float> areas;  // of level 0, that each one stands for
};

// Level 0, to measure its replacements.
class ReplacementErrors {
 public:
  // shapes: positions of all vertices, three floats each: at rest, and with each morph target. The
  // caller keeps them. level_0: at least one triangle in each group. vertex_share: the share of its
  // area that its vertices stand for; the caller carries samples for the rest.
  ReplacementErrors(std::vector<const float*> shapes, size_t vertices,
                    const GroupTriangles& level_0, float vertex_share, int threads);

  // Returns for each chosen group the distance that 99.9 % of the area of either surface keeps, in
  // any shape. It is measured from `carried` and the vertices that go now to `after`, and from
  // points in the triangles of `after` to level 0.
  //
  // after: a whole level. carried: of the chosen groups; becomes some of these vertices.
  std::vector<float> measure(const GroupTriangles& before, const GroupTriangles& after,
                             const std::vector<uint32_t>& chosen, CarriedVertices& carried,
                             int threads) const;

  // The triangle of level 0, at rest, that is nearest to a point. hint: as in TriangleTree.
  uint32_t nearest(Vec3 point, uint32_t& hint) const {
    level_0_[0].squared_distance(point, hint);
    return level_0_[0].number(hint);
  }

 private:
  std::vector<const float*> shapes_;
  std::vector<float> area_;            // of level 0, that each of its vertices stands for
  std::vector<TriangleTree> level_0_;  // of each shape
};

}  // namespace gltf_meshlet_codec

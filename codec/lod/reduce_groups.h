// Simplifies the groups of one level, all up to about the same error.
#pragma once
#include <cstdint>
#include <vector>

#include "lod/replacement_errors.h"
#include "lod/simplifier.h"
#include "lod/surface.h"

namespace gltf_meshlet_codec {

using Pieces = std::vector<Triangles>;  // of each group of a level

// A level has at most this fraction of the triangles of the finer one. If it has more, it is
// simplified again with a larger error.
constexpr double kShrink = 0.75;

// Appends all pieces to a list. Returns the first triangle of each, and their number.
std::vector<uint32_t> joined(const Pieces& pieces, Triangles& all);

// Measures replacements of the groups of a level.
class GroupMeasure {
 public:
  virtual ~GroupMeasure() = default;
  // Returns the distance between each of these groups, its piece, and level 0. Groups may be
  // measured again, with another piece.
  virtual std::vector<float> measure(const Pieces& pieces, const std::vector<uint32_t>& groups) = 0;
  // Returns the vertices of a group around parts from which its piece is farther than
  // `max_distance`. Threads call it at the same time.
  virtual std::vector<uint32_t> lost_vertices(uint32_t group, const Triangles& piece,
                                              double max_distance) const = 0;
};

// The groups of a level after simplification.
struct ReducedGroups {
  Pieces pieces;              // those that are stuck have their old triangles
  std::vector<double> error;  // distance to level 0, infinite for those that are stuck
  double level_error;         // the level's
};

// Simplifies the groups of a level.
//
// step: triangles of a group over those of its replacement, at most. expected_error: the largest
// error that the level should have. The median of the groups alone is no bound: where groups are
// few, most of them may have lost something. The error of the level is the median of the groups or,
// if that is less, `expected_error`, doubled as often as the level needs to shrink.
ReducedGroups reduce_groups(const Surface& surface, const GroupTriangles& groups, double step,
                            GroupMeasure& measure, double expected_error,
                            const Simplifier& simplifier, int threads);

}  // namespace gltf_meshlet_codec

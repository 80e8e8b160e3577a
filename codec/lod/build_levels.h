// Builds the levels of a primitive: groups of clusters, and what replaces each group.
//
// A cluster is a meshlet. A group is some neighbouring clusters that are simplified together, with
// the vertices that it shares with other groups locked. The result is cut into clusters again, and
// the next level groups those across the old borders. See spec/EXT_meshlet_lod.md.
#pragma once
#include <cstdint>
#include <vector>

#include "lod/clusters.h"
#include "lod/group_clusters.h"
#include "segment/generate_meshlets.h"

namespace gltf_meshlet_codec {

struct LevelOptions {
  GenerationOptions generation;  // threads of everything; progress is called after each level
  uint32_t group_size;           // number of clusters in a group, about
  double reduction;              // triangles of a group over those of its replacement
  double error_limit;            // groups with a larger error stay as they are; cells of the grid
  uint32_t level;                // the level of the first groups
  uint32_t first_group;          // the number of the first group
  // Builds all further levels. Without it, one level, and clusters that cannot be simplified wait.
  bool builds_all;
  bool must_end;  // groups the clusters, and makes no further level
};

// All levels: clusters in groups, and clusters that wait for the next level.
struct Levels {
  ClusterSet grouped;  // finer_group counts from first_group
  std::vector<uint32_t> cluster_group;
  std::vector<ClusterGroup> groups;
  ClusterSet waiting;
  // Of each level: the triangles that could not be simplified and waited for the next one.
  std::vector<uint64_t> stuck_triangles;
};

// given: clusters of `level` or finer, to which errors are measured; without any, those of level 0
// are generated from the surface's triangles. pilot: of the same surface. Returns the same levels
// for any number of threads. Throws what the progress function throws.
Levels build_levels(const Surface& surface, ClusterSet given, const PagePilot& pilot,
                    const Simplifier& simplifier, const LevelOptions& options);

}  // namespace gltf_meshlet_codec

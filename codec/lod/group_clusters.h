// Forms groups of neighbouring clusters that fit in a page.
#pragma once
#include <cstdint>
#include <vector>

#include "encode/pages.h"
#include "levels/tables.h"
#include "lod/clusters.h"
#include "lod/simplifier.h"
#include "lod/surface.h"

namespace gltf_meshlet_codec {

constexpr uint32_t kSmallestGroup = 4;  // clusters in a group, about

// The numbers of each group's clusters.
using Groups = std::vector<std::vector<uint32_t>>;

// Encodes groups before they are simplified, to see whether they fit in a page.
struct PagePilot {
  const Surface& surface;
  const std::vector<Stream>& streams;
  const VertexValues& values;
  size_t page_bytes;  // 0 for groups of any size

  // Returns the size of a group as a fraction of a page; 0 if it certainly fits.
  double page_fraction(const ClusterSet& clusters, const std::vector<uint32_t>& group) const;
};

// Groups clusters, about `size` in a group, fewer where they would not fit in a page. Groups follow
// each other along a Hilbert curve.
Groups group_clusters(const ClusterSet& clusters, uint32_t size, const PagePilot& pilot,
                      const Simplifier& simplifier, int threads);

// Joins groups without triangles to the group before, or after. groups: along a curve, so that
// neighbours are close. triangles: their numbers.
Groups join_empty(const Groups& groups, const std::vector<uint32_t>& triangles);

}  // namespace gltf_meshlet_codec

// A patch: triangles of the mesh that one thread partitions into regions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/array.h"
#include "segment/spatial_mesh.h"

namespace meshlet {

// Some tens of thousands of triangles, with local numbers from 0.
struct Patch {
  std::vector<uint32_t> triangles;  // number in the mesh of triangle t, in curve order
  // Local half-edge across half-edge 3 * t + k; -1: none, or in another patch.
  Array<int32_t> neighbours;
  Array<Facet> facets;
  std::vector<int32_t> region;  // of each triangle
  int32_t region_count = 0;

  size_t size() const { return triangles.size(); }
};

}  // namespace meshlet

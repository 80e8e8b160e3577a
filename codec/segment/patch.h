// A part of the mesh that one thread partitions into regions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/vec3.h"

namespace meshlet {

// What the partition needs to know of each triangle of the mesh.
struct TriangleShapes {
  std::vector<Vec3> centres;  // in a frame where the mesh's bounding box has longest side 1
  std::vector<Vec3> normals;  // unit length, or zero for a triangle without area
};

struct Facet {
  Vec3 centre, normal;
};

// Some tens of thousands of triangles, numbered from 0, and which of them share edges.
struct Patch {
  std::vector<uint32_t>
      triangles;  // the mesh's triangle behind local triangle t; neighbours in space are near
  std::vector<int32_t>
      neighbours;  // local half-edge across half-edge 3 * t + k; -1: none, or in another patch
  std::vector<Facet> facets;
  std::vector<int32_t> region;  // of each local triangle
  int32_t region_count = 0;

  size_t size() const { return triangles.size(); }
};

}  // namespace meshlet

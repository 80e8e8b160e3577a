// Sorts a mesh along a space-filling curve.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/array.h"
#include "common/vec3.h"
#include "segment/mesh_view.h"

namespace gltf_meshlet_codec {

// A triangle's centre, and its normal: of unit length, or about zero for a triangle without area.
struct Facet {
  Vec3 centre, normal;
};

// A mesh whose triangles follow a Hilbert curve through their centres and whose vertices are
// numbered in order of first use: neighbours in space are neighbours in memory.
struct SpatialMesh {
  Array<uint32_t> triangles;
  Array<uint32_t> position_ids;
  Array<Vec3> points;               // per vertex, in a box of longest side 1
  Array<uint32_t> source_vertex;    // number of each vertex in the mesh that was sorted
  Array<uint32_t> source_triangle;  // likewise of each triangle

  size_t triangle_count() const { return triangles.size() / 3; }
  Vec3 centre(size_t triangle) const {
    const uint32_t* v = &triangles[3 * triangle];
    return (points[v[0]] + points[v[1]] + points[v[2]]) * (1.0f / 3.0f);
  }
  Facet facet(size_t triangle) const {
    const uint32_t* v = &triangles[3 * triangle];
    return {centre(triangle),
            normalized(cross(points[v[1]] - points[v[0]], points[v[2]] - points[v[0]]))};
  }
  MeshView view() const {
    return {triangles.data(), triangle_count(), position_ids.data(), &points[0].x, points.size()};
  }
};

// Vertices without a triangle are left out.
SpatialMesh sort_in_space(const MeshView& mesh, int threads);

}  // namespace gltf_meshlet_codec

// Corners of replacements choose among the vertices of level 0 at their positions.
//
// The simplifier leaves each corner the vertex of the edge that it collapsed, and one vertex of
// each position where seams are ignored. Another vertex there, of the other side of a seam or a
// hard edge, may have the normal and the texture coordinates that the corner's triangle needs.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/vec3.h"

namespace gltf_meshlet_codec {

// Vertices that may stand for each other at a corner. Borrows places, normals and others.
struct VertexChoices {
  const uint32_t*
      places;            // equal where only normals, tangents, texture coordinates, colours differ
  const float* normals;  // three each, of length one or zero
  const float* others;   // `other_count` each: texture coordinates and colours in a unit box
  size_t other_count;
  const uint32_t* canonical_vertices;  // as in Surface
  // The vertices of level 0 at place p are vertices[begin[p]] .. vertices[begin[p + 1]], ascending.
  std::vector<uint32_t> begin, vertices;
  std::vector<float> place_normals;  // three for each of `vertices`: the guard's

  // Fills the lists for the vertices of `corner_count` corners of level 0.
  void fill(const uint32_t* corners, size_t corner_count, size_t vertex_count);

  uint32_t count_at(uint32_t vertex) const {
    return begin[places[vertex] + 1] - begin[places[vertex]];
  }
};

// Returns the corners, three each, of the triangles of level 0 that are nearest to points.
using NearestTriangles = std::function<std::vector<uint32_t>(const std::vector<Vec3>& points)>;

// Gives triangles the vertices that fit them best at the same positions. points: of all vertices.
// errors: by how much each triangle may be off the surface of level 0.
void choose_vertices(const VertexChoices& choices, const float* points,
                     const std::vector<double>& errors, const NearestTriangles& nearest,
                     int threads, std::vector<uint32_t>& triangles);

}  // namespace gltf_meshlet_codec

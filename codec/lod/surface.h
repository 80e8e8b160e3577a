// A primitive on its grid, as the builder of levels sees it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lod/vertex_choices.h"

namespace gltf_meshlet_codec {

// Three vertex numbers for each triangle.
using Triangles = std::vector<uint32_t>;

// Borrows its arrays.
struct Surface {
  const uint32_t* triangles;  // without repeated corners
  size_t triangle_count, vertex_count;
  const float* points;           // three integers each: positions on the grid
  const uint32_t* position_ids;  // equal where points are
  // The same vertex for all vertices that are equal in all integers, or that edges of length zero
  // connect.
  const uint32_t* canonical_vertices;
  const float* seam_points;  // points, moved apart where only the grid joins vertices
  // `attribute_count` floats for each vertex and for all: values that count in the choice of edges,
  // beside positions.
  const float *attributes, *weights;
  size_t attribute_count;
  std::vector<const float*> shapes;  // points at rest, then with each morph target at weight 1
  const uint8_t* locked;             // 1 for vertices that stay, equal where points are; or null
  const VertexChoices* choices;      // null without normals
  std::vector<uint32_t> vertex_of_position;  // the first vertex at each position, by its id

  bool is_degenerate(const uint32_t* corners) const {
    const uint32_t a = position_ids[corners[0]], b = position_ids[corners[1]];
    const uint32_t c = position_ids[corners[2]];
    return a == b || b == c || c == a;
  }
};

// Returns the first vertex at each position. position_ids: of `count` vertices, below `count`.
inline std::vector<uint32_t> first_vertices(const uint32_t* position_ids, size_t count) {
  std::vector<uint32_t> first;
  for (size_t v = count; v-- > 0;) {
    if (position_ids[v] >= first.size()) first.resize(size_t(position_ids[v]) + 1);
    first[position_ids[v]] = uint32_t(v);
  }
  return first;
}

}  // namespace gltf_meshlet_codec

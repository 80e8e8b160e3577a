// Checks meshlets that come from a caller.
#pragma once
#include "segment/generate_meshlets.h"

namespace gltf_meshlet_codec {

constexpr const char* kTooManyVertices = "a meshlet has more than 64 vertices";

// Do they start at 0, increase, and end at `end`?
bool are_begins(const std::vector<uint32_t>& begin, size_t end);

// Throws std::invalid_argument unless these are the numbers below `count`, each once.
void check_order(const std::vector<uint32_t>& triangles, size_t count);

// Both throw std::invalid_argument unless the meshlets are as `Meshlets` and `generate_meshlets`
// say. check_lists: a permutation of the triangles, begins, and at most 64 triangles each.
// check_disks, after that: disks, and at most 64 vertices. half_edges: match_half_edges of the
// mesh.
void check_lists(const Meshlets& meshlets, size_t triangle_count);
void check_disks(const MeshView& mesh, const HalfEdges& half_edges, const Meshlets& meshlets);

}  // namespace gltf_meshlet_codec

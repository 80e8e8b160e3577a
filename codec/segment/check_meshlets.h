// Checks meshlets that come from a caller.
#pragma once
#include "segment/generate_meshlets.h"

namespace meshlet {

// Throws std::invalid_argument unless the meshlets are as `Meshlets` and `generate_meshlets` say:
// a permutation of the mesh's triangles, in disks, within the limits of a meshlet. half_edges:
// match_half_edges of the mesh.
void check_meshlets(const MeshView& mesh, const HalfEdges& half_edges, const Meshlets& meshlets);

}  // namespace meshlet

// Checks meshlets that come from a caller.
#pragma once
#include "segment/generate_meshlets.h"

namespace meshlet {

// Throws std::invalid_argument unless the meshlets are as `Meshlets` and `generate_meshlets` say:
// a permutation of the mesh's triangles, in disks, within the limits of a meshlet.
void check_meshlets(const MeshView& mesh, const Meshlets& meshlets, int threads);

}  // namespace meshlet

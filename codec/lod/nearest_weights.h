// Nearest points of triangles, as weights of the corners.
#pragma once
#include <array>

#include "lod/vec3d.h"

namespace gltf_meshlet_codec {

// Returns the corner weights of the point of a triangle that is nearest to `point`.
std::array<double, 3> nearest_weights(Vec3d point, const std::array<Vec3d, 3>& corners);

}  // namespace gltf_meshlet_codec

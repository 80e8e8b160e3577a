#include "lod/nearest_weights.h"

#include <limits>

namespace gltf_meshlet_codec {
namespace {

using Weights = std::array<double, 3>;

// The best of the candidates so far.
struct Nearest {
  Vec3d point;
  const std::array<Vec3d, 3>& corners;
  double squared = std::numeric_limits<double>::infinity();
  Weights weights{};

  void offer(const Weights& w) {
    const Vec3d at = corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2];
    const Vec3d apart = at - point;
    const double distance = dot(apart, apart);
    if (distance < squared) squared = distance, weights = w;
  }
};

}  // namespace

// Tries the three edges and the projection into the triangle, so that degenerate ones need no cases
// of their own.
std::array<double, 3> nearest_weights(Vec3d point, const std::array<Vec3d, 3>& corners) {
  Nearest nearest{point, corners};
  for (size_t k = 0; k < 3; k++) {
    const size_t next = (k + 1) % 3;
    const Vec3d edge = corners[next] - corners[k];
    const double squared = dot(edge, edge);
    const double along = dot(point - corners[k], edge) / (squared > 0 ? squared : 1.0);
    Weights w{};
    w[next] = std::clamp(along, 0.0, 1.0);
    w[k] = 1.0 - w[next];
    nearest.offer(w);
  }
  const Vec3d normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
  const double area = dot(normal, normal);
  if (!(area > 0)) return nearest.weights;
  Weights inside;
  for (size_t k = 0; k < 3; k++) {
    const Vec3d start = corners[(k + 1) % 3], end = corners[(k + 2) % 3];
    inside[k] = dot(cross(end - start, point - start), normal) / area;
  }
  if (inside[0] >= 0 && inside[1] >= 0 && inside[2] >= 0) nearest.offer(inside);
  return nearest.weights;
}

}  // namespace gltf_meshlet_codec

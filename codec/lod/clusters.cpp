#include "lod/clusters.h"

namespace gltf_meshlet_codec {

void ClusterRanges::append(const ClusterRanges& from, size_t cluster) {
  const uint32_t first = from.first_triangle(cluster), before = disk_begin.back() - first;
  for (uint32_t d = from.cluster_begin[cluster] + 1; d <= from.cluster_begin[cluster + 1]; d++)
    disk_begin.push_back(before + from.disk_begin[d]);  // modulo 2^32
  cluster_begin.push_back(uint32_t(disk_begin.size() - 1));
  triangles.insert(triangles.end(), from.corners(cluster), from.corners(cluster + 1));
}

Sphere enclosing_sphere(const std::vector<Sphere>& spheres) {
  Vec3d low = spheres[0].centre, high = low;
  for (const Sphere& s : spheres) {
    const Vec3d r{s.radius, s.radius, s.radius};
    low = minimum(low, s.centre - r);
    high = maximum(high, s.centre + r);
  }
  Sphere all{(low + high) / 2, 0};
  for (const Sphere& s : spheres)
    all.radius = std::max(all.radius, length(s.centre - all.centre) + s.radius);
  return all;
}

}  // namespace gltf_meshlet_codec

// Clusters, the meshlets of levels of detail, and their groups, while levels are built. Lengths are
// in cells of the grid.
#pragma once
#include <cstdint>
#include <vector>

#include "lod/vec3d.h"

namespace gltf_meshlet_codec {

constexpr int32_t kNoGroup = -1;

// Clusters as ranges of disks, disks as ranges of triangles.
struct ClusterRanges {
  std::vector<uint32_t> triangles;         // three vertices each, cluster after cluster
  std::vector<uint32_t> disk_begin{0};     // the first triangle of each disk, and their number
  std::vector<uint32_t> cluster_begin{0};  // the first disk of each cluster, and their number

  size_t count() const { return cluster_begin.size() - 1; }
  size_t triangle_count() const { return disk_begin.back(); }
  uint32_t first_triangle(size_t cluster) const { return disk_begin[cluster_begin[cluster]]; }
  uint32_t size(size_t cluster) const {
    return first_triangle(cluster + 1) - first_triangle(cluster);
  }
  const uint32_t* corners(size_t cluster) const {
    return triangles.data() + 3 * size_t(first_triangle(cluster));
  }
  // Appends a cluster of another list.
  void append(const ClusterRanges& from, size_t cluster);
};

struct Sphere {
  Vec3d centre;
  double radius;
};

// Returns a sphere that encloses at least one sphere.
Sphere enclosing_sphere(const std::vector<Sphere>& spheres);

struct Cluster {
  int32_t finer_group;  // the group that it replaces a part of, or kNoGroup
  double error;         // of that group, or 0
  double base_error;  // the largest distance to level 0 of the surface that errors are measured to
  Sphere sphere;      // around the cluster and all finer ones that it replaces
};

struct ClusterSet {
  ClusterRanges ranges;
  std::vector<Cluster> clusters;

  void append(const ClusterSet& from, size_t cluster) {
    ranges.append(from.ranges, cluster);
    clusters.push_back(from.clusters[cluster]);
  }
};

// Clusters that are simplified together.
struct ClusterGroup {
  uint32_t level;  // that it was formed in
  double error;    // of its replacement; infinite without one
  Sphere sphere;   // around it and all finer groups below it
};

}  // namespace gltf_meshlet_codec

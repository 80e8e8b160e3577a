// Measures the error of replaced groups: distances to level 0, not to the level before.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "common/array.h"
#include "lod/reduce_groups.h"
#include "lod/replacement_errors.h"

namespace gltf_meshlet_codec {

// Points on triangles, spread by area.
struct AreaSamples {
  std::vector<uint32_t> triangles;  // of each point, ascending
  std::vector<float> areas;         // that each point stands for
};

// Places a point in every second triangle, and several in large ones. points: three floats each.
AreaSamples sample_by_area(const float* points, const Triangles& triangles);

// Returns corner weights of points that are spread evenly in a triangle.
std::vector<Vec3> sample_weights(size_t count);

// Level 0, and samples of it that follow the surface from level to level.
//
// Samples are points in triangles, and the vertices that simplification has removed. A sample lies
// on the nearest triangle of the replacement, and belongs to the group of this triangle in the next
// level. Its weight is the area of level 0 that it stands for.
class ErrorMeter : public GroupMeasure {
 public:
  // Places samples in level 0. triangle_ids: the caller's numbers of its triangles.
  ErrorMeter(const std::vector<const float*>& shapes, size_t vertex_count,
             std::shared_ptr<const Triangles> level_0, const std::vector<uint32_t>& begin,
             const std::vector<uint32_t>& triangle_ids, int threads);

  // Assigns the samples to the groups of a level. Arguments as in the constructor.
  void begin_level(std::shared_ptr<const Triangles> triangles, const std::vector<uint32_t>& begin,
                   const std::vector<uint32_t>& triangle_ids);

  std::vector<float> measure(const Pieces& pieces, const std::vector<uint32_t>& groups) override;
  std::vector<uint32_t> lost_vertices(uint32_t group, const Triangles& piece,
                                      double max_distance) const override;

  // Returns the corners, three each, of the triangles of level 0 that are nearest to points.
  std::vector<uint32_t> nearest(const std::vector<Vec3>& points) const;

  // Moves the samples of replaced groups to the replacements. first_new_triangle: the place in
  // `new_triangle_ids`, the caller's numbers of the new triangles, where each group's begin.
  void replace(const std::vector<bool>& is_replaced,
               const std::vector<uint32_t>& first_new_triangle,
               const std::vector<uint32_t>& new_triangle_ids);

  // For tests.
  const std::vector<uint32_t>& sample_triangle_ids() const { return sample_triangle_id_; }
  const std::vector<float>& sample_areas() const { return sample_areas_; }

 private:
  const int threads_;
  const std::shared_ptr<const Triangles> level_0_;
  std::vector<Array<float>> shapes_;  // with the samples after the vertices
  std::unique_ptr<const ReplacementErrors> errors_;
  // For each sample: its number among vertices and points, the caller's number of its triangle, its
  // area. begin_level adds its triangle's place in the level, and sorts the samples by groups.
  std::vector<uint32_t> samples_, sample_triangle_id_;
  std::vector<float> sample_areas_;
  std::shared_ptr<const Triangles> level_triangles_;
  std::vector<uint32_t> group_begin_, sample_triangle_, sample_group_;
  std::vector<uint32_t> order_, order_begin_;  // samples by group
  // Samples on replacements.
  struct NextSample {
    uint32_t sample, group, triangle;  // triangle: its place in the replacement
    float area;
  };
  std::vector<NextSample> next_samples_;
};

}  // namespace gltf_meshlet_codec

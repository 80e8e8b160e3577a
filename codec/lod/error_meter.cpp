#include "lod/error_meter.h"

#include <algorithm>
#include <cmath>

#include "common/parallel.h"
#include "lod/surface_distance.h"

namespace gltf_meshlet_codec {
namespace {

// The fraction of the area of level 0 that its vertices stand for. Points in triangles stand for
// the rest. Distances at vertices are larger than on the surface between them: a noisy scan of
// 3.5 M triangles draws 1.14 times the triangles with 0.25.
constexpr float kVertexFraction = 0.05f;
// The least number of sample points in level 0. With 16,384 here and in replacement_errors.cpp,
// engine (34 small primitives) takes 1.35 times the time; with 8,192 its errors hold as well.
constexpr size_t kLeastPoints = 8192;
constexpr size_t kPointsAtOnce = 1024;

Vec3 point_at(const float* points, uint32_t vertex) {
  const float* p = points + 3 * size_t(vertex);
  return {p[0], p[1], p[2]};
}

// Returns the n-th multiple of a step, without whole numbers.
double fraction(size_t n, double step) { return std::fmod(double(n) * step, 1.0); }

// Returns points followed by samples in triangles.
Array<float> with_samples(const float* points, size_t vertex_count, const Triangles& triangles,
                          const std::vector<uint32_t>& sample_triangles,
                          const std::vector<Vec3>& weights) {
  Array<float> all(points, points + 3 * vertex_count);
  all.reserve(3 * (vertex_count + weights.size()));
  for (size_t i = 0; i < weights.size(); i++) {
    const uint32_t* v = &triangles[3 * size_t(sample_triangles[i])];
    const Vec3 w = weights[i];
    const Vec3 p =
        point_at(points, v[0]) * w.x + point_at(points, v[1]) * w.y + point_at(points, v[2]) * w.z;
    all.insert(all.end(), {p.x, p.y, p.z});
  }
  return all;
}

}  // namespace

std::vector<Vec3> sample_weights(size_t count) {
  // Roberts' sequence R2 spreads points in a square.
  std::vector<Vec3> weights;
  weights.reserve(count);
  for (size_t n = 0; n < count; n++) {
    double u = fraction(n, 0.7548776662466927), v = fraction(n, 0.5698402909980532);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    weights.push_back({float(1 - u - v), float(u), float(v)});
  }
  return weights;
}

AreaSamples sample_by_area(const float* points, const Triangles& triangles) {
  std::vector<float> area(triangles.size() / 3);
  double total = 0;
  for (size_t t = 0; t < area.size(); t++) {
    const uint32_t* v = &triangles[3 * t];
    const Vec3 a = point_at(points, v[0]);
    area[t] = length(cross(point_at(points, v[1]) - a, point_at(points, v[2]) - a)) / 2;
    total += double(area[t]);
  }
  const double wanted = double(std::max(area.size() / 2, kLeastPoints));
  const double per_area = total > 0 && std::isfinite(total) ? wanted / total : 0;
  // Where all areas are alike, rounding does not decide.
  const auto times = [&](size_t t) {
    return per_area > 0 ? size_t(double(area[t]) * per_area + 1e-6) : 0;
  };
  size_t small = 0;
  for (size_t t = 0; t < area.size(); t++) small += times(t) == 0;
  const float weight = float(double(small) / double(std::max<size_t>((small + 1) / 2, 1)));
  AreaSamples samples;
  bool is_second = false;
  for (size_t t = 0; t < area.size(); t++) {
    const size_t count = times(t);
    if (count == 0) {
      if (!is_second) {
        samples.triangles.push_back(uint32_t(t));
        samples.areas.push_back(area[t] * weight);
      }
      is_second = !is_second;
    }
    samples.triangles.insert(samples.triangles.end(), count, uint32_t(t));
    samples.areas.insert(samples.areas.end(), count, area[t] / float(count));
  }
  return samples;
}

ErrorMeter::ErrorMeter(const std::vector<const float*>& shapes, size_t vertex_count,
                       std::shared_ptr<const Triangles> level_0, const std::vector<uint32_t>& begin,
                       const std::vector<uint32_t>& triangle_ids, int threads)
    : threads_(threads), level_0_(std::move(level_0)) {
  const AreaSamples placed = sample_by_area(shapes[0], *level_0_);
  const std::vector<Vec3> weights = sample_weights(placed.triangles.size());
  for (const float* shape : shapes)
    shapes_.push_back(with_samples(shape, vertex_count, *level_0_, placed.triangles, weights));
  std::vector<const float*> all;
  for (const Array<float>& shape : shapes_) all.push_back(shape.data());
  errors_ = std::make_unique<ReplacementErrors>(std::move(all), vertex_count + weights.size(),
                                                GroupTriangles{level_0_->data(), begin},
                                                kVertexFraction, threads);
  for (size_t i = 0; i < weights.size(); i++) {
    samples_.push_back(uint32_t(vertex_count + i));
    sample_triangle_id_.push_back(triangle_ids[placed.triangles[i]]);
    sample_areas_.push_back((1 - kVertexFraction) * placed.areas[i]);
  }
}

void ErrorMeter::begin_level(std::shared_ptr<const Triangles> triangles,
                             const std::vector<uint32_t>& begin,
                             const std::vector<uint32_t>& triangle_ids) {
  level_triangles_ = std::move(triangles);
  group_begin_ = begin;
  const uint32_t last = *std::max_element(triangle_ids.begin(), triangle_ids.end());
  std::vector<uint32_t> place(size_t(last) + 1);
  for (size_t t = 0; t < triangle_ids.size(); t++) place[triangle_ids[t]] = uint32_t(t);
  const size_t groups = begin.size() - 1;
  sample_triangle_.resize(samples_.size());
  sample_group_.resize(samples_.size());
  order_begin_.assign(groups + 1, 0);
  for (size_t i = 0; i < samples_.size(); i++) {
    sample_triangle_[i] = place[sample_triangle_id_[i]];
    const auto after = std::upper_bound(begin.begin(), begin.end(), sample_triangle_[i]);
    sample_group_[i] = uint32_t(after - begin.begin()) - 1;
    order_begin_[sample_group_[i] + 1]++;
  }
  for (size_t g = 0; g < groups; g++) order_begin_[g + 1] += order_begin_[g];
  order_.resize(samples_.size());
  std::vector<uint32_t> next(order_begin_);
  for (size_t i = 0; i < samples_.size(); i++) order_[next[sample_group_[i]]++] = uint32_t(i);
}

std::vector<float> ErrorMeter::measure(const Pieces& pieces, const std::vector<uint32_t>& groups) {
  CarriedVertices carried{{}, {}, {0}, {}};
  for (uint32_t g : groups) {
    for (uint32_t i = order_begin_[g]; i < order_begin_[g + 1]; i++) {
      carried.vertices.push_back(samples_[order_[i]]);
      carried.areas.push_back(sample_areas_[order_[i]]);
    }
    carried.begin.push_back(uint32_t(carried.vertices.size()));
  }
  Triangles all;
  const std::vector<uint32_t> piece_begin = joined(pieces, all);
  const std::vector<float> error =
      errors_->measure({level_triangles_->data(), group_begin_}, {all.data(), piece_begin}, groups,
                       carried, threads_);
  std::vector<bool> is_measured(pieces.size());
  for (uint32_t g : groups) is_measured[g] = true;
  const auto is_old = [&](const NextSample& s) { return is_measured[s.group]; };
  next_samples_.erase(std::remove_if(next_samples_.begin(), next_samples_.end(), is_old),
                      next_samples_.end());
  for (size_t k = 0; k < groups.size(); k++)
    for (uint32_t i = carried.begin[k]; i < carried.begin[k + 1]; i++)
      next_samples_.push_back({carried.vertices[i], groups[k],
                               carried.triangles[i] - piece_begin[groups[k]], carried.areas[i]});
  return error;
}

std::vector<uint32_t> ErrorMeter::lost_vertices(uint32_t group, const Triangles& piece,
                                                double max_distance) const {
  const uint32_t first = order_begin_[group], last = order_begin_[group + 1];
  const float limit = float(max_distance);
  std::vector<bool> is_far(last - first);
  for (const Array<float>& shape : shapes_) {
    const TriangleTree tree(shape.data(), piece.data(), {0, uint32_t(piece.size() / 3)}, 1);
    uint32_t hint = 0;
    for (uint32_t i = first; i < last; i++) {
      const Vec3 point = point_at(shape.data(), samples_[order_[i]]);
      const float squared = tree.squared_distance(point, hint, limit * limit);
      if (std::sqrt(squared) > limit) is_far[i - first] = true;
    }
  }
  std::vector<uint32_t> lost;
  for (uint32_t i = first; i < last; i++) {
    if (!is_far[i - first]) continue;
    const uint32_t* v = &(*level_triangles_)[3 * size_t(sample_triangle_[order_[i]])];
    lost.insert(lost.end(), v, v + 3);
  }
  return lost;
}

std::vector<uint32_t> ErrorMeter::nearest(const std::vector<Vec3>& points) const {
  std::vector<uint32_t> corners(3 * points.size());
  for_blocks(threads_, points.size(), kPointsAtOnce, [&](size_t, size_t first, size_t last) {
    uint32_t hint = 0;
    for (size_t i = first; i < last; i++)
      std::copy_n(&(*level_0_)[3 * size_t(errors_->nearest(points[i], hint))], 3, &corners[3 * i]);
  });
  return corners;
}

void ErrorMeter::replace(const std::vector<bool>& is_replaced,
                         const std::vector<uint32_t>& first_new_triangle,
                         const std::vector<uint32_t>& new_triangle_ids) {
  size_t count = 0;
  for (size_t i = 0; i < samples_.size(); i++) {
    if (is_replaced[sample_group_[i]]) continue;
    samples_[count] = samples_[i];
    sample_triangle_id_[count] = sample_triangle_id_[i];
    sample_areas_[count++] = sample_areas_[i];
  }
  samples_.resize(count);
  sample_triangle_id_.resize(count);
  sample_areas_.resize(count);
  for (const NextSample& s : next_samples_) {
    if (!is_replaced[s.group]) continue;
    samples_.push_back(s.sample);
    sample_triangle_id_.push_back(new_triangle_ids[first_new_triangle[s.group] + s.triangle]);
    sample_areas_.push_back(s.area);
  }
  next_samples_.clear();
}

}  // namespace gltf_meshlet_codec

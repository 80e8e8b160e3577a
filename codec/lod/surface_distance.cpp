#include "lod/surface_distance.h"

#include <algorithm>
#include <numeric>
#include <unordered_set>
#include <utility>

#include "common/parallel.h"

namespace meshlet {
namespace {

constexpr uint32_t kLeaf = 4;  // most triangles of a leaf: 2 and 8 are slower on dragon
constexpr int kMaxDepth = 64;  // medians halve: 32 levels for 2^32 triangles

float squared_length(Vec3 a) { return dot(a, a); }

float box_squared(Vec3 p, Vec3 low, Vec3 high) {
  const Vec3 outside = maximum(maximum(low - p, p - high), Vec3{0, 0, 0});
  return squared_length(outside);
}

// C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5: the region of the nearest point.
float triangle_squared(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const float d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return squared_length(ap);
  const Vec3 bp = p - b;
  const float d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return squared_length(bp);
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return squared_length(ap - ab * (d1 / (d1 - d3)));
  const Vec3 cp = p - c;
  const float d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return squared_length(cp);
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return squared_length(ap - ac * (d2 / (d2 - d6)));
  const float va = d3 * d6 - d5 * d4, along = (d4 - d3) + (d5 - d6);
  if (va <= 0 && d4 >= d3 && d5 >= d6 && along > 0)
    return squared_length(bp - (c - b) * ((d4 - d3) / along));
  const float sum = va + vb + vc;
  if (!(sum > 0)) return std::min({squared_length(ap), squared_length(bp), squared_length(cp)});
  return squared_length(ap - ab * (vb / sum) - ac * (vc / sum));
}

}  // namespace

TriangleTree::TriangleTree(std::vector<Vec3> corners) : corners_(std::move(corners)) {
  const uint32_t count = uint32_t(corners_.size() / 3);
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::vector<Vec3> centres(count);  // three times the centres
  for (size_t t = 0; t < count; t++)
    centres[t] = corners_[3 * t] + corners_[3 * t + 1] + corners_[3 * t + 2];
  nodes_.reserve(2 * size_t(count) / kLeaf + 2);
  nodes_.emplace_back();
  build(0, 0, count, centres, order);
  std::vector<Vec3> sorted;
  sorted.reserve(corners_.size());
  for (uint32_t t : order)
    sorted.insert(sorted.end(), corners_.begin() + 3 * size_t(t),
                  corners_.begin() + 3 * size_t(t) + 3);
  corners_ = std::move(sorted);
}

void TriangleTree::build(uint32_t node, uint32_t first, uint32_t last,
                         const std::vector<Vec3>& centres, std::vector<uint32_t>& order) {
  Vec3 low = corners_[3 * size_t(order[first])], high = low;
  for (uint32_t i = first; i < last; i++)
    for (size_t k = 0; k < 3; k++) {
      low = minimum(low, corners_[3 * size_t(order[i]) + k]);
      high = maximum(high, corners_[3 * size_t(order[i]) + k]);
    }
  nodes_[node] = {low, high, first, last - first};
  if (last - first <= kLeaf) return;
  const Vec3 size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const uint32_t middle = first + (last - first) / 2;
  std::nth_element(order.begin() + first, order.begin() + middle, order.begin() + last,
                   [&](uint32_t s, uint32_t t) {
                     const float a = centres[s][axis], b = centres[t][axis];
                     return a != b ? a < b : s < t;
                   });
  const uint32_t child = uint32_t(nodes_.size());
  nodes_[node].first = child;
  nodes_[node].count = 0;
  nodes_.resize(nodes_.size() + 2);
  build(child, first, middle, centres, order);
  build(child + 1, middle, last, centres, order);
}

float TriangleTree::squared(Vec3 point, uint32_t triangle) const {
  const Vec3* c = &corners_[3 * size_t(triangle)];
  return triangle_squared(point, c[0], c[1], c[2]);
}

float TriangleTree::squared_distance(Vec3 point, uint32_t& hint, float enough) const {
  float best = squared(point, hint);
  std::pair<uint32_t, float> stack[kMaxDepth];
  int size = 0;
  stack[size++] = {0, box_squared(point, nodes_[0].low, nodes_[0].high)};
  while (size > 0 && best > enough) {
    const auto [number, bound] = stack[--size];
    if (bound >= best) continue;
    const Node& node = nodes_[number];
    for (uint32_t t = node.first; t < node.first + node.count; t++) {
      const float d = squared(point, t);
      if (d < best) best = d, hint = t;
    }
    if (node.count > 0) continue;
    const Node &left = nodes_[node.first], &right = nodes_[node.first + 1];
    std::pair<uint32_t, float> near{node.first, box_squared(point, left.low, left.high)};
    std::pair<uint32_t, float> far{node.first + 1, box_squared(point, right.low, right.high)};
    if (far.second < near.second) std::swap(near, far);
    stack[size++] = far;
    stack[size++] = near;
  }
  return best;
}

namespace {

Vec3 point_of(const float* positions, uint32_t vertex) {
  const float* p = positions + 3 * size_t(vertex);
  return {p[0], p[1], p[2]};
}

std::vector<Vec3> corners_of(const float* positions, const uint32_t* triangles, size_t count) {
  std::vector<Vec3> corners(3 * count);
  for (size_t i = 0; i < 3 * count; i++) corners[i] = point_of(positions, triangles[i]);
  return corners;
}

// The vertices that simplification removed, in the order of the triangles: neighbours follow each
// other.
std::vector<Vec3> removed_points(const float* positions, const uint32_t* before, size_t count,
                                 const uint32_t* after, size_t after_count) {
  std::unordered_set<uint32_t> done(after, after + 3 * after_count);
  std::vector<Vec3> points;
  for (size_t i = 0; i < 3 * count; i++)
    if (done.insert(before[i]).second) points.push_back(point_of(positions, before[i]));
  return points;
}

// Centres of triangles, each followed by middles of those of its edges that were not there yet.
std::vector<Vec3> middles(const float* positions, const uint32_t* triangles, size_t count) {
  std::unordered_set<uint64_t> done;  // edges
  done.reserve(3 * count);
  std::vector<Vec3> points;
  for (size_t t = 0; t < 3 * count; t += 3) {
    Vec3 corner[3];
    for (size_t k = 0; k < 3; k++) corner[k] = point_of(positions, triangles[t + k]);
    points.push_back((corner[0] + corner[1] + corner[2]) * (1.0f / 3.0f));
    for (size_t k = 0; k < 3; k++) {
      const uint64_t a = triangles[t + k], b = triangles[t + (k + 1) % 3];
      if (done.insert(std::min(a, b) << 32 | std::max(a, b)).second)
        points.push_back((corner[k] + corner[(k + 1) % 3]) * 0.5f);
    }
  }
  return points;
}

// The largest squared distance of the points, at least `least`. Most points are known to be nearer
// than the farthest so far after a triangle or two.
float farthest(const std::vector<Vec3>& points, const TriangleTree& to, float least) {
  uint32_t hint = 0;
  for (const Vec3& point : points) least = std::max(least, to.squared_distance(point, hint, least));
  return least;
}

float group_distance(const float* positions, const uint32_t* before, size_t before_count,
                     const uint32_t* after, size_t after_count) {
  const TriangleTree was(corners_of(positions, before, before_count));
  const TriangleTree is(corners_of(positions, after, after_count));
  const std::vector<Vec3> removed =
      removed_points(positions, before, before_count, after, after_count);
  const float there = farthest(removed, is, 0);
  return std::sqrt(farthest(middles(positions, after, after_count), was, there));
}

}  // namespace

std::vector<float> group_distances(const Surfaces& s, int threads) {
  std::vector<float> distances(s.before_begin.size() - 1);
  parallel_for(threads, distances.size(), [&](size_t g) {
    const uint32_t before = s.before_begin[g], after = s.after_begin[g];
    distances[g] =
        group_distance(s.positions, s.before + 3 * size_t(before), s.before_begin[g + 1] - before,
                       s.after + 3 * size_t(after), s.after_begin[g + 1] - after);
  });
  return distances;
}

}  // namespace meshlet

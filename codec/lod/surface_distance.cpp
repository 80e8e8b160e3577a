#include "lod/surface_distance.h"

#include <algorithm>
#include <limits>
#include <numeric>
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

float segment_squared(Vec3 p, Vec3 a, Vec3 edge) {
  const float length2 = dot(edge, edge);
  const float t = length2 > 0 ? std::clamp(dot(p - a, edge) / length2, 0.0f, 1.0f) : 0.0f;
  return squared_length(p - a - edge * t);
}

// Within the triangle's prism, the distance to its plane; else to the nearest edge.
float triangle_squared(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 ab = b - a, bc = c - b, ca = a - c;
  const Vec3 normal = cross(ab, c - a);
  const float length2 = dot(normal, normal);
  const bool inside = length2 > 0 && dot(cross(ab, p - a), normal) >= 0 &&
                      dot(cross(bc, p - b), normal) >= 0 && dot(cross(ca, p - c), normal) >= 0;
  if (inside) {
    const float d = dot(p - a, normal);
    return d * d / length2;
  }
  return std::min(
      {segment_squared(p, a, ab), segment_squared(p, b, bc), segment_squared(p, c, ca)});
}

}  // namespace

TriangleTree::TriangleTree(std::vector<Vec3> corners) : corners_(std::move(corners)) {
  const uint32_t count = uint32_t(corners_.size() / 3);
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  nodes_.reserve(2 * size_t(count) / kLeaf + 2);
  nodes_.emplace_back();
  build(0, 0, count, order);
  std::vector<Vec3> sorted;
  sorted.reserve(corners_.size());
  for (uint32_t t : order)
    sorted.insert(sorted.end(), corners_.begin() + 3 * size_t(t),
                  corners_.begin() + 3 * size_t(t) + 3);
  corners_ = std::move(sorted);
}

void TriangleTree::build(uint32_t node, uint32_t first, uint32_t last,
                         std::vector<uint32_t>& order) {
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
  const auto centre = [&](uint32_t t) {
    const Vec3* c = &corners_[3 * size_t(t)];
    return c[0][axis] + c[1][axis] + c[2][axis];
  };
  const uint32_t middle = first + (last - first) / 2;
  std::nth_element(order.begin() + first, order.begin() + middle, order.begin() + last,
                   [&](uint32_t s, uint32_t t) {
                     const float a = centre(s), b = centre(t);
                     return a != b ? a < b : s < t;
                   });
  const uint32_t child = uint32_t(nodes_.size());
  nodes_[node].first = child;
  nodes_[node].count = 0;
  nodes_.resize(nodes_.size() + 2);
  build(child, first, middle, order);
  build(child + 1, middle, last, order);
}

float TriangleTree::squared(Vec3 point, uint32_t triangle) const {
  const Vec3* c = &corners_[3 * size_t(triangle)];
  return triangle_squared(point, c[0], c[1], c[2]);
}

float TriangleTree::distance(Vec3 point, uint32_t& hint) const {
  float best = squared(point, hint);
  std::pair<uint32_t, float> stack[kMaxDepth];
  int size = 0;
  stack[size++] = {0, box_squared(point, nodes_[0].low, nodes_[0].high)};
  while (size > 0) {
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
  return std::sqrt(best);
}

namespace {

std::vector<Vec3> corners_of(const float* positions, const uint32_t* triangles, size_t count) {
  std::vector<Vec3> corners(3 * count);
  for (size_t i = 0; i < 3 * count; i++) {
    const float* p = positions + 3 * size_t(triangles[i]);
    corners[i] = {p[0], p[1], p[2]};
  }
  return corners;
}

// Largest distance of a surface's vertices to another one: the first corner of each triangle is
// nearly every vertex.
float largest_at_corners(const std::vector<Vec3>& corners, const TriangleTree& to) {
  float largest = 0;
  uint32_t hint = 0;
  for (size_t t = 0; t < corners.size(); t += 3)
    largest = std::max(largest, to.distance(corners[t], hint));
  return largest;
}

// The same at the centres of triangles and the middles of their edges.
float largest_at_middles(const std::vector<Vec3>& corners, const TriangleTree& to) {
  float largest = 0;
  uint32_t hint = 0;
  for (size_t t = 0; t < corners.size(); t += 3) {
    const Vec3 a = corners[t], b = corners[t + 1], c = corners[t + 2];
    for (const Vec3& p :
         {(a + b) * 0.5f, (b + c) * 0.5f, (c + a) * 0.5f, (a + b + c) * (1.0f / 3.0f)})
      largest = std::max(largest, to.distance(p, hint));
  }
  return largest;
}

}  // namespace

std::vector<float> group_distances(const Surfaces& s, int threads) {
  std::vector<float> distances(s.before_begin.size() - 1);
  parallel_for(threads, distances.size(), [&](size_t g) {
    const auto corners = [&](const uint32_t* triangles, const std::vector<uint32_t>& begin) {
      return corners_of(s.positions, triangles + 3 * size_t(begin[g]), begin[g + 1] - begin[g]);
    };
    const std::vector<Vec3> before = corners(s.before, s.before_begin);
    const std::vector<Vec3> after = corners(s.after, s.after_begin);
    distances[g] = std::max(largest_at_corners(before, TriangleTree(after)),
                            largest_at_middles(after, TriangleTree(before)));
  });
  return distances;
}

}  // namespace meshlet

#include "lod/surface_distance.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "common/parallel.h"

namespace meshlet {
namespace {

constexpr uint32_t kLeaf = 4;  // most triangles of a leaf: 2 and 8 are slower on dragon
constexpr int kMaxDepth = 64;  // medians halve: 32 levels for 2^32 triangles

float squared_length(Vec3 a) { return dot(a, a); }

int longest_axis(Vec3 low, Vec3 high) {
  const Vec3 size = high - low;
  return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
}

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

// Sorts triangles into a tree.
class TreeBuilder {
 public:
  using Node = TriangleTree::Node;

  // corners: of all triangles.
  explicit TreeBuilder(const std::vector<Vec3>& corners) : corners_(corners) {}

  // A tree of triangles first .. last - 1. Writes their order to the same places of `order`.
  std::vector<Node> build(uint32_t first, uint32_t last, std::vector<uint32_t>& order) {
    first_ = first;
    items_.resize(last - first);
    for (uint32_t i = 0; i < items_.size(); i++) {
      const Vec3* c = &corners_[3 * size_t(first + i)];
      items_[i] = {c[0] + c[1] + c[2], first + i};
    }
    nodes_.assign(1, {});
    split(0, 0, last - first);
    for (uint32_t i = 0; i < items_.size(); i++) order[first + i] = items_[i].triangle;
    return std::move(nodes_);
  }

 private:
  struct Item {
    Vec3 centre;  // three times the centre
    uint32_t triangle;
  };

  void split(uint32_t node, uint32_t first, uint32_t last) {
    if (last - first <= kLeaf) {
      make_leaf(node, first, last);
      return;
    }
    Vec3 low = items_[first].centre, high = low;
    for (uint32_t i = first; i < last; i++) {
      low = minimum(low, items_[i].centre);
      high = maximum(high, items_[i].centre);
    }
    const int axis = longest_axis(low, high);
    const uint32_t middle = first + (last - first) / 2;
    std::nth_element(items_.begin() + first, items_.begin() + middle, items_.begin() + last,
                     [axis](const Item& s, const Item& t) {
                       const float a = s.centre[axis], b = t.centre[axis];
                       return a != b ? a < b : s.triangle < t.triangle;
                     });
    const uint32_t child = uint32_t(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    split(child, first, middle);
    split(child + 1, middle, last);
    nodes_[node] = {minimum(nodes_[child].low, nodes_[child + 1].low),
                    maximum(nodes_[child].high, nodes_[child + 1].high), child, 0};
  }

  void make_leaf(uint32_t node, uint32_t first, uint32_t last) {
    Vec3 low = corners_[3 * size_t(items_[first].triangle)], high = low;
    for (uint32_t i = first; i < last; i++)
      for (size_t k = 0; k < 3; k++) {
        const Vec3 corner = corners_[3 * size_t(items_[i].triangle) + k];
        low = minimum(low, corner);
        high = maximum(high, corner);
      }
    nodes_[node] = {low, high, first_ + first, last - first};
  }

  const std::vector<Vec3>& corners_;
  uint32_t first_ = 0;
  std::vector<Item> items_;
  std::vector<Node> nodes_;
};

}  // namespace

TriangleTree::TriangleTree(std::vector<Vec3> corners) : TriangleTree(std::move(corners), {}, 1) {}

TriangleTree::TriangleTree(std::vector<Vec3> corners, std::vector<uint32_t> part_begin, int threads)
    : corners_(std::move(corners)), numbers_(corners_.size() / 3) {
  if (part_begin.empty()) part_begin = {0, uint32_t(numbers_.size())};
  std::vector<std::vector<Node>> parts(part_begin.size() - 1);
  parallel_for(threads, parts.size(), [&](size_t i) {
    parts[i] = TreeBuilder(corners_).build(part_begin[i], part_begin[i + 1], numbers_);
  });
  size_t count = 2 * parts.size();
  for (const auto& part : parts) count += part.size();
  nodes_.reserve(count);
  part_root_.resize(parts.size());
  nodes_.emplace_back();
  std::vector<uint32_t> order(parts.size());
  std::iota(order.begin(), order.end(), 0);
  join(0, 0, uint32_t(parts.size()), parts, order);
  std::vector<Vec3> sorted(corners_.size());
  for (size_t i = 0; i < numbers_.size(); i++)
    std::copy_n(&corners_[3 * size_t(numbers_[i])], 3, &sorted[3 * i]);
  corners_ = std::move(sorted);
}

void TriangleTree::join(uint32_t node, uint32_t first, uint32_t last,
                        std::vector<std::vector<Node>>& parts, std::vector<uint32_t>& order) {
  if (last - first == 1) {
    part_root_[order[first]] = node;
    add_part(node, parts[order[first]]);
    return;
  }
  Vec3 low = parts[order[first]][0].low, high = parts[order[first]][0].high;
  for (uint32_t i = first; i < last; i++) {
    low = minimum(low, parts[order[i]][0].low);
    high = maximum(high, parts[order[i]][0].high);
  }
  const int axis = longest_axis(low, high);
  const uint32_t middle = first + (last - first) / 2;
  const auto place = [&](uint32_t part) {
    return parts[part][0].low[axis] + parts[part][0].high[axis];
  };
  std::nth_element(order.begin() + first, order.begin() + middle, order.begin() + last,
                   [&](uint32_t s, uint32_t t) {
                     const float a = place(s), b = place(t);
                     return a != b ? a < b : s < t;
                   });
  const uint32_t child = uint32_t(nodes_.size());
  nodes_[node] = {low, high, child, 0};
  nodes_.resize(nodes_.size() + 2);
  join(child, first, middle, parts, order);
  join(child + 1, middle, last, parts, order);
}

void TriangleTree::add_part(uint32_t node, std::vector<Node>& part) {
  const uint32_t moved = uint32_t(nodes_.size()) - 1;  // the root has its place already
  for (Node& n : part)
    if (n.count == 0) n.first += moved;
  nodes_[node] = part[0];
  nodes_.insert(nodes_.end(), part.begin() + 1, part.end());
  part.resize(1);  // its box is still compared
  part.shrink_to_fit();
}

float TriangleTree::squared(Vec3 point, uint32_t triangle) const {
  const Vec3* c = &corners_[3 * size_t(triangle)];
  return triangle_squared(point, c[0], c[1], c[2]);
}

float TriangleTree::search(uint32_t root, Vec3 point, uint32_t& hint, float enough) const {
  float best = squared(point, hint);
  std::pair<uint32_t, float> stack[kMaxDepth];
  int size = 0;
  stack[size++] = {root, box_squared(point, nodes_[root].low, nodes_[root].high)};
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

}  // namespace meshlet

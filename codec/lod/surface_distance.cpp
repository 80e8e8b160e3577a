#include "lod/surface_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "common/curve.h"
#include "common/parallel.h"

namespace gltf_meshlet_codec {
namespace {

constexpr uint32_t kIsLeaf = 1u << 31;
// Places may be off by so many of the steps that floats have at the triangle. With 4096, a noisy
// tetrahedron of 14,400 triangles states 1.9 times its errors; with 16, levels of engine take 1.25
// times the time of floats alone, with 64 1.1 times.
constexpr double kFineEnough = 64;
constexpr uint32_t kNone = ~0u;  // no node
// A node adds three entries: at most 14 levels for 2^28 leaves, and as many for the groups.
constexpr int kStack = 96;

// Four numbers at once. Comparisons give masks, by which ? : chooses.
using Lanes = float __attribute__((vector_size(16)));
using WideLanes = double __attribute__((vector_size(32)));

template <class L>
struct Points {
  L x, y, z;
};
using Lanes3 = Points<Lanes>;
using WideLanes3 = Points<WideLanes>;

Lanes all(float value) { return Lanes{value, value, value, value}; }
Lanes3 all(Vec3 v) { return {all(v.x), all(v.y), all(v.z)}; }
Lanes load(const float* four) {
  Lanes lanes;
  std::memcpy(&lanes, four, sizeof lanes);
  return lanes;
}
Lanes3 load(const float (*xyz)[4]) { return {load(xyz[0]), load(xyz[1]), load(xyz[2])}; }
WideLanes3 widened(const Lanes3& p) {
  return {__builtin_convertvector(p.x, WideLanes), __builtin_convertvector(p.y, WideLanes),
          __builtin_convertvector(p.z, WideLanes)};
}
template <class Mask, class L>
Points<L> choose(const Mask& mask, const Points<L>& a, const Points<L>& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}
Lanes larger(Lanes a, Lanes b) { return a > b ? a : b; }

template <class L>
Points<L> operator-(const Points<L>& a, const Points<L>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class L>
Points<L> operator*(const Points<L>& a, const L& s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class L>
L dot(const Points<L>& a, const Points<L>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// Squared distances from a point to four triangles. C. Ericson, Real-Time Collision Detection,
// 2005, section 5.1.5: the region of the nearest point.
template <class L>
Lanes triangles_squared(const Points<L>& p, const Points<L>& a, const Points<L>& b,
                        const Points<L>& c) {
  const Points<L> ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const L d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp);
  const L d5 = dot(ab, cp), d6 = dot(ac, cp);
  const L va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  const L rise = d4 - d3, along = rise + (d5 - d6), sum = va + vb + vc;
  // Each mask without those before it.
  const auto at_a = (d1 <= 0) & (d2 <= 0);
  const auto at_b = (d3 >= 0) & (d4 <= d3) & ~at_a;
  auto taken = at_a | at_b;
  const auto on_ab = (vc <= 0) & (d1 >= 0) & (d3 <= 0) & (d1 > d3) & ~taken;
  taken |= on_ab;
  const auto at_c = (d6 >= 0) & (d5 <= d6) & ~taken;
  taken |= at_c;
  const auto on_ac = (vb <= 0) & (d2 >= 0) & (d6 <= 0) & (d2 > d6) & ~taken;
  taken |= on_ac;
  const auto on_bc = (va <= 0) & (rise >= 0) & (d5 >= d6) & (along > 0) & ~taken;
  taken |= on_bc;
  const auto inside = (sum > 0) & ~taken;  // if rounding leaves no region: distance to a
  const L zero{}, one = zero + 1;
  const Points<L> base = choose(at_b | on_bc, bp, choose(at_c, cp, ap));
  const Points<L> edge = choose(on_bc, c - b, ab);
  const L inner_s = inside ? vb : zero, inner_t = inside ? vc : zero, inner = inside ? sum : one;
  const L ab_s = on_ab ? d1 : inner_s, ab_whole = on_ab ? d1 - d3 : inner;
  const L s = on_bc ? rise : ab_s, t = on_ac ? d2 : inner_t;
  const L ac_whole = on_ac ? d2 - d6 : ab_whole;
  const L whole = on_bc ? along : ac_whole;
  const Points<L> offset = base - edge * (s / whole) - ac * (t / whole);
  return __builtin_convertvector(dot(offset, offset), Lanes);
}

// Whether float has too few bits for distances to a triangle: the nearest point is off along the
// triangle by 2^-24 of the cube of the longest side over the square of the height. Slivers made
// distances to the coarse levels of a noisy surface three times as large as they were.
bool is_wide(const Vec3 (&corners)[3]) {
  double longest = 0, largest = 0;
  for (int k = 0; k < 3; k++) {
    longest = std::max(longest, double(length(corners[(k + 1) % 3] - corners[k])));
    for (int axis = 0; axis < 3; axis++)
      largest = std::max(largest, double(std::fabs(corners[k][axis])));
  }
  const double twice_area = length(cross(corners[1] - corners[0], corners[2] - corners[0]));
  const double squared = longest * longest;
  return squared * squared * longest > kFineEnough * largest * twice_area * twice_area;
}

// Squared distances from a point to four boxes.
Lanes boxes_squared(Lanes3 p, Lanes3 low, Lanes3 high) {
  const Lanes3 below = low - p, above = p - high;
  const Lanes zero = all(0.0f);
  const Lanes3 outside = {larger(larger(below.x, above.x), zero),
                          larger(larger(below.y, above.y), zero),
                          larger(larger(below.z, above.z), zero)};
  return dot(outside, outside);
}

uint32_t quarter_of(uint32_t count) { return (count + 3) / 4; }

// The number of nodes above `count` leaves, or other nodes.
uint32_t nodes_above(uint32_t count) {
  uint32_t nodes = 0;
  do {
    count = quarter_of(count);
    nodes += count;
  } while (count > 1);
  return nodes;
}

}  // namespace

class TriangleTree::Builder {
 public:
  explicit Builder(TriangleTree& tree) : tree_(tree) {}

  // Fills the leaves and nodes of one group. Returns its box.
  Box build_group(const float* positions, const uint32_t* triangles, uint32_t first, uint32_t last,
                  size_t group) {
    const auto corner = [&](uint32_t triangle, uint32_t k) {
      const float* p = positions + 3 * size_t(triangles[3 * size_t(triangle) + k]);
      return Vec3{p[0], p[1], p[2]};
    };
    std::vector<Vec3> centres;  // three times the centre
    for (uint32_t t = first; t < last; t++)
      centres.push_back(corner(t, 0) + corner(t, 1) + corner(t, 2));
    const Array<uint32_t> order = order_in_box(centres, kCurveCells - 1);
    const uint32_t leaf_begin = tree_.group_leaf_[group], leaf_end = tree_.group_leaf_[group + 1];
    std::vector<Child> row;
    row.reserve(leaf_end - leaf_begin);
    for (uint32_t leaf = leaf_begin; leaf < leaf_end; leaf++) {
      const Vec3 start = corner(first + order[kLanes * (leaf - leaf_begin)], 0);
      Box box{start, start};
      bool is_wide_leaf = false;
      for (uint32_t lane = 0; lane < kLanes; lane++) {
        // The last leaf repeats its last triangle.
        const size_t i = std::min<size_t>(kLanes * (leaf - leaf_begin) + lane, order.size() - 1);
        const uint32_t number = first + order[i];
        tree_.numbers_[kLanes * size_t(leaf) + lane] = number;
        const Vec3 corners[3] = {corner(number, 0), corner(number, 1), corner(number, 2)};
        is_wide_leaf |= is_wide(corners);
        for (uint32_t k = 0; k < 3; k++) {
          box.add(corners[k]);
          for (int axis = 0; axis < 3; axis++)
            tree_.leaves_[leaf].corners[3 * k + uint32_t(axis)][lane] = corners[k][axis];
        }
      }
      tree_.is_wide_[leaf] = is_wide_leaf;
      row.push_back({box, leaf | kIsLeaf});
    }
    return build_nodes(std::move(row), tree_.group_node_[group]);
  }

  // Makes nodes from number `node` on, in rows, until there is one. Returns its box.
  Box build_nodes(std::vector<Child> row, uint32_t node) {
    do {
      const uint32_t count = quarter_of(uint32_t(row.size()));
      for (uint32_t i = 0; i < count; i++, node++) {
        const size_t last = std::min(row.size(), kLanes * (size_t(i) + 1));
        row[i] = {fill(node, &row[kLanes * size_t(i)], last - kLanes * size_t(i)), node};
      }
      row.resize(count);
    } while (row.size() > 1);
    return row[0].box;
  }

 private:
  // Makes a node of up to four children. Returns its box.
  Box fill(uint32_t node, const Child* children, size_t count) {
    Box box = children[0].box;
    constexpr float far = std::numeric_limits<float>::infinity();
    for (size_t lane = 0; lane < kLanes; lane++) {
      const bool is_there = lane < count;
      const Box own = is_there ? children[lane].box : Box{{far, far, far}, {-far, -far, -far}};
      for (int axis = 0; axis < 3; axis++) {
        tree_.nodes_[node].low[axis][lane] = own.low[axis];
        tree_.nodes_[node].high[axis][lane] = own.high[axis];
      }
      tree_.nodes_[node].child[lane] = is_there ? children[lane].number : 0;
      box = {minimum(box.low, own.low), maximum(box.high, own.high)};
    }
    return box;
  }

  TriangleTree& tree_;
};

TriangleTree::TriangleTree(const float* positions, const uint32_t* triangles,
                           const std::vector<uint32_t>& group_begin, int threads)
    : group_leaf_{0}, group_node_{0} {
  const size_t groups = group_begin.size() - 1;
  for (size_t i = 0; i < groups; i++) {
    const uint32_t leaves = quarter_of(group_begin[i + 1] - group_begin[i]);
    group_leaf_.push_back(group_leaf_.back() + leaves);
    group_node_.push_back(group_node_.back() + nodes_above(leaves));
  }
  leaves_.resize(group_leaf_.back());
  is_wide_.resize(leaves_.size());
  numbers_.resize(kLanes * size_t(group_leaf_.back()));
  nodes_.resize(group_node_.back() + nodes_above(uint32_t(groups)));
  std::vector<Box> boxes(groups);
  parallel_for(threads, groups, [&](size_t i) {
    boxes[i] =
        Builder(*this).build_group(positions, triangles, group_begin[i], group_begin[i + 1], i);
  });
  std::vector<Vec3> centres;
  for (const Box& box : boxes) centres.push_back(box.low + box.high);
  std::vector<Child> row;
  for (uint32_t group : order_in_box(centres, kCurveCells - 1))
    row.push_back({boxes[group], group_root(group)});
  Builder(*this).build_nodes(std::move(row), group_node_.back());
  root_ = uint32_t(nodes_.size()) - 1;
}

float TriangleTree::nearest_in_leaf(uint32_t leaf, Vec3 point, uint32_t& place) const {
  const float (*c)[kLanes] = leaves_[leaf].corners;
  const Lanes3 at = all(point), corners[3] = {load(c), load(c + 3), load(c + 6)};
  const Lanes squared = is_wide_[leaf] ? triangles_squared(widened(at), widened(corners[0]),
                                                           widened(corners[1]), widened(corners[2]))
                                       : triangles_squared(at, corners[0], corners[1], corners[2]);
  float best = squared[0];
  uint32_t lane = 0;
  for (uint32_t i = 1; i < kLanes; i++)
    if (squared[i] < best) best = squared[i], lane = i;
  place = kLanes * leaf + lane;
  return best;
}

float TriangleTree::squared_distance(Vec3 point, uint32_t& hint, float enough) const {
  const float best = nearest_in_leaf(hint / kLanes, point, hint);
  if (best <= enough) return best;
  // Most points are near the group of the point before, or near enough to it.
  const auto after = std::upper_bound(group_leaf_.begin(), group_leaf_.end(), hint / kLanes);
  const size_t group = size_t(after - group_leaf_.begin()) - 1;
  const float own = search(group_root(group), kNone, point, hint, best, enough);
  return search(root_, group_root(group), point, hint, own, enough);
}

float TriangleTree::squared_distance_to_group(size_t group, Vec3 point, uint32_t& hint,
                                              float enough) const {
  const float best = nearest_in_leaf(hint / kLanes, point, hint);
  return search(group_root(group), kNone, point, hint, best, enough);
}

float TriangleTree::squared_distance_beyond(size_t group, float own, Vec3 point, uint32_t hint,
                                            float enough) const {
  return search(root_, group_root(group), point, hint, own, enough);
}

float TriangleTree::search(uint32_t root, uint32_t without, Vec3 point, uint32_t& hint, float best,
                           float enough) const {
  struct Entry {
    float bound;
    uint32_t number;
  } stack[kStack];
  int size = 0;
  stack[size++] = {0, root};
  const Lanes3 p = all(point);
  while (size > 0 && best > enough) {
    const Entry entry = stack[--size];
    if (entry.bound >= best || entry.number == without) continue;
    if (entry.number & kIsLeaf) {
      const uint32_t leaf = entry.number & ~kIsLeaf;
      if (leaf == hint / kLanes) continue;  // `best` is from there
      uint32_t place;
      const float found = nearest_in_leaf(leaf, point, place);
      if (found < best) best = found, hint = place;
      continue;
    }
    const Node& node = nodes_[entry.number];
    const Lanes bounds = boxes_squared(p, load(node.low), load(node.high));
    // Without branches: which children are near enough is hard to predict.
    int nearest = size, count = size;
    float least = std::numeric_limits<float>::infinity();
    for (uint32_t i = 0; i < kLanes; i++) {
      stack[count] = {bounds[i], node.child[i]};
      nearest = bounds[i] < least ? count : nearest;
      least = bounds[i] < least ? bounds[i] : least;
      count += bounds[i] < best;
    }
    if (count > size) std::swap(stack[nearest], stack[count - 1]);
    size = count;
  }
  return best;
}

}  // namespace gltf_meshlet_codec

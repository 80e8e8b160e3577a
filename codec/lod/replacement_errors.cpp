#include "lod/replacement_errors.h"

#include <algorithm>
#include <cmath>

#include "common/hash_map.h"
#include "common/parallel.h"

namespace meshlet {
namespace {

// Vertices that go on to the next level, at most: of a group (a quarter of those of level 0), or of
// few groups together.
constexpr size_t kCarried = 512, kCarriedOfAll = 16384;

// A set of numbers, none of them ~0.
class NumberSet {
 public:
  // For at most `count` numbers.
  explicit NumberSet(size_t count) : map_(count) {}
  // Returns whether the number is new.
  bool insert(uint64_t number) { return map_.insert(number, 0).second; }

 private:
  HashMap<uint64_t, uint8_t> map_;
};

// The triangles of one group.
struct GroupCorners {
  const uint32_t* corners;
  size_t count;  // of corners

  GroupCorners(const GroupTriangles& all, size_t group)
      : corners(all.triangles + 3 * size_t(all.begin[group])),
        count(3 * size_t(all.begin[group + 1] - all.begin[group])) {}
};

Vec3 point_of(const float* positions, uint32_t vertex) {
  const float* p = positions + 3 * size_t(vertex);
  return {p[0], p[1], p[2]};
}

// Appends the vertices of `before` that `after` lacks, in the order of the triangles: neighbours
// follow each other.
void add_removed(const GroupCorners& before, const GroupCorners& after,
                 std::vector<uint32_t>& vertices) {
  NumberSet done(before.count / 2 + after.count);  // triangles share most vertices
  for (size_t i = 0; i < after.count; i++) done.insert(after.corners[i]);
  for (size_t i = 0; i < before.count; i++)
    if (done.insert(before.corners[i])) vertices.push_back(before.corners[i]);
}

// Centres of triangles, each followed by middles of those of its edges that were not there yet.
std::vector<Vec3> middles(const float* positions, const GroupCorners& triangles) {
  NumberSet edges(triangles.count);
  std::vector<Vec3> points;
  for (size_t t = 0; t < triangles.count; t += 3) {
    const uint32_t* v = triangles.corners + t;
    Vec3 corner[3];
    for (size_t k = 0; k < 3; k++) corner[k] = point_of(positions, v[k]);
    points.push_back((corner[0] + corner[1] + corner[2]) * (1.0f / 3.0f));
    for (size_t k = 0; k < 3; k++) {
      const uint64_t a = v[k], b = v[(k + 1) % 3];
      if (edges.insert(std::min(a, b) << 32 | std::max(a, b)))
        points.push_back((corner[k] + corner[(k + 1) % 3]) * 0.5f);
    }
  }
  return points;
}

// Vertices of one group.
struct Carried {
  std::vector<uint32_t> vertices, triangles;
};

// The replacement of a group, among those of its level.
struct Replacement {
  const TriangleTree& level;
  uint32_t group;

  // Raises `least`, a squared distance, to that of the vertex that is farthest from the level.
  // Finds the group's nearest triangle for at most `count` of the vertices, evenly spread.
  Carried carry_on(const std::vector<uint32_t>& vertices, size_t count, const float* positions,
                   float& least) const {
    const size_t stride = (vertices.size() + count - 1) / count;
    Carried carried;
    uint32_t place = level.place_in_group(group);
    for (size_t i = 0; i < vertices.size(); i++) {
      const Vec3 point = point_of(positions, vertices[i]);
      const bool is_carried = i % stride == 0;
      const float enough = is_carried ? 0 : least;
      const float own = level.squared_distance_to_group(group, point, place, enough);
      uint32_t other = place;  // the group's own triangles are nearest as a rule
      if (own > least) least = std::max(least, level.squared_distance(point, other, least));
      if (!is_carried) continue;
      carried.vertices.push_back(vertices[i]);
      carried.triangles.push_back(level.number(place));
    }
    return carried;
  }
};

// Raises `least`, a squared distance, to that of the farthest point. Most points are known to be
// nearer than the farthest so far after a triangle or two.
float farthest(const std::vector<Vec3>& points, const TriangleTree& to, float least) {
  uint32_t place = 0;
  for (const Vec3& point : points)
    least = std::max(least, to.squared_distance(point, place, least));
  return least;
}

}  // namespace

ReplacementErrors::ReplacementErrors(std::vector<const float*> shapes,
                                     const GroupTriangles& level_0, int threads)
    : shapes_(std::move(shapes)) {
  for (const float* positions : shapes_)
    level_0_.emplace_back(positions, level_0.triangles, level_0.begin, threads);
}

std::vector<float> ReplacementErrors::measure(const GroupTriangles& before,
                                              const GroupTriangles& after,
                                              const std::vector<uint32_t>& chosen,
                                              CarriedVertices& carried, int threads) const {
  std::vector<float> squared(chosen.size());
  std::vector<Carried> next(chosen.size());
  const size_t most_carried = std::max(kCarried, kCarriedOfAll / before.groups());
  for (size_t s = 0; s < shapes_.size(); s++) {
    const TriangleTree level(shapes_[s], after.triangles, after.begin, threads);
    parallel_for(threads, chosen.size(), [&](size_t i) {
      const GroupCorners was(before, chosen[i]), is(after, chosen[i]);
      std::vector<uint32_t> vertices(carried.vertices.begin() + carried.begin[i],
                                     carried.vertices.begin() + carried.begin[i + 1]);
      add_removed(was, is, vertices);
      const Replacement replacement{level, chosen[i]};
      Carried on = replacement.carry_on(vertices, most_carried, shapes_[s], squared[i]);
      if (s == 0) next[i] = std::move(on);
      squared[i] = farthest(middles(shapes_[s], is), level_0_[s], squared[i]);
    });
  }
  carried = {{}, {}, {0}};
  for (const Carried& group : next) {
    carried.vertices.insert(carried.vertices.end(), group.vertices.begin(), group.vertices.end());
    carried.triangles.insert(carried.triangles.end(), group.triangles.begin(),
                             group.triangles.end());
    carried.begin.push_back(uint32_t(carried.vertices.size()));
  }
  for (float& distance : squared) distance = std::sqrt(distance);
  return squared;
}

}  // namespace meshlet

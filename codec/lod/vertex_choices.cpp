#include "lod/vertex_choices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/parallel.h"
#include "lod/nearest_weights.h"

namespace gltf_meshlet_codec {
namespace {

// Corners are compared with level 0 at the middle of their triangle: at a corner itself, all sides
// of a seam or a hard edge are equally near.
constexpr double kNormalWeight = 0.25;  // beside other values, in a box of size 1
constexpr double kFlipped = 10;  // cost of a normal against the triangle: more than all others
// A triangle goes to the side of a seam that its middle is nearest to if its corners then are
// nearer to what level 0 has there by this factor, all three: corners on two sides would stretch a
// texture.
constexpr double kOtherSide = 0.5;
// Another vertex must be better than this: as five degrees between normals. Otherwise corners of
// triangles that are neighbours would part for nothing.
constexpr double kChange = 0.0005;
constexpr double kSpare = 5;    // cost of a vertex that level 0 joins with another
constexpr double kOutside = 2;  // errors of the surface that a point outside is away
constexpr size_t kAtOnce = 1024;

using Corners = std::array<Vec3d, 3>;

Corners corners_of(const float* points, const uint32_t* triangle) {
  return {vec3d_at(points, triangle[0]), vec3d_at(points, triangle[1]),
          vec3d_at(points, triangle[2])};
}

Vec3d face_normal(const Corners& c) { return unit(cross(c[1] - c[0], c[2] - c[0])); }

Vec3 rounded(Vec3d p) { return {float(p.x), float(p.y), float(p.z)}; }

// What level 0 has near a triangle of a replacement.
struct Target {
  Vec3d face;                  // the triangle's normal
  Vec3d normal;                // of level 0, or `face` where all of level 0 there faces away
  bool is_away;                // does level 0 face away?
  std::vector<double> others;  // of level 0
};

class Chooser {
 public:
  Chooser(const VertexChoices& choices, const float* points, const NearestTriangles& nearest)
      : choices_(choices), points_(points), nearest_(nearest) {}

  // Returns what level 0 has near triangles. A thin part has two sides: where the nearest one faces
  // away, the side that is nearest to a point outside counts.
  std::vector<Target> targets(const std::vector<uint32_t>& triangles,
                              const std::vector<double>& errors) const {
    std::vector<Target> targets(errors.size());
    std::vector<Vec3d> middles;
    std::vector<Vec3> places;
    for (size_t t = 0; t < errors.size(); t++) {
      const Corners corners = corners_of(points_, &triangles[3 * t]);
      targets[t].face = face_normal(corners);
      middles.push_back((corners[0] + corners[1] + corners[2]) / 3);
      places.push_back(rounded(middles[t]));
    }
    std::vector<uint32_t> level_0 = nearest_(places);
    std::vector<size_t> away;
    places.clear();
    for (size_t t = 0; t < errors.size(); t++) {
      if (!faces_away(&level_0[3 * t], targets[t].face)) continue;
      away.push_back(t);
      places.push_back(rounded(middles[t] + targets[t].face * (kOutside * errors[t])));
    }
    const std::vector<uint32_t> outside = nearest_(places);
    for (size_t i = 0; i < away.size(); i++) std::copy_n(&outside[3 * i], 3, &level_0[3 * away[i]]);
    for (size_t t = 0; t < errors.size(); t++) fill(targets[t], middles[t], &level_0[3 * t]);
    return targets;
  }

  // Gives a triangle the vertices that fit it best.
  void choose(const Target& target, uint32_t* triangle) const {
    uint32_t sides[3] = {triangle[0], triangle[1], triangle[2]};
    if (choices_.other_count && !target.is_away) {
      for (uint32_t& side : sides)
        side = best(side, [&](uint32_t v) { return squared_to(target.others, v); });
      if (!(farthest(target.others, sides) < kOtherSide * farthest(target.others, triangle)))
        std::copy_n(triangle, 3, sides);
    }
    for (int k = 0; k < 3; k++) {
      const uint32_t corner = triangle[k];
      triangle[k] = best(corner, [&](uint32_t v) { return cost(target, v, corner, sides[k]); });
    }
  }

 private:
  bool faces_away(const uint32_t* level_0, Vec3d face) const {
    return dot(face_normal(corners_of(points_, level_0)), face) < 0;
  }

  void fill(Target& target, Vec3d middle, const uint32_t* level_0) const {
    target.is_away = faces_away(level_0, target.face);
    const std::array<double, 3> w = nearest_weights(middle, corners_of(points_, level_0));
    const Corners normals = corners_of(choices_.normals, level_0);
    target.normal = target.is_away
                        ? target.face
                        : unit(normals[0] * w[0] + normals[1] * w[1] + normals[2] * w[2]);
    for (size_t i = 0; i < choices_.other_count; i++) {
      double sum = 0;
      for (size_t k = 0; k < 3; k++) sum += w[k] * double(others(level_0[k])[i]);
      target.others.push_back(sum);
    }
  }

  const float* others(uint32_t vertex) const {
    return choices_.others + choices_.other_count * size_t(vertex);
  }

  double squared_to(const std::vector<double>& values, uint32_t vertex) const {
    double sum = 0;
    for (size_t i = 0; i < values.size(); i++) {
      const double off = double(others(vertex)[i]) - values[i];
      sum += off * off;
    }
    return sum;
  }

  // The largest difference between values and those of three vertices.
  double farthest(const std::vector<double>& values, const uint32_t* vertices) const {
    double most = 0;
    for (size_t k = 0; k < 3; k++)
      for (size_t i = 0; i < values.size(); i++)
        most = std::max(most, std::fabs(double(others(vertices[k])[i]) - values[i]));
    return most;
  }

  // What it costs that a corner becomes vertex v. side: the vertex with the wanted other values.
  double cost(const Target& target, uint32_t v, uint32_t corner, uint32_t side) const {
    const Vec3d normal = vec3d_at(choices_.normals, v);
    const Vec3d off = normal - target.normal;
    float other = 0;
    for (size_t i = 0; i < choices_.other_count; i++) {
      const float apart = others(v)[i] - others(side)[i];
      other += apart * apart;
    }
    double cost = kNormalWeight * kNormalWeight * dot(off, off) + double(other);
    if (dot(normal, target.face) < 0) cost += kFlipped;
    if (choices_.canonical_vertices[v] != v) cost += kSpare;
    if (v == corner) cost -= kChange;
    return cost;
  }

  // The cheapest vertex at the place of a corner, the first of several; the corner if there is
  // none.
  template <class Cost>
  uint32_t best(uint32_t corner, const Cost& cost) const {
    const uint32_t place = choices_.places[corner];
    uint32_t best = corner;
    double least = std::numeric_limits<double>::infinity();
    for (uint32_t i = choices_.begin[place]; i < choices_.begin[place + 1]; i++) {
      const double c = cost(choices_.vertices[i]);
      if (c < least) least = c, best = choices_.vertices[i];
    }
    return best;
  }

  const VertexChoices& choices_;
  const float* points_;
  const NearestTriangles& nearest_;
};

}  // namespace

void VertexChoices::fill(const uint32_t* corners, size_t corner_count, size_t vertex_count) {
  std::vector<bool> occurs(vertex_count);
  for (size_t i = 0; i < corner_count; i++) occurs[corners[i]] = true;
  begin.assign(vertex_count + 1, 0);  // more than there are places
  for (size_t v = 0; v < vertex_count; v++) begin[places[v] + 1] += occurs[v];
  for (size_t p = 0; p < vertex_count; p++) begin[p + 1] += begin[p];
  std::vector<uint32_t> next(begin);
  vertices.resize(begin.back());
  place_normals.resize(3 * vertices.size());
  for (size_t v = 0; v < vertex_count; v++) {
    if (!occurs[v]) continue;
    const size_t i = next[places[v]]++;
    vertices[i] = uint32_t(v);
    std::copy_n(normals + 3 * v, 3, &place_normals[3 * i]);
  }
}

void choose_vertices(const VertexChoices& choices, const float* points,
                     const std::vector<double>& errors, const NearestTriangles& nearest,
                     int threads, std::vector<uint32_t>& triangles) {
  std::vector<size_t> open;  // triangles with a choice
  std::vector<uint32_t> corners;
  std::vector<double> open_errors;
  for (size_t t = 0; t < errors.size(); t++) {
    const uint32_t* v = &triangles[3 * t];
    if (choices.count_at(v[0]) < 2 && choices.count_at(v[1]) < 2 && choices.count_at(v[2]) < 2)
      continue;
    open.push_back(t);
    corners.insert(corners.end(), v, v + 3);
    open_errors.push_back(errors[t]);
  }
  if (open.empty()) return;
  const Chooser chooser(choices, points, nearest);
  const std::vector<Target> targets = chooser.targets(corners, open_errors);
  for_blocks(threads, open.size(), kAtOnce, [&](size_t, size_t first, size_t last) {
    for (size_t i = first; i < last; i++) chooser.choose(targets[i], &triangles[3 * open[i]]);
  });
}

}  // namespace gltf_meshlet_codec

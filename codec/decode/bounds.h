// A sphere and a cone of normals around a meshlet.
#pragma once
#include <cmath>
#include <cstdint>

#include "format/constants.h"

namespace gltf_meshlet_codec {

// Seen from `eye`, all triangles face away, and the meshlet can be skipped, if
// dot(centre - eye, axis) >= cutoff * length(centre - eye) + radius. cutoff 1: never.
struct MeshletBounds {
  float centre[3], radius, axis[3], cutoff;
};

// Bounds of at most 64 vertices, in double, then rounded outwards.
class BoundsOf {
  static constexpr float kLargestFloat = 3.4028234663852886e38f, kLeastFloat = 1.17549435e-38f;

 public:
  // positions: three floats each, finite or not. triangles: three local numbers in 24 bits.
  BoundsOf(const float* positions, uint32_t vertices, const uint32_t* triangles, uint32_t count)
      : positions_(positions), vertices_(vertices), triangles_(triangles), count_(count) {}

  MeshletBounds bounds() const {
    MeshletBounds out{{0, 0, 0}, HUGE_VALF, {0, 0, 1}, 1};
    if (!are_finite()) return out;
    set_sphere(out);
    set_cone(out);
    return out;
  }

 private:
  struct Point {
    double x, y, z;
  };
  static Point minus(Point a, Point b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  static double dot(Point a, Point b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
  static Point times(Point a, double f) { return {a.x * f, a.y * f, a.z * f}; }
  static Point cross(Point a, Point b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  }

  Point point(uint32_t v) const {
    const float* p = positions_ + 3 * v;
    return {double(p[0]), double(p[1]), double(p[2])};
  }

  bool are_finite() const {
    for (uint32_t i = 0; i < 3 * vertices_; i++)
      if (!(std::fabs(positions_[i]) <= kLargestFloat)) return false;
    return true;
  }

  uint32_t farthest(Point from) const {
    uint32_t best = 0;
    double most = -1;
    for (uint32_t v = 0; v < vertices_; v++) {
      const Point d = minus(point(v), from);
      if (dot(d, d) > most) most = dot(d, d), best = v;
    }
    return best;
  }

  // A sphere around two vertices that are far apart, which moves to each that is outside of it.
  Point grown_centre() const {
    const Point a = point(farthest(point(0)));
    const Point b = point(farthest(a));
    Point centre = times({a.x + b.x, a.y + b.y, a.z + b.z}, 0.5);
    Point half = minus(b, centre);
    double radius = std::sqrt(dot(half, half));
    for (uint32_t v = 0; v < vertices_; v++) {
      const Point d = minus(point(v), centre);
      const double distance = std::sqrt(dot(d, d));
      if (!(distance > radius)) continue;
      const double share = (distance - radius) / (2 * distance);
      centre = {centre.x + d.x * share, centre.y + d.y * share, centre.z + d.z * share};
      radius = (radius + distance) / 2;
    }
    return centre;
  }

  Point box_centre() const {
    Point low = point(0), high = low;
    for (uint32_t v = 1; v < vertices_; v++) {
      const Point p = point(v);
      low = {p.x < low.x ? p.x : low.x, p.y < low.y ? p.y : low.y, p.z < low.z ? p.z : low.z};
      high = {p.x > high.x ? p.x : high.x, p.y > high.y ? p.y : high.y,
              p.z > high.z ? p.z : high.z};
    }
    return times({low.x + high.x, low.y + high.y, low.z + high.z}, 0.5);
  }

  // The smaller one of two, around a centre that is rounded first.
  void set_sphere(MeshletBounds& out) const {
    out.radius = HUGE_VALF;
    const Point centres[2] = {box_centre(), grown_centre()};
    for (const Point centre : centres) {
      const float rounded[3] = {float(centre.x), float(centre.y), float(centre.z)};
      const Point at = {double(rounded[0]), double(rounded[1]), double(rounded[2])};
      const Point d = minus(point(farthest(at)), at);
      const float radius = above(std::sqrt(dot(d, d)));
      if (!(radius < out.radius)) continue;
      out.radius = radius;
      for (int k = 0; k < 3; k++) out.centre[k] = rounded[k];
    }
  }

  // A float that is larger, so that what readers compute in floats holds.
  static float above(double x) { return x == 0 ? 0.0f : float(x * (1 + 4e-7)) + kLeastFloat; }

  // Returns false for a triangle without an area.
  bool normal(uint32_t t, Point& out) const {
    const uint32_t word = triangles_[t];
    const Point a = point(word & 255u), b = point(word >> 8 & 255u), c = point(word >> 16 & 255u);
    const Point n = cross(minus(b, a), minus(c, a));
    const double length = std::sqrt(dot(n, n));
    if (!(length > 0)) return false;
    out = times(n, 1 / length);
    return true;
  }

  void set_cone(MeshletBounds& out) const {
    Point sum = {0, 0, 0}, n;
    for (uint32_t t = 0; t < count_; t++)
      if (normal(t, n)) sum = {sum.x + n.x, sum.y + n.y, sum.z + n.z};
    const double length = std::sqrt(dot(sum, sum));
    if (!(length > 0)) return;
    sum = times(sum, 1 / length);
    const float axis[3] = {float(sum.x), float(sum.y), float(sum.z)};
    const Point mean = {double(axis[0]), double(axis[1]), double(axis[2])};
    double least = 1;
    for (uint32_t t = 0; t < count_; t++)
      if (normal(t, n) && dot(mean, n) < least) least = dot(mean, n);
    for (int k = 0; k < 3; k++) out.axis[k] = axis[k];
    // The sine of the widest angle, and a little for the rounding of the axis.
    const double sine = std::sqrt(1 - least * least) + 1e-6;
    if (least > 0 && sine < 1) out.cutoff = float(sine);
  }

  const float* positions_;
  uint32_t vertices_;
  const uint32_t* triangles_;
  uint32_t count_;
};

}  // namespace gltf_meshlet_codec

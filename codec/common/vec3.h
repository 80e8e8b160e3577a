// Vectors of three floats, for the codec and the Mitsuba plugin.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace gltf_meshlet_codec {

struct Vec3 {
  float x, y, z;

  float operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  float& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
};

inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vec3 minimum(Vec3 a, Vec3 b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
inline Vec3 maximum(Vec3 a, Vec3 b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
inline float length(Vec3 a) { return std::sqrt(dot(a, a)); }

// Returns a unit vector, or `a` itself if its length is 0.
inline Vec3 normalized(Vec3 a) {
  const float norm = length(a);
  return norm > 0 ? a * (1.0f / norm) : a;
}

struct Box {
  Vec3 low, high;

  void add(Vec3 point) { low = minimum(low, point), high = maximum(high, point); }
  float longest_side() const { return std::max({high.x - low.x, high.y - low.y, high.z - low.z}); }
};

// Returns the box of at least one point.
inline Box box_of(const std::vector<Vec3>& points) {
  Box box{points[0], points[0]};
  for (const Vec3& point : points) box.add(point);
  return box;
}

}  // namespace gltf_meshlet_codec

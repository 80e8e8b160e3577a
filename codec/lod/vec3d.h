// Vectors of three doubles.
#pragma once
#include <algorithm>
#include <cmath>

namespace gltf_meshlet_codec {

struct Vec3d {
  double x, y, z;
};

inline Vec3d operator+(Vec3d a, Vec3d b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3d operator-(Vec3d a, Vec3d b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3d operator*(Vec3d a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vec3d operator/(Vec3d a, double s) { return {a.x / s, a.y / s, a.z / s}; }
inline double dot(Vec3d a, Vec3d b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3d cross(Vec3d a, Vec3d b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vec3d a) { return std::sqrt(dot(a, a)); }
inline Vec3d minimum(Vec3d a, Vec3d b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
inline Vec3d maximum(Vec3d a, Vec3d b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

// Returns a vector of length one; zeros stay.
inline Vec3d unit(Vec3d a) {
  const double norm = length(a);
  return norm > 0 ? a / norm : a;
}

// Item i of three floats each.
inline Vec3d vec3d_at(const float* list, size_t i) {
  const float* p = list + 3 * i;
  return {double(p[0]), double(p[1]), double(p[2])};
}

}  // namespace gltf_meshlet_codec

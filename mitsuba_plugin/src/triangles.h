// The triangles of one decoded meshlet in the layout that rays are tested against: groups of eight, each behind its own box.
//
// The groups are simply every eight triangles that follow one another: the traversal that Edgebreaker stores them in keeps close together
// what is close. Sorting them by place before saved 2 % of the tests and cost a fifth of the decoding.
#pragma once
#include <immintrin.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace meshlet_shape {

constexpr uint32_t kMeshletTriangles = 64;
constexpr uint32_t kLanes = 8;                                  // triangles of a group, groups of a meshlet
constexpr uint32_t kMaxGroups = kMeshletTriangles / kLanes;

struct Vector3 {
  float v[3];
  float operator[](int i) const { return v[i]; }
  float& operator[](int i) { return v[i]; }
};

struct Ray {
  Vector3 o, d;
  float t_max;
};

// b1, b2: barycentric weights of the triangle's second and third vertex; triangle: its number in the meshlet.
struct Hit {
  float t, b1, b2;
  uint32_t triangle;
};

// A ray, with what testing boxes needs of it.
struct PreparedRay {
  explicit PreparedRay(const Ray& ray) : PreparedRay(ray, {{1.0f / ray.d[0], 1.0f / ray.d[1], 1.0f / ray.d[2]}}) {}
  PreparedRay(const Ray& ray, const Vector3& inverse) : o(ray.o), d(ray.d), inverse_d(inverse), t_max(ray.t_max) {}

  Vector3 o, d, inverse_d;
  float t_max;
};

// The box of a meshlet and those of its groups, on a grid of 255 steps over the meshlet's. Not decoded geometry but part of the
// acceleration structure: always there, so that most rays that miss a meshlet need not decode it.
struct Boxes {
  float origin[3], step[3];
  uint8_t side[2][3][kMaxGroups];                               // [lower, upper][axis][group]
  uint8_t groups;

  float bound(bool upper_end, int axis) const { return upper_end ? origin[axis] + 255.0f * step[axis] : origin[axis]; }

  // The groups whose boxes the ray meets before t_max, as bits; enter[group]: where.
  uint32_t met_by(const PreparedRay& ray, float (&enter)[kMaxGroups]) const;
};

// Inline, as most of what a ray does; a multiplication never meets an addition here that the compiler could contract it with.
inline uint32_t Boxes::met_by(const PreparedRay& r, float (&enter)[kMaxGroups]) const {
  // Upper bound of the relative error of a slab's distance, (1 + 2 gamma(3)) in the notation of Pharr, Jakob, Humphreys.
  constexpr float kSlabMargin = 1.0f + 8 * std::numeric_limits<float>::epsilon();
  auto planes = [](const uint8_t* bytes, float step, float origin) {
    __m256 place = _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(bytes))));
    return _mm256_fmadd_ps(place, _mm256_set1_ps(step), _mm256_set1_ps(origin));
  };
  __m256 near = _mm256_setzero_ps(), far = _mm256_set1_ps(r.t_max);
  for (int i = 0; i < 3; i++) {
    const bool negative = std::signbit(r.inverse_d[i]);
    const __m256 o = _mm256_set1_ps(r.o[i]), inverse = _mm256_set1_ps(r.inverse_d[i]);
    __m256 first = _mm256_mul_ps(_mm256_sub_ps(planes(side[negative][i], step[i], origin[i]), o), inverse);
    __m256 second = _mm256_mul_ps(_mm256_sub_ps(planes(side[!negative][i], step[i], origin[i]), o), inverse);
    // The second operand wins over NaN, which a ray within a slab's plane gives.
    near = _mm256_max_ps(first, near);
    far = _mm256_min_ps(_mm256_mul_ps(second, _mm256_set1_ps(kSlabMargin)), far);
  }
  _mm256_storeu_ps(enter, near);
  return uint32_t(_mm256_movemask_ps(_mm256_cmp_ps(near, far, _CMP_LE_OQ))) & ((1u << groups) - 1u);
}

struct alignas(32) TriangleGroup {
  float vertex[3][3][kLanes];                                   // [corner][axis][triangle]
};

// A header, followed in memory by its groups.
struct alignas(32) Triangles {
  uint32_t count;

  static uint32_t groups(uint32_t triangles) { return (triangles + kLanes - 1) / kLanes; }
  static size_t bytes(uint32_t triangles) { return sizeof(Triangles) + groups(triangles) * sizeof(TriangleGroup); }

  TriangleGroup* group() { return reinterpret_cast<TriangleGroup*>(this + 1); }
  const TriangleGroup* group() const { return reinterpret_cast<const TriangleGroup*>(this + 1); }

  // position[axis][id], corner[k][t]: the meshlet's vertices, and which of them triangle t has.
  void build(const float (*position)[kMeshletTriangles], const uint8_t (*corner)[kMeshletTriangles], uint32_t count);

  // Boxes that hold the triangles with `margin` to spare.
  Boxes boxes(float margin) const;

  Vector3 corner(uint32_t triangle, int k) const;

  // Nearest hit with 0 < t < ray.t_max in these groups, from either side. No ray that crosses the edge between two triangles with
  // equal vertices passes between them.
  bool intersect(const PreparedRay& ray, uint32_t groups, const float (&enter)[kMaxGroups], Hit& hit) const;
  bool occludes(const PreparedRay& ray, uint32_t groups) const;
};

}  // namespace meshlet_shape

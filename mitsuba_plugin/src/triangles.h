// The triangles of one decoded meshlet in the layout that rays are tested against: groups of eight,
// each behind its own box.
//
// The groups are simply every eight triangles that follow one another: the traversal that
// Edgebreaker stores them in keeps close together what is close. Sorting them by place before saved
// 2 % of the tests and cost a fifth of the decoding.
#pragma once
#include <immintrin.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace meshlet_shape {

constexpr uint32_t kMeshletTriangles = 64;
constexpr uint32_t kLanes = 8;  // triangles of a group, groups of a meshlet
constexpr uint32_t kMaxGroups = kMeshletTriangles / kLanes;

struct Vector3 {
  float v[3];
  float operator[](int i) const { return v[i]; }
  float& operator[](int i) { return v[i]; }
};

// Upper bound of the relative error of a slab's distance, (1 + 2 gamma(3)) in the notation of
// Pharr, Jakob, Humphreys.
constexpr float kSlabMargin = 1.0f + 8 * std::numeric_limits<float>::epsilon();
// In place of smaller components of directions, so that no distance is infinity times zero.
constexpr float kLeastDirection = 1e-18f;

// Up to N rays, in the layout that they come in from Embree: those with a bit in `active` are
// traced.
template <int N>
struct Rays {
  alignas(4 * N) float o[3][N], d[3][N], t_max[N];
  uint32_t active;
};

// b1, b2: barycentric weights of the triangle's second and third vertex; triangle: its number in
// the meshlet.
struct Hit {
  float t, b1, b2;
  uint32_t triangle;
};

template <int N>
struct Hits {
  Hit of[N];
  uint32_t found = 0;  // the rays that hit, as bits
};

// Which groups of a meshlet rays meet: bits of groups, and where they are entered.
template <int N>
struct Meetings {
  alignas(32) float enter[N][kMaxGroups];
  uint32_t groups[N];
  uint32_t any = 0;  // the rays that meet some group, as bits
};

// The box of a meshlet and those of its groups, on a grid of 255 steps over the meshlet's. Not
// decoded geometry but part of the acceleration structure: always there, so that most rays that
// miss a meshlet need not decode it.
struct Boxes {
  float origin[3], step[3];
  uint8_t side[2][3][kMaxGroups];  // [lower, upper][axis][group]
  uint8_t groups;

  float bound(bool upper_end, int axis) const {
    return upper_end ? origin[axis] + 255.0f * step[axis] : origin[axis];
  }

  // The groups whose boxes the rays meet before t_max.
  template <int N>
  void meet(const Rays<N>& rays, Meetings<N>& meetings) const;
};

// The lowest ray of some, as bits.
template <int N>
int lane_of(uint32_t rays) {
  return N > 1 ? __builtin_ctz(rays) : 0;
}

// Inline, as most of what a ray does; a multiplication never meets an addition here that the
// compiler could contract it with.
template <int N>
inline void Boxes::meet(const Rays<N>& rays, Meetings<N>& meetings) const {
  auto decoded = [&](bool upper, int axis) {
    return _mm256_cvtepi32_ps(
        _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(side[upper][axis]))));
  };
  __m256 plane[2][3];                              // where several rays share the work
  alignas(4 * N) float scale[3][N], offset[3][N];  // plane q of the grid is q * scale + offset away
  for (int i = 0; i < 3; i++) {
    for (int s = 0; N > 1 && s < 2; s++) plane[s][i] = decoded(s, i);
    for (int l = 0; l < N; l++) {
      float d = rays.d[i][l];
      // Alone, a ray stays in scalar registers: vectors of its axes would wait for the narrower
      // stores that they are loaded from.
      if (N == 1) __asm__("" : "+x"(d));
      const float inverse =
          1.0f / (std::fabs(d) < kLeastDirection ? std::copysign(kLeastDirection, d) : d);
      scale[i][l] = step[i] * inverse;
      offset[i][l] = (origin[i] - rays.o[i][l]) * inverse;
    }
  }
  for (uint32_t rest = rays.active; rest; rest &= rest - 1) {
    const int l = lane_of<N>(rest);
    __m256 near = _mm256_setzero_ps(), far = _mm256_set1_ps(rays.t_max[l]);
    for (int i = 0; i < 3; i++) {
      const bool negative = std::signbit(scale[i][l]);
      const __m256 s = _mm256_set1_ps(scale[i][l]), o = _mm256_set1_ps(offset[i][l]);
      near = _mm256_max_ps(_mm256_fmadd_ps(N > 1 ? plane[negative][i] : decoded(negative, i), s, o),
                           near);
      far = _mm256_min_ps(
          _mm256_fmadd_ps(N > 1 ? plane[!negative][i] : decoded(!negative, i), s, o), far);
    }
    far = _mm256_mul_ps(far, _mm256_set1_ps(kSlabMargin));
    _mm256_store_ps(meetings.enter[l], near);
    meetings.groups[l] =
        uint32_t(_mm256_movemask_ps(_mm256_cmp_ps(near, far, _CMP_LE_OQ))) & ((1u << groups) - 1u);
    meetings.any |= uint32_t(meetings.groups[l] != 0) << l;
  }
}

struct alignas(32) TriangleGroup {
  float vertex[3][3][kLanes];  // [corner][axis][triangle]
};

// A header, followed in memory by its groups.
struct alignas(32) Triangles {
  uint32_t count;

  static uint32_t groups(uint32_t triangles) { return (triangles + kLanes - 1) / kLanes; }
  static size_t bytes(uint32_t triangles) {
    return sizeof(Triangles) + groups(triangles) * sizeof(TriangleGroup);
  }

  TriangleGroup* group() { return reinterpret_cast<TriangleGroup*>(this + 1); }
  const TriangleGroup* group() const { return reinterpret_cast<const TriangleGroup*>(this + 1); }

  // position[axis][id], corner[k][t]: the meshlet's vertices, and which of them triangle t has.
  void build(const float (*position)[kMeshletTriangles], const uint8_t (*corner)[kMeshletTriangles],
             uint32_t count);

  // Boxes that hold the triangles with `margin` to spare.
  Boxes boxes(float margin) const;

  Vector3 corner(uint32_t triangle, int k) const;

  // Nearest hits with 0 < t < t_max in the groups that the rays meet, from either side. No ray that
  // crosses the edge between two triangles with equal vertices passes between them.
  template <int N>
  void intersect(const Rays<N>& rays, const Meetings<N>& meetings, Hits<N>& hits) const;
  // The rays that hit anything there, as bits.
  template <int N>
  uint32_t occlude(const Rays<N>& rays, const Meetings<N>& meetings) const;
};

}  // namespace meshlet_shape

// The triangles of a decoded meshlet in the layout for ray tests: groups of eight, each with a box.
//
// A group is eight consecutive triangles: Edgebreaker's traversal order keeps neighbours together.
// Sorting the triangles by position saved 2 % of the ray tests and slowed decoding by 20 %.
#pragma once
#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "common/vec3.h"
#include "format/constants.h"

namespace meshlet_shape {

using gltf_meshlet_codec::Vec3;

inline Vec3 load(const float* v) { return {v[0], v[1], v[2]}; }
inline void store(Vec3 v, float* out) {
  for (int i = 0; i < 3; i++) out[i] = v[i];
}

struct Box {
  float lower[3], upper[3];
};
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr Box kEmptyBox = {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};

inline void expand(Box& box, Vec3 p) {
  for (int i = 0; i < 3; i++) {
    box.lower[i] = std::min(box.lower[i], p[i]);
    box.upper[i] = std::max(box.upper[i], p[i]);
  }
}

constexpr uint32_t kMeshletTriangles = MESHLET_TRIANGLES;
constexpr uint32_t kLanes = 8;  // triangles per group, and most groups per meshlet
constexpr uint32_t kMaxGroups = kMeshletTriangles / kLanes;

// Bounds the relative error of a slab's distance: 1 + 2 gamma(3) (Pharr, Jakob, Humphreys).
constexpr float kSlabMargin = 1.0f + 8 * std::numeric_limits<float>::epsilon();
// Replaces smaller elements of directions: no distance becomes infinity times zero.
constexpr float kLeastDirection = 1e-18f;

// Up to N rays in Embree's layout. Rays with a bit in `active` are traced.
template <int N>
struct Rays {
  alignas(4 * N) float o[3][N], d[3][N], t_max[N];
  uint32_t active;
};

// b1, b2: barycentric weights of the second and third vertex. triangle: number in the meshlet.
struct Hit {
  float t, b1, b2;
  uint32_t triangle;
};

template <int N>
struct Hits {
  Hit of[N];
  uint32_t found = 0;  // mask of the rays that hit
};

// Per ray: mask of the groups of a meshlet whose boxes it meets, and its distance to them.
template <int N>
struct Meetings {
  alignas(32) float enter[N][kMaxGroups];
  uint32_t groups[N];
  uint32_t any = 0;  // mask of the rays that meet any group
};

// The bounds of a meshlet's groups.
struct GroupBounds {
  float low[3][kMaxGroups], high[3][kMaxGroups];
  uint8_t groups;
};

// The boxes of a meshlet's groups, on a grid of 255 steps over the meshlet's box: the item of
// the acceleration structure, always in memory: most rays that miss a meshlet do not decode it.
struct Boxes {
  float origin[3], step[3];
  uint8_t side[2][3][kMaxGroups];  // [lower, upper][axis][group]
  uint8_t groups;

  // Boxes around bounds, enlarged by `margin`.
  static Boxes around(const GroupBounds& bounds, float margin);

  float bound(bool upper_end, int axis) const {
    return upper_end ? origin[axis] + 255.0f * step[axis] : origin[axis];
  }

  // Finds the groups whose boxes the rays meet before t_max.
  template <int N>
  void meet(const Rays<N>& rays, Meetings<N>& meetings) const;
};

// The lowest ray of a mask.
template <int N>
int lane_of(uint32_t rays) {
  return N > 1 ? __builtin_ctz(rays) : 0;
}

// Inline: rays spend most of their time here. No product is added to anything, so the compiler has
// nothing to contract.
template <int N>
inline void Boxes::meet(const Rays<N>& rays, Meetings<N>& meetings) const {
  auto decoded = [&](bool upper, int axis) {
    return _mm256_cvtepi32_ps(
        _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(side[upper][axis]))));
  };
  __m256 plane[2][3];                              // decoded once if there are several rays
  alignas(4 * N) float scale[3][N], offset[3][N];  // plane q of the grid is q * scale + offset away
  for (int i = 0; i < 3; i++) {
    for (int s = 0; N > 1 && s < 2; s++) plane[s][i] = decoded(s, i);
    for (int l = 0; l < N; l++) {
      float d = rays.d[i][l];
      // A single ray stays in scalar registers: vector loads would stall on narrower stores.
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

  // position[axis][id]: the meshlet's vertices; corner[k][t]: vertex id of corner k of triangle t.
  void build(const float (*position)[kMeshletTriangles], const uint8_t (*corner)[kMeshletTriangles],
             uint32_t count);

  GroupBounds bounds() const;

  Vec3 corner(uint32_t triangle, int k) const;

  // Nearest hits with 0 < t < t_max, from either side, in the groups that the rays meet.
  // Watertight: no ray passes between two triangles that share an edge of equal vertices.
  template <int N>
  void intersect(const Rays<N>& rays, const Meetings<N>& meetings, Hits<N>& hits) const;
  // Mask of the rays that hit anything.
  template <int N>
  uint32_t occlude(const Rays<N>& rays, const Meetings<N>& meetings) const;
};

}  // namespace meshlet_shape

// Compiled without contraction: contracting a * b - c * d would give the two triangles at an edge
// different signs for it.
#include "triangles.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meshlet_shape {
namespace {

#define INLINE __attribute__((always_inline)) inline  // vectors as arguments must stay in registers

// Shears that make rays run along z (Woop, Benthin, Wald: Watertight Ray/Triangle Intersection,
// JCGT 2013).
template <int N>
struct Shears {
  explicit Shears(const Rays<N>& r) {
    for (int l = 0; l < N; l++) {
      const float x = r.d[0][l], y = r.d[1][l], z = r.d[2][l];
      const float ax = std::fabs(x), ay = std::fabs(y), az = std::fabs(z);
      const bool is_x = ax >= ay && ax >= az, is_y = !is_x && ay >= az;
      const float inverse = 1.0f / (is_x ? x : is_y ? y : z);
      axis[l] = is_x ? 0 : is_y ? 1 : 2;  // of the largest element
      shear[0][l] = (is_x ? y : is_y ? z : x) * inverse;
      shear[1][l] = (is_x ? z : is_y ? x : y) * inverse;
      shear[2][l] = inverse;
    }
  }

  alignas(4 * N) float shear[3][N];
  alignas(4 * N) int axis[N];
};

// One ray of a packet.
struct ShearedRay {
  template <int N>
  ShearedRay(const Rays<N>& r, const Shears<N>& s, int lane) {
    static constexpr int kTurned[3][3] = {{1, 2, 0}, {2, 0, 1}, {0, 1, 2}};
    for (int i = 0; i < 3; i++) {
      axis[i] = kTurned[s.axis[lane]][i];
      o[i] = _mm256_set1_ps(r.o[axis[i]][lane]);
      shear[i] = _mm256_set1_ps(s.shear[i][lane]);
    }
  }

  int axis[3];
  __m256 o[3], shear[3];
};

struct GroupHits {
  __m256 t, b1, b2;
  uint32_t mask;
};

// A vertex, sheared so that the ray runs along z from the origin.
struct Sheared {
  __m256 x, y, z;
};

inline Sheared shear(const float (*vertex)[kLanes], const ShearedRay& r) {
  __m256 x = _mm256_sub_ps(_mm256_load_ps(vertex[r.axis[0]]), r.o[0]);
  __m256 y = _mm256_sub_ps(_mm256_load_ps(vertex[r.axis[1]]), r.o[1]);
  __m256 z = _mm256_sub_ps(_mm256_load_ps(vertex[r.axis[2]]), r.o[2]);
  return {_mm256_fnmadd_ps(r.shear[0], z, x), _mm256_fnmadd_ps(r.shear[1], z, y),
          _mm256_mul_ps(r.shear[2], z)};
}

// Side of the directed edge p -> q that the origin is on. Rounding is monotonic: a nonzero sign is
// right, and swapping p and q negates the result exactly.
inline __m256 edge(const Sheared& p, const Sheared& q) {
  return _mm256_sub_ps(_mm256_mul_ps(q.x, p.y), _mm256_mul_ps(q.y, p.x));
}

INLINE GroupHits hit_group(const TriangleGroup& group, const ShearedRay& r, float t_max) {
  Sheared a = shear(group.vertex[0], r), b = shear(group.vertex[1], r),
          c = shear(group.vertex[2], r);
  __m256 u = edge(b, c), v = edge(c, a), w = edge(a, b), zero = _mm256_setzero_ps();
  __m256 low = _mm256_min_ps(u, _mm256_min_ps(v, w)), high = _mm256_max_ps(u, _mm256_max_ps(v, w));
  // A ray on an edge (zero) hits both triangles.
  __m256 inside =
      _mm256_or_ps(_mm256_cmp_ps(low, zero, _CMP_GE_OQ), _mm256_cmp_ps(high, zero, _CMP_LE_OQ));
  __m256 determinant = _mm256_add_ps(u, _mm256_add_ps(v, w));
  __m256 valid = _mm256_and_ps(inside, _mm256_cmp_ps(determinant, zero, _CMP_NEQ_OQ));
  if (_mm256_testz_ps(valid, valid)) return {zero, zero, zero, 0};
  __m256 inverse = _mm256_div_ps(_mm256_set1_ps(1.0f), determinant);
  __m256 t = _mm256_mul_ps(_mm256_fmadd_ps(u, a.z, _mm256_fmadd_ps(v, b.z, _mm256_mul_ps(w, c.z))),
                           inverse);
  valid = _mm256_and_ps(valid, _mm256_and_ps(_mm256_cmp_ps(t, zero, _CMP_GT_OQ),
                                             _mm256_cmp_ps(t, _mm256_set1_ps(t_max), _CMP_LT_OQ)));
  return {t, _mm256_mul_ps(v, inverse), _mm256_mul_ps(w, inverse),
          uint32_t(_mm256_movemask_ps(valid))};
}

}  // namespace

void Triangles::build(const float (*position)[kMeshletTriangles],
                      const uint8_t (*corners)[kMeshletTriangles], uint32_t triangle_count) {
  count = triangle_count;
  for (uint32_t g = 0; g < groups(count); g++)
    for (int k = 0; k < 3; k++) {
      __m256i id = _mm256_cvtepu8_epi32(
          _mm_loadl_epi64(reinterpret_cast<const __m128i*>(corners[k] + g * kLanes)));
      for (int i = 0; i < 3; i++)
        _mm256_store_ps(group()[g].vertex[k][i], _mm256_i32gather_ps(position[i], id, 4));
    }
}

GroupBounds Triangles::bounds() const {
  GroupBounds b;
  b.groups = uint8_t(groups(count));
  for (int i = 0; i < 3; i++)
    for (uint32_t g = 0; g < b.groups; g++) {
      b.low[i][g] = kInfinity;
      b.high[i][g] = -kInfinity;
      for (int k = 0; k < 3; k++)
        for (float value : group()[g].vertex[k][i]) {
          b.low[i][g] = std::min(b.low[i][g], value);
          b.high[i][g] = std::max(b.high[i][g], value);
        }
    }
  return b;
}

Boxes Boxes::around(const GroupBounds& bounds, float margin) {
  Boxes b{};
  b.groups = bounds.groups;
  for (int i = 0; i < 3; i++) {
    float low[kMaxGroups] = {}, high[kMaxGroups] = {};
    for (uint32_t g = 0; g < b.groups; g++) {
      low[g] = bounds.low[i][g] - margin;
      high[g] = bounds.high[i][g] + margin;
    }
    float least = *std::min_element(low, low + b.groups),
          most = *std::max_element(high, high + b.groups);
    b.origin[i] = least;
    b.step[i] = (most - least) / 255.0f;
    while (b.bound(true, i) < most) b.step[i] = std::nextafter(b.step[i], kInfinity);
    auto place = [&](int q) { return std::fma(float(q), b.step[i], b.origin[i]); };
    for (uint32_t g = 0; g < b.groups; g++) {
      float scale = b.step[i] > 0 ? 1.0f / b.step[i] : 0.0f;
      int from = std::clamp(int((low[g] - least) * scale), 0, 255),
          to = std::clamp(int((high[g] - least) * scale) + 1, 0, 255);
      while (from > 0 && place(from) > low[g]) from--;
      while (to < 255 && place(to) < high[g]) to++;
      b.side[0][i][g] = uint8_t(from);
      b.side[1][i][g] = uint8_t(to);
    }
  }
  return b;
}

Vec3 Triangles::corner(uint32_t triangle, int k) const {
  const TriangleGroup& g = group()[triangle / kLanes];
  uint32_t lane = triangle % kLanes;
  return {g.vertex[k][0][lane], g.vertex[k][1][lane], g.vertex[k][2][lane]};
}

namespace {

INLINE bool nearest_hit(const TriangleGroup* groups, const ShearedRay& ray, uint32_t met,
                        const float (&enter)[kMaxGroups], float t_max, Hit& hit) {
  alignas(32) float t[kLanes], b1[kLanes], b2[kLanes];
  hit.t = t_max;
  bool found = false;
  for (; met; met &= met - 1) {
    uint32_t g = uint32_t(__builtin_ctz(met));
    if (enter[g] > hit.t) continue;
    GroupHits hits = hit_group(groups[g], ray, hit.t);
    if (!hits.mask) continue;
    _mm256_store_ps(t, hits.t);
    _mm256_store_ps(b1, hits.b1);
    _mm256_store_ps(b2, hits.b2);
    for (uint32_t rest = hits.mask; rest; rest &= rest - 1) {
      uint32_t lane = uint32_t(__builtin_ctz(rest));
      if (t[lane] < hit.t) hit = {t[lane], b1[lane], b2[lane], g * kLanes + lane};
    }
    found = true;
  }
  return found;
}

INLINE bool any_hit(const TriangleGroup* groups, const ShearedRay& ray, uint32_t met, float t_max) {
  for (; met; met &= met - 1)
    if (hit_group(groups[__builtin_ctz(met)], ray, t_max).mask) return true;
  return false;
}

}  // namespace

template <int N>
void Triangles::intersect(const Rays<N>& rays, const Meetings<N>& meetings, Hits<N>& hits) const {
  const Shears<N> shears(rays);
  for (uint32_t rest = meetings.any; rest; rest &= rest - 1) {
    const int l = lane_of<N>(rest);
    if (nearest_hit(group(), ShearedRay(rays, shears, l), meetings.groups[l], meetings.enter[l],
                    rays.t_max[l], hits.of[l]))
      hits.found |= 1u << l;
  }
}

template <int N>
uint32_t Triangles::occlude(const Rays<N>& rays, const Meetings<N>& meetings) const {
  const Shears<N> shears(rays);
  uint32_t found = 0;
  for (uint32_t rest = meetings.any; rest; rest &= rest - 1) {
    const int l = lane_of<N>(rest);
    if (any_hit(group(), ShearedRay(rays, shears, l), meetings.groups[l], rays.t_max[l]))
      found |= 1u << l;
  }
  return found;
}

#define FOR_PACKETS_OF(N)                                                                    \
  template void Triangles::intersect<N>(const Rays<N>&, const Meetings<N>&, Hits<N>&) const; \
  template uint32_t Triangles::occlude<N>(const Rays<N>&, const Meetings<N>&) const;
FOR_PACKETS_OF(1)
FOR_PACKETS_OF(4)
FOR_PACKETS_OF(8)
FOR_PACKETS_OF(16)

}  // namespace meshlet_shape

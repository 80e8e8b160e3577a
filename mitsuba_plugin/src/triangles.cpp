// Compiled without contraction of a * b - c * d, which would make an edge's sign depend on the triangle that asks.
#include "triangles.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meshlet_shape {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Turned and sheared so that the ray runs along z (Woop, Benthin, Wald: Watertight Ray/Triangle Intersection, JCGT 2013).
struct ShearedRay {
  explicit ShearedRay(const PreparedRay& r) {
    int z = 0;
    for (int i = 1; i < 3; i++)
      if (std::fabs(r.d[i]) > std::fabs(r.d[z])) z = i;
    for (int i = 0; i < 3; i++) {
      axis[i] = (z + 1 + i) % 3;                                // the axis of the largest component of d comes last
      o[i] = _mm256_set1_ps(r.o[axis[i]]);
    }
    shear[0] = _mm256_set1_ps(r.d[axis[0]] * r.inverse_d[z]);
    shear[1] = _mm256_set1_ps(r.d[axis[1]] * r.inverse_d[z]);
    shear[2] = _mm256_set1_ps(r.inverse_d[z]);
  }

  int axis[3];
  __m256 o[3], shear[3];
};

struct GroupHits {
  __m256 t, b1, b2;
  uint32_t mask;
};

// x, y: a vertex sheared so that the ray runs along z from the origin.
struct Sheared {
  __m256 x, y, z;
};

inline Sheared shear(const float (*vertex)[kLanes], const ShearedRay& r) {
  __m256 x = _mm256_sub_ps(_mm256_load_ps(vertex[r.axis[0]]), r.o[0]);
  __m256 y = _mm256_sub_ps(_mm256_load_ps(vertex[r.axis[1]]), r.o[1]);
  __m256 z = _mm256_sub_ps(_mm256_load_ps(vertex[r.axis[2]]), r.o[2]);
  return {_mm256_fnmadd_ps(r.shear[0], z, x), _mm256_fnmadd_ps(r.shear[1], z, y), _mm256_mul_ps(r.shear[2], z)};
}

// Which side of the directed edge p -> q the origin is on. Rounding is monotonic, so that a sign that is not zero is right, and swapping
// p and q negates it exactly.
inline __m256 edge(const Sheared& p, const Sheared& q) {
  return _mm256_sub_ps(_mm256_mul_ps(q.x, p.y), _mm256_mul_ps(q.y, p.x));
}

inline GroupHits hit_group(const TriangleGroup& group, const ShearedRay& r, float t_max) {
  Sheared a = shear(group.vertex[0], r), b = shear(group.vertex[1], r), c = shear(group.vertex[2], r);
  __m256 u = edge(b, c), v = edge(c, a), w = edge(a, b), zero = _mm256_setzero_ps();
  __m256 low = _mm256_min_ps(u, _mm256_min_ps(v, w)), high = _mm256_max_ps(u, _mm256_max_ps(v, w));
  // On an edge (zero) counts as inside for both its triangles.
  __m256 inside = _mm256_or_ps(_mm256_cmp_ps(low, zero, _CMP_GE_OQ), _mm256_cmp_ps(high, zero, _CMP_LE_OQ));
  __m256 determinant = _mm256_add_ps(u, _mm256_add_ps(v, w));
  __m256 inverse = _mm256_div_ps(_mm256_set1_ps(1.0f), determinant);
  __m256 t = _mm256_mul_ps(_mm256_fmadd_ps(u, a.z, _mm256_fmadd_ps(v, b.z, _mm256_mul_ps(w, c.z))), inverse);
  __m256 valid = _mm256_and_ps(inside, _mm256_cmp_ps(determinant, zero, _CMP_NEQ_OQ));
  valid = _mm256_and_ps(valid, _mm256_and_ps(_mm256_cmp_ps(t, zero, _CMP_GT_OQ), _mm256_cmp_ps(t, _mm256_set1_ps(t_max), _CMP_LT_OQ)));
  return {t, _mm256_mul_ps(v, inverse), _mm256_mul_ps(w, inverse), uint32_t(_mm256_movemask_ps(valid))};
}

}  // namespace

void Triangles::build(const float (*position)[kMeshletTriangles], const uint8_t (*corners)[kMeshletTriangles], uint32_t triangle_count) {
  count = triangle_count;
  for (uint32_t g = 0; g < groups(count); g++)
    for (int k = 0; k < 3; k++) {
      __m256i id = _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(corners[k] + g * kLanes)));
      for (int i = 0; i < 3; i++) _mm256_store_ps(group()[g].vertex[k][i], _mm256_i32gather_ps(position[i], id, 4));
    }
}

Boxes Triangles::boxes(float margin) const {
  Boxes b{};
  b.groups = uint8_t(groups(count));
  float low[3][kMaxGroups], high[3][kMaxGroups];
  for (int i = 0; i < 3; i++) {
    for (uint32_t g = 0; g < b.groups; g++) {
      const TriangleGroup& triangles = group()[g];
      low[i][g] = kInfinity;
      high[i][g] = -kInfinity;
      for (int k = 0; k < 3; k++)
        for (float value : triangles.vertex[k][i]) {
          low[i][g] = std::min(low[i][g], value - margin);
          high[i][g] = std::max(high[i][g], value + margin);
        }
    }
    float least = *std::min_element(low[i], low[i] + b.groups), most = *std::max_element(high[i], high[i] + b.groups);
    b.origin[i] = least;
    b.step[i] = (most - least) / 255.0f;
    while (b.bound(true, i) < most) b.step[i] = std::nextafter(b.step[i], kInfinity);
    auto place = [&](int q) { return std::fma(float(q), b.step[i], b.origin[i]); };
    for (uint32_t g = 0; g < b.groups; g++) {
      float scale = b.step[i] > 0 ? 1.0f / b.step[i] : 0.0f;
      int from = std::clamp(int((low[i][g] - least) * scale), 0, 255), to = std::clamp(int((high[i][g] - least) * scale) + 1, 0, 255);
      while (from > 0 && place(from) > low[i][g]) from--;
      while (to < 255 && place(to) < high[i][g]) to++;
      b.side[0][i][g] = uint8_t(from);
      b.side[1][i][g] = uint8_t(to);
    }
  }
  return b;
}

Vector3 Triangles::corner(uint32_t triangle, int k) const {
  const TriangleGroup& g = group()[triangle / kLanes];
  uint32_t lane = triangle % kLanes;
  return {{g.vertex[k][0][lane], g.vertex[k][1][lane], g.vertex[k][2][lane]}};
}

bool Triangles::intersect(const PreparedRay& ray, uint32_t met, const float (&enter)[kMaxGroups], Hit& hit) const {
  alignas(32) float t[kLanes], b1[kLanes], b2[kLanes];
  const ShearedRay sheared(ray);
  hit.t = ray.t_max;
  bool found = false;
  for (; met; met &= met - 1) {
    uint32_t g = uint32_t(__builtin_ctz(met));
    if (enter[g] > hit.t) continue;
    GroupHits hits = hit_group(group()[g], sheared, hit.t);
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

bool Triangles::occludes(const PreparedRay& ray, uint32_t met) const {
  const ShearedRay sheared(ray);
  for (; met; met &= met - 1)
    if (hit_group(group()[__builtin_ctz(met)], sheared, ray.t_max).mask) return true;
  return false;
}

}  // namespace meshlet_shape

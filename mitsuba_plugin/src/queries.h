// Queries of Mitsuba's code, scalar or traced, to the native model.
//
// A traced kernel (llvm variants) cannot follow pointers into the cache. It calls back through
// Dr.Jit's entry for ray tracing libraries: rows of a structure of arrays go in, and five of the
// 32-bit words that come out per lane are free for us. Longer answers take several calls; the first
// one computes the whole answer.
#pragma once
#include <mitsuba/render/interaction.h>
#include <mitsuba/render/srgb.h>

#include <cstddef>
#include <cstring>

#include "model.h"

NAMESPACE_BEGIN(mitsuba)

using meshlet_shape::Model;
using meshlet_shape::SurfacePoint;

// The second of the two floats of a hit: the triangle in the highest bits, the second barycentric
// weight in the others.
constexpr uint32_t kTriangleShift = 26;
constexpr uint32_t kWeightMask = (1u << kTriangleShift) - 1;

inline float as_float(uint32_t bits) {
  float f;
  std::memcpy(&f, &bits, 4);
  return f;
}
inline uint32_t as_bits(float f) {
  uint32_t bits;
  std::memcpy(&bits, &f, 4);
  return bits;
}

inline float pack_triangle(const meshlet_shape::Hit& hit) {
  float weight = std::min(std::max(hit.b2, 0.f), 1.f);
  return as_float(hit.triangle << kTriangleShift |
                  std::min(uint32_t(double(weight) * (kWeightMask + 1.0) + 0.5), kWeightMask));
}
inline float packed_weight(uint32_t packed) {
  return float((packed & kWeightMask) / (kWeightMask + 1.0));
}

template <typename Mask>
uint32_t bits(const Mask& mask) {
  if constexpr (dr::size_v<Mask> > 8)
    return bits(dr::low(mask)) | bits(dr::high(mask)) << (dr::size_v<Mask> / 2);
  else
    return mask.bitmask_();
}

// Copies a packet in whole vectors. Assignment copies halves, and a load of the whole then stalls.
template <typename FloatP, size_t N>
void copy_elements(const FloatP& from, float (&to)[N]) {
  const float* lanes = from.data();
  for (size_t i = 0; i < N; i++) to[i] = lanes[i];
}

// Converts a packet of rays, or a single ray.
template <typename FloatP, typename Ray3>
auto to_rays(const Ray3& ray, const dr::mask_t<FloatP>& active) {
  if constexpr (dr::is_array_v<FloatP>) {
    constexpr size_t N = dr::size_v<FloatP>;
    meshlet_shape::Rays<int(N)> rays;
    for (int i = 0; i < 3; i++) {
      copy_elements(ray.o[i], rays.o[i]);
      copy_elements(ray.d[i], rays.d[i]);
    }
    copy_elements(ray.maxt, rays.t_max);
    rays.active = bits(active);
    return rays;
  } else {
    return meshlet_shape::Rays<1>{{{float(ray.o.x())}, {float(ray.o.y())}, {float(ray.o.z())}},
                                  {{float(ray.d.x())}, {float(ray.d.y())}, {float(ray.d.z())}},
                                  {float(ray.maxt)},
                                  active};
  }
}

enum class Query : uint32_t { kSurface, kSample, kAttribute, kTexcoord };

// Words of an answer: first the members of SurfacePoint,
constexpr uint32_t kWordP = offsetof(SurfacePoint, p) / sizeof(float);
constexpr uint32_t kWordUv = offsetof(SurfacePoint, uv) / sizeof(float);
constexpr uint32_t kWordN = offsetof(SurfacePoint, n) / sizeof(float);
constexpr uint32_t kWordShadingN = offsetof(SurfacePoint, shading_n) / sizeof(float);
constexpr uint32_t kWordDpDu = offsetof(SurfacePoint, dp_du) / sizeof(float);
constexpr uint32_t kWordDpDv = offsetof(SurfacePoint, dp_dv) / sizeof(float);
constexpr uint32_t kWordDnDu = offsetof(SurfacePoint, dn_du) / sizeof(float);
constexpr uint32_t kWordDnDv = offsetof(SurfacePoint, dn_dv) / sizeof(float);
// then, for Query::kTexcoord, the primitive's index as bits, and 1 if there is such a point.
constexpr uint32_t kWordPrimIndex = sizeof(SurfacePoint) / sizeof(float);
constexpr uint32_t kWordFound = kWordPrimIndex + 1;
constexpr uint32_t kWords = kWordFound + 1;

// Query::kAttribute answers with up to four floats from word 0. With kAttributeColor it answers
// with the corners' colours as three coefficients of spectra each, and the weights to mix them.
constexpr uint32_t kAttributeColor = 1u << 16;
constexpr uint32_t kAttributeWords = 4;
constexpr uint32_t kWordCorner = 0;  // 3 words for each of 3 corners
constexpr uint32_t kWordWeight = 9;
constexpr uint32_t kColorWords = 12;

constexpr uint32_t kChunkWords = 5;

// The question of one lane, for all words of the answer.
struct Question {
  uint32_t query, key, payload;
  float x, y, z;
};

struct Answer {
  float words[kWords];
};

inline void put_point(const SurfacePoint& point, Answer& a) {
  std::memcpy(a.words, &point, sizeof(point));
}

inline void answer_attribute(const Model& model, const Question& q, Answer& a) {
  const float* corner[3];
  float b[3], p[3] = {q.x, q.y, q.z};
  uint32_t index = q.payload & (kAttributeColor - 1),
           components = model.attributes()[index].components;
  model.attribute(index, q.key / meshlet_shape::kMeshletTriangles,
                  q.key % meshlet_shape::kMeshletTriangles, p, corner, b);
  std::fill(a.words, a.words + kColorWords, 0.f);
  for (uint32_t k = 0; k < 3; k++) {
    if (q.payload & kAttributeColor) {
      auto coefficients =
          srgb_model_fetch(Color<float, 3>(corner[k][0], corner[k][1], corner[k][2]));
      std::copy(coefficients.data(), coefficients.data() + 3, a.words + kWordCorner + 3 * k);
      a.words[kWordWeight + k] = b[k];
    } else {
      for (uint32_t c = 0; c < components; c++) a.words[c] += b[k] * corner[k][c];
    }
  }
}

inline void answer(const Model& model, const Question& q, Answer& a) {
  SurfacePoint point{};
  switch (Query(q.query)) {
    case Query::kSurface:
      model.surface(q.key, q.payload >> kTriangleShift, q.x, packed_weight(q.payload), point);
      put_point(point, a);
      break;
    case Query::kSample:
      model.sample(q.key, q.x, q.y, point);
      put_point(point, a);
      break;
    case Query::kTexcoord: {
      const float uv[2] = {q.x, q.y};
      uint32_t meshlet, triangle;
      bool found = model.at_texcoord(uv, meshlet, triangle, point);
      put_point(point, a);
      a.words[kWordPrimIndex] =
          as_float(found ? meshlet * meshlet_shape::kMeshletTriangles + triangle : 0u);
      a.words[kWordFound] = found ? 1.f : 0.f;
      break;
    }
    case Query::kAttribute: answer_attribute(model, q, a); break;
  }
}

// Called by kernels for W lanes. Rows in: 0-2 floats, 9 key, 10 payload, 11 query and chunk. Rows
// out: 8, 15, 16, 17, 19, and 18, which must differ from -1 or Dr.Jit ignores the lane.
template <int W>
void answer_lanes(const int* valid, void* model_, void*, uint32_t* rows) {
  struct Recent {
    uint64_t model = 0;
    Question question;
    Answer answer;
  };
  static thread_local Recent recent[W];
  const Model& model = *(const Model*)model_;
  const uint64_t uid = model.id();
  for (int l = 0; l < W; l++) {
    if (!valid[l]) continue;
    uint32_t chunk = rows[11 * W + l] >> 8;
    Question q{rows[11 * W + l] & 255u,   rows[9 * W + l],           rows[10 * W + l],
               as_float(rows[0 * W + l]), as_float(rows[1 * W + l]), as_float(rows[2 * W + l])};
    Recent& r = recent[l];
    if (r.model != uid || std::memcmp(&r.question, &q, sizeof(q)) != 0) {
      answer(model, q, r.answer);
      r.model = uid;
      r.question = q;
    }
    const float* words = r.answer.words + chunk * kChunkWords;
    constexpr int out[kChunkWords] = {8, 15, 16, 17, 19};
    for (uint32_t i = 0; i < kChunkWords; i++) rows[out[i] * W + l] = as_bits(words[i]);
    rows[18 * W + l] = 0;
  }
}

template <typename Float_>
struct Queries {
  using Float = Float_;
  using UInt32 = dr::uint32_array_t<Float>;
  using UInt64 = dr::uint64_array_t<Float>;
  using Mask = dr::mask_t<Float>;
  using Point2f = Point<Float, 2>;
  using Point3f = Point<Float, 3>;
  using Words = std::array<Float, kWords>;

  const Model* model = nullptr;
  // Inputs of kernels, not constants: other shapes and processes reuse compiled kernels.
  UInt64 function = 0, model_handle = 0;

  void prepare(const Model* model_) {
    model = model_;
    if constexpr (dr::is_llvm_v<Float>) {
      function = UInt64::map_(entry(), 1, false);
      model_handle = UInt64::map_((void*)model, 1, false);
    }
  }

  // Returns the words of SurfacePoint; without derivatives only those before kWordDnDu.
  Words surface(const UInt32& meshlet, const UInt32& packed, const Float& b1, bool derivatives,
                const Mask& active) const {
    return ask(Query::kSurface, meshlet, packed, b1, 0.f, 0.f,
               derivatives ? kWordPrimIndex : kWordDnDu, active);
  }

  Words sample(const UInt32& meshlet, const Point2f& u, const Mask& active) const {
    return ask(Query::kSample, meshlet, 0u, u.x(), u.y(), 0.f, kWordShadingN, active);
  }

  Words texcoord(const Point2f& uv, const Mask& active) const {
    return ask(Query::kTexcoord, 0u, 0u, uv.x(), uv.y(), 0.f, kWords, active);
  }

  Words attribute(uint32_t index, bool color, const UInt32& prim_index, const Point3f& p,
                  const Mask& active) const {
    return ask(Query::kAttribute, prim_index, UInt32(index | (color ? kAttributeColor : 0u)), p.x(),
               p.y(), p.z(), color ? kColorWords : kAttributeWords, active);
  }

 private:
  Words ask(Query query, const UInt32& key, const UInt32& payload, const Float& x, const Float& y,
            const Float& z, uint32_t words, const Mask& active) const {
    Words result;
    result.fill(Float(0.f));
    if constexpr (!dr::is_array_v<Float>) {
      if (active) {
        Answer a;
        answer(*model, {uint32_t(query), key, payload, float(x), float(y), float(z)}, a);
        for (uint32_t i = 0; i < words; i++) result[i] = a.words[i];
      }
    } else if constexpr (dr::is_llvm_v<Float>) {
      for (uint32_t chunk = 0; chunk * kChunkWords < words; chunk++)
        ask_chunk(uint32_t(query) | chunk << 8, key, payload, x, y, z, active,
                  &result[chunk * kChunkWords]);
    }
    return result;
  }

  static void* entry() {
    switch (jit_llvm_vector_width()) {
      case 1: return (void*)answer_lanes<1>;
      case 4: return (void*)answer_lanes<4>;
      case 8: return (void*)answer_lanes<8>;
      case 16: return (void*)answer_lanes<16>;
      case 32: return (void*)answer_lanes<32>;
      default:
        Throw("meshlet_edgebreaker: vectors of %u lanes are not supported",
              jit_llvm_vector_width());
    }
  }

  void ask_chunk(uint32_t query, const UInt32& key_, const UInt32& payload_, const Float& x_,
                 const Float& y_, const Float& z_, const Mask& active_, Float* out) const {
    using F = dr::detached_t<Float>;
    using U = dr::detached_t<UInt32>;
    using M = dr::detached_t<Mask>;
    using P = dr::detached_t<UInt64>;
    P f = P::steal(jit_var_pointer(JitBackend::LLVM, entry(), function.index(), 0));
    P m = P::steal(jit_var_pointer(JitBackend::LLVM, (void*)model, model_handle.index(), 0));
    F x = dr::detach<false>(x_), y = dr::detach<false>(y_), z = dr::detach<false>(z_),
      zero = dr::zeros<F>();
    U key = dr::detach<false>(key_), payload = dr::detach<false>(payload_), q = U(query);
    M coherent(true), active = dr::detach<false>(active_);
    uint32_t in[14] = {coherent.index(), active.index(), x.index(),    y.index(),
                       z.index(),        zero.index(),   zero.index(), zero.index(),
                       zero.index(),     zero.index(),   zero.index(), key.index(),
                       payload.index(),  q.index()};
    uint32_t raw[8]{};
    jit_llvm_ray_trace(uint32_t(f.index()), uint32_t(m.index()), 0, in, raw);
    F t = F::steal(raw[1]), u = F::steal(raw[2]), v = F::steal(raw[3]);
    U primitive = U::steal(raw[4]), instance = U::steal(raw[6]);
    M::steal(raw[0]);
    U::steal(raw[5]);
    M::steal(raw[7]);
    out[0] = Float(t);
    out[1] = Float(u);
    out[2] = Float(v);
    out[3] = Float(dr::reinterpret_array<F>(primitive));
    out[4] = Float(dr::reinterpret_array<F>(instance));
  }
};

NAMESPACE_END(mitsuba)

// The residuals of a meshlet's stream as its blob stores them (EXT_meshlet_edgebreaker, A.7), from
// values.
#ifndef TRANSPORT_RESIDENT_VALUES_H
#define TRANSPORT_RESIDENT_VALUES_H
#include "transport/page.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

using Eight = uint32_t __attribute__((vector_size(32)));
using SignedEight = int32_t __attribute__((vector_size(32)));
using EightFloats = float __attribute__((vector_size(32)));

// Numbers of a list: per vertex its elements.
struct List {
  static constexpr uint32_t kMost = STREAM_MAX_ELEMENTS * MESHLET_VERTICES;

  uint32_t count, length;  // numbers; the bit length of the largest
  uint32_t any[4];         // the bits in use, per element
  uint32_t u[kMost + 8];   // then zeros, up to a multiple of eight

  void clear() {
    count = 0;
    std::memset(any, 0, sizeof any);
  }
  void push(Vertex x, uint32_t elements) {
    store(u + count, 0, x);
    store(any, 0, load(any, 0) | x);
    count += elements;
  }
  void finish(uint32_t elements) {
    for (uint32_t e = elements; e < 4; e++) any[e] = 0;
    std::memset(u + count, 0, sizeof(Eight));
    length = bit_length(any[0] | any[1] | any[2] | any[3]);
  }
  // The sum of function(numbers, eight at a time).
  template <class Function>
  uint32_t sum_of(Function function) const {
    Eight sums = {};
    for (uint32_t i = 0; i < count; i += 8) {
      Eight numbers;
      std::memcpy(&numbers, u + i, sizeof numbers);
      sums += function(numbers);
    }
    uint32_t total = 0;
    for (uint32_t i = 0; i < 8; i++) total += sums[i];
    return total;
  }
};

// The lists of a stream of a meshlet.
class ResidentValues {
 public:
  List anchors, chains, interior;

  // The page has the values of streams 0 and s.
  void compute(const Page& page, const MeshletRow& m, uint32_t s);

 private:
  Vertex chain(const StreamRow& row, const uint8_t* run, uint32_t i, uint32_t n) const;
  Vertex apex(const StreamRow& row, uint32_t triangle) const;
  void sum_normals(const Page& page, const MeshletRow& m);

  // Of local vertices.
  alignas(16) uint32_t positions_[4 * MESHLET_VERTICES];
  alignas(16) uint32_t others_[4 * MESHLET_VERTICES];  // of the stream that is worked on
  alignas(16) uint32_t normals_[4 * MESHLET_VERTICES];
};

// Of a traversed triangle, which may be a root gate: then a, b and o are the same.
inline Vertex ResidentValues::apex(const StreamRow& row, uint32_t triangle) const {
  const uint32_t o_id = triangle >> 24, a_id = Page::local(triangle, 0),
                 b_id = Page::local(triangle, 1);
  const Vertex a = load(others_, a_id), b = load(others_, b_id);
  if (row.predictor() == PREDICT_COPY) return a;
  if (row.predictor() == PREDICT_MEAN || o_id == NO_VERTEX) return shifted(a + b, 1);
  const Vertex o = load(others_, o_id);
  if (row.predictor() == PREDICT_DAMPED) return shifted((a + b) * 3 - o * 2 + 2, 2);
  Weights weights;
  if (row.predictor() == PREDICT_AFFINE &&
      affine_weights(load(positions_, a_id), load(positions_, b_id), load(positions_, o_id),
                     load(positions_, Page::local(triangle, 2)), weights))
    return affine(a, b, o, weights);
  return a + b - o;
}

// Of vertex i of a run of n edges.
inline Vertex ResidentValues::chain(const StreamRow& row, const uint8_t* run, uint32_t i,
                                    uint32_t n) const {
  const Vertex x = load(others_, run[i - 1]), end = load(others_, run[n]);
  if (row.predictor() == PREDICT_COPY) return x;
  if (row.predictor() == PREDICT_AFFINE) {
    const Vertex p = load(positions_, run[i - 1]), q = load(positions_, run[n]),
                 v = load(positions_, run[i]);
    Weights weights;
    if (i >= 2 && affine_weights(p, q, load(positions_, run[i - 2]), v, weights))
      return affine(x, end, load(others_, run[i - 2]), weights);
    Vertex e = q - p, r = v - p;
    const uint32_t length = bit_length(any(absolute(e) | absolute(r)));
    if (length > 10) {
      e = shifted(e, length - 10);
      r = shifted(r, length - 10);
    }
    const int32_t ee = int32_t(dot(e, e)), re = int32_t(dot(r, e));
    if (ee > 0 && re >= 0 && re <= ee)
      return x + shifted(uint32_t((256 * re + ee / 2) / ee) * (end - x) + 128u, 8);
  }
  return toward(x, end, n - i + 1);
}

inline void ResidentValues::sum_normals(const Page& page, const MeshletRow& m) {
  const uint32_t bits = page.rows[0].bits(),
                 shift = bits > GEO_POSITION_BITS ? bits - GEO_POSITION_BITS : 0;
  std::memset(normals_, 0, 16 * m.vertices);
  for (uint32_t t = 0; t < m.triangles; t++) {
    const uint32_t triangle = page.triangles[m.triangle + t];
    const Vertex a = load(positions_, Page::local(triangle, 0)) >> shift;
    const Vertex n = cross((load(positions_, Page::local(triangle, 1)) >> shift) - a,
                           (load(positions_, Page::local(triangle, 2)) >> shift) - a);
    for (uint32_t k = 0; k < 3; k++) {
      const uint32_t v = Page::local(triangle, k);
      store(normals_, v, load(normals_, v) + n);
    }
  }
}

inline void ResidentValues::compute(const Page& page, const MeshletRow& m, uint32_t s) {
  const Reference* references = &page.references[m.reference];
  const StreamRow& row = page.rows[s];
  const bool geo = row.predictor() == PREDICT_GEO;
  const uint32_t elements = row.elements(), unused = 32 - row.bits();
  const auto gather = [&](uint32_t stream, uint32_t* values) {
    const uint32_t* id = &page.ids(stream)[m.vertex];
    for (uint32_t v = 0; v < m.vertices; v++)
      store(values, v, load(page.streams[stream].values.data(), id[v]));
  };
  gather(s, others_);
  if (geo || row.predictor() == PREDICT_AFFINE) gather(0, positions_);
  if (geo) sum_normals(page, m);
  for (List* list : {&anchors, &chains, &interior}) list->clear();
  const auto put = [&](List& list, uint32_t v, Vertex prediction) {
    const Vertex x = shifted((load(others_, v) - prediction) << unused, unused);
    list.push((x << 1) ^ shifted(x, 31), elements);
  };
  const auto put_chain = [&](List& list, const Reference& r) {
    if (r.length < 2) return;
    uint8_t run[MESHLET_VERTICES + 1];
    for (uint32_t k = 0; k <= r.length; k++) run[k] = uint8_t(page.run_vertex(m, r, k));
    for (uint32_t i = 1; i < r.length; i++) put(list, run[i], chain(row, run, i, r.length));
  };
  for (uint32_t j = 0; j < m.references; j++) {
    const Reference& r = references[j];
    if (!r.foreign(s) && !references[r.previous].foreign(s))
      anchors.push(load(others_, page.border[m.border + r.first]), elements);
    if (r.kind == kOwned) put_chain(chains, r);
    if (r.kind == kForeign && !r.foreign(s)) put_chain(interior, r);
  }
  const uint32_t* triangle = page.traversed.data() + m.traversed;
  for (uint32_t i = 0; i < m.traversed_size; i++) {
    const uint32_t v = Page::local(triangle[i], 2);
    put(interior, v, geo ? octahedral(load(normals_, v), row.bits()) : apex(row, triangle[i]));
  }
  for (List* list : {&anchors, &chains, &interior}) list->finish(elements);
}

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

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
  void compute(Page& page, const MeshletRow& m, uint32_t s);

 private:
  void load_values(Page& page, const MeshletRow& m, uint32_t s, uint32_t slot);
  // Finds the residuals that lead from predictions to the values.
  struct PushResiduals {
    List& list;

    struct Visitor {
      List& list;
      const uint32_t* values;
      uint32_t elements, unused;
      void operator()(uint32_t v, Vertex prediction) const {
        const Vertex x = shifted_right((load(values, v) - prediction) << unused, unused);
        list.push((x << 1) ^ shifted_right(x, 31), elements);
      }
    };
    Visitor visitor(const SerialDecoder& d, uint32_t s) const {
      return {list, d.vertex(s, 0), d.stream_elements[s], 32u - d.stream_bits[s]};
    }
  };

  static void list_chain(const Page& page, const MeshletRow& m, const Reference& r,
                         SerialDecoder& d);
};

// The serial decoder's streams 0 and 1 become streams 0 and s of the page, or its stream 0 does.
inline void ResidentValues::load_values(Page& page, const MeshletRow& m, uint32_t s,
                                        uint32_t slot) {
  SerialDecoder& d = page.serial;
  const StreamRow& row = page.rows[s];
  d.stream_elements[slot] = uint16_t(row.elements());
  d.stream_bits[slot] = uint16_t(row.bits());
  d.stream_predictor[slot] = uint16_t(row.predictor());
  d.stream_element[slot] = uint16_t(STREAM_MAX_ELEMENTS * slot);
  const uint32_t* id = &page.ids(s)[m.vertex];
  for (uint32_t v = 0; v < m.vertices; v++)
    store(d.vertex(slot, 0), v, load(page.streams[s].values.data(), id[v]));
}

// As the decoder lists them, from the run's first vertex.
inline void ResidentValues::list_chain(const Page& page, const MeshletRow& m, const Reference& r,
                                       SerialDecoder& d) {
  const uint32_t end = page.run_vertex(m, r, r.length);
  uint32_t earlier = NO_VERTEX, before = page.run_vertex(m, r, 0);
  for (uint32_t i = 1; i < r.length; i++) {
    const uint32_t v = page.run_vertex(m, r, i);
    d.chain_step[d.chain_count] = v | before << 8 | end << 16 | earlier << 24;
    d.chain_left[d.chain_count++] = uint16_t(r.length - i + 1);
    earlier = before;
    before = v;
  }
}

inline void ResidentValues::compute(Page& page, const MeshletRow& m, uint32_t s) {
  SerialDecoder& d = page.serial;
  const Reference* references = &page.references[m.reference];
  const StreamRow& row = page.rows[s];
  const bool geo = row.predictor() == PREDICT_GEO;
  const uint32_t elements = row.elements(), slot = s > 0;
  load_values(page, m, s, slot);
  if (slot && (geo || row.predictor() == PREDICT_AFFINE)) load_values(page, m, 0, 0);
  d.needs_normals = geo;
  d.vertex_count = m.vertices;
  d.traversed_count = m.traversed_size;
  std::memcpy(d.traversed, page.traversed.data() + m.traversed, 4u * m.traversed_size);
  if (geo) {
    d.triangle_count = m.triangles;
    std::memcpy(d.triangles, &page.triangles[m.triangle], 4u * m.triangles);
    d.finish_positions();
  }
  const uint32_t* values = d.vertex(slot, 0);
  for (List* list : {&anchors, &chains, &interior}) list->clear();
  d.chain_count = 0;
  for (uint32_t j = 0; j < m.references; j++) {
    const Reference& r = references[j];
    if (!r.foreign(s) && !references[r.previous].foreign(s))
      anchors.push(load(values, page.border[m.border + r.first]), elements);
    if (r.kind == kOwned) list_chain(page, m, r, d);
  }
  d.visit_chains(slot, PushResiduals{chains});
  d.chain_count = 0;
  for (uint32_t j = 0; j < m.references; j++)
    if (references[j].kind == kForeign && !references[j].foreign(s))
      list_chain(page, m, references[j], d);
  d.visit_chains(slot, PushResiduals{interior});
  d.visit_traversed(slot, PushResiduals{interior});
  for (List* list : {&anchors, &chains, &interior}) list->finish(elements);
}

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

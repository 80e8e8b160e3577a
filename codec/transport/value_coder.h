// Codes values of vertices: see page_coder.h.
#ifndef TRANSPORT_VALUE_CODER_H
#define TRANSPORT_VALUE_CODER_H
#include "transport/page_coder.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

inline uint32_t distance(Vertex p, Vertex q) { return sum(absolute(p - q)); }

// 16 log2(x), nearly.
inline uint32_t cost_of(uint32_t x) {
  const uint32_t length = bit_length(x) - 1;
  return 16 * length + uint32_t((uint64_t(x) << 4) >> length) - 16;
}

// The choice of a prediction that costs the fewest bits.
inline uint32_t cheapest(Vertex value, const Vertex (&predictions)[3], Cumulative c) {
  uint32_t best = 0, fewest = ~0u;
  for (uint32_t i = 0; i < 3; i++) {
    const Vertex size = absolute(value - predictions[i]);
    uint32_t cost = 16 * kProbabilityBits - cost_of(c[i + 1] - c[i]);
    for (uint32_t e = 0; e < 4; e++) cost += 2 * cost_of(std::min<uint32_t>(size[e], 1u << 30) + 1);
    if (cost >= fewest) continue;
    fewest = cost;
    best = i;
  }
  return best;
}

// A vertex without a candidate may repeat the value of an earlier one: returns how many
// vertices before, in the order of coding, or 0.
template <class Coder>
uint32_t PageCoder<Coder>::code_match(uint32_t s, size_t local, uint32_t neighbours) {
  uint32_t match = 0;
  if constexpr (kEncodes) {
    const Vertex value = source_value(s, local);
    match = coder.find(value, order_.size());
    const uint32_t* values = to.streams[s].values.data();
    if (match && any(load(values, order_[order_.size() - match]) ^ value)) match = 0;
  }
  match = unsigned_number(match, x.match[s > 0][2 * (last_match_ > 0) + (neighbours > 0)]);
  last_match_ = match;
  bad_ = bad_ || match > order_.size();
  return bad_ ? 0 : match;
}

// The order in which the new vertices of a meshlet get their values: those with the most candidates
// first. Of local vertices with one number, the first stands for all.
template <class Coder>
class PageCoder<Coder>::Plan {
 public:
  // Numbers of new vertices begin at `first`.
  Plan(const Page& page, const Corners& corners, const MeshletRow& m, uint32_t s, uint32_t first)
      : m_(m),
        corners_(corners),
        id_(&page.ids(s)[m.vertex]),
        triangle_(&page.triangles[m.triangle]),
        opposite_(&page.opposite[4 * m.triangle]),
        seams_(s > 0) {
    find_unknown(first);
    for (uint32_t t = 0; t < m.triangles; t++)
      for (uint32_t k = 0; k < 3; k++) {
        const uint32_t v = at(t, k);
        twice_[v] |= fan_[v] & 1ull << t;
        fan_[v] |= 1ull << t;
      }
    for (uint64_t x = unknown_; x; x &= x - 1) {
      lack_one_more(fan_[lowest(x)]);
      lack_one_more(twice_[lowest(x)]);
    }
    for (uint64_t ts = lacking_[1]; ts; ts &= ts - 1) add(lowest(ts));
  }

  void list(Buffer<Step>& steps) {
    while (unknown_) {
      const Step step = next();
      steps.push(step);
      know(step.vertex);
    }
  }

 private:
  void find_unknown(uint32_t first) {
    uint32_t numbers = first;
    for (uint32_t v = 0; v < m_.vertices; v++) {
      first_of_[v] = uint8_t(v);
      unknown_ |= uint64_t(id_[v] >= first) << v;
      numbers = std::max<uint32_t>(numbers, id_[v] + 1);
    }
    if (count_of(unknown_) == numbers - first) return;
    for (uint64_t x = unknown_; x; x &= x - 1)
      for (uint64_t y = x & (x - 1); y; y &= y - 1) {
        const uint32_t v = lowest(x), w = lowest(y);
        if (id_[v] != id_[w] || first_of_[w] != w) continue;
        first_of_[w] = first_of_[v];
        unknown_ &= ~(1ull << w);
      }
  }
  uint32_t at(uint32_t t, uint32_t k) const { return first_of_[Page::local(triangle_[t], k)]; }
  uint32_t lacks(uint32_t t, uint32_t k) const { return uint32_t(unknown_ >> at(t, k) & 1); }
  void lack_one_more(uint64_t ts) {
    const uint64_t one = lacking_[1] & ts, two = lacking_[2] & ts;
    lacking_[1] = (lacking_[1] & ~one) | (ts & ~one & ~two);
    lacking_[2] = (lacking_[2] & ~two) | one;
    lacking_[3] |= two;
  }
  void lack_one_less(uint64_t ts) {
    const uint64_t two = lacking_[2] & ts, three = lacking_[3] & ts;
    lacking_[1] = (lacking_[1] & ~ts) | two;
    lacking_[2] = (lacking_[2] & ~ts) | three;
    lacking_[3] &= ~ts;
  }
  // Triangle t lacks one vertex: adds it to the vertex's candidates if the one across is known.
  void add(uint32_t t) {
    const uint32_t k = lacks(t, 1) + 2 * lacks(t, 2), v = at(t, k), c = 4 * t + k,
                   across = opposite_[c], u = across >> 2, side = across & 3;
    if (two_ >> v & 1) return;
    if (side == 3 ? !(corners_.known >> u & 1) : lacks(u, side)) return;
    const uint32_t* corner = corners_.number;
    if (seams_ && side < 3 &&
        (corner[4 * u + kNext[side]] != corner[4 * t + kNext[k + 1]] ||
         corner[4 * u + kNext[side + 1]] != corner[4 * t + kNext[k]]))
      return;
    const bool more = one_ >> v & 1;
    candidates_[v][more] = uint8_t(c);
    two_ |= uint64_t(more) << v;
    one_ ^= 1ull << v;
  }
  Step next() const {
    Step step = {};
    if (const uint64_t best = two_ ? two_ : one_) {
      step.vertex = uint8_t(lowest(best));
      step.candidates = two_ ? 2 : 1;
      for (uint32_t i = 0; i < 2; i++) step.corner[i] = candidates_[step.vertex][i];
      return step;
    }
    step.vertex = uint8_t(lowest(unknown_));
    if (const uint64_t some = lacking_[1] ? lacking_[1] : lacking_[2]) {
      const uint32_t t = lowest(some);
      for (uint32_t k = 3; k-- > 0;) {
        if (lacks(t, k))
          step.vertex = uint8_t(at(t, k));
        else
          step.corner[step.neighbours++] = uint8_t(4 * t + k);
      }
    }
    return step;
  }
  void know(uint32_t v) {
    unknown_ &= ~(1ull << v);
    one_ &= ~(1ull << v);
    two_ &= ~(1ull << v);
    const uint64_t around = fan_[v];
    lack_one_less(around);
    lack_one_less(twice_[v]);
    for (uint64_t ts = lacking_[1] & around; ts; ts &= ts - 1) add(lowest(ts));
    const uint64_t whole = around & ~(lacking_[1] | lacking_[2] | lacking_[3]);
    for (uint64_t ts = whole; ts; ts &= ts - 1) {  // v may be across from another triangle's vertex
      const uint32_t t = lowest(ts), k = at(t, 0) == v ? 0 : at(t, 1) == v ? 1 : 2;
      const uint32_t across = opposite_[4 * t + k], u = across >> 2;
      if ((across & 3) < 3 && (lacking_[1] >> u & 1)) add(u);
    }
  }

  const MeshletRow& m_;
  const Corners& corners_;
  const uint32_t *id_, *triangle_;
  const uint8_t* opposite_;
  const bool seams_;
  uint8_t first_of_[MESHLET_VERTICES];
  uint64_t fan_[MESHLET_VERTICES] = {}, twice_[MESHLET_VERTICES] = {};  // triangles around
  uint64_t unknown_ = 0;                                                // vertices without a value
  uint64_t lacking_[4] = {};    // triangles by how many of their corners have none
  uint64_t one_ = 0, two_ = 0;  // vertices with so many candidates
  uint8_t candidates_[MESHLET_VERTICES][2] = {};  // corners
};

// The values of a candidate's corners, and its parallelogram.
struct Candidate {
  uint32_t x, y, z;  // vertices
  Vertex a, b, o;    // their values

  Candidate(const uint32_t* values, const uint32_t* corner, const uint8_t* opposite, uint32_t c)
      : x(corner[(c & ~3u) + kNext[c & 3]]),
        y(corner[(c & ~3u) + kNext[(c & 3) + 1]]),
        z(corner[opposite[c]]),
        a(load(values, x)),
        b(load(values, y)),
        o(load(values, z)) {}
  Vertex parallelogram() const { return a + b - o; }
  // Is the edge the longest of its triangle? It may be the diagonal of a quad.
  bool diagonal() const {
    return distance(a, b) > std::max<uint32_t>(distance(a, o), distance(b, o));
  }
};

// The mean of two parallelograms. With one common vertex of their edges, a smooth surface is nearer
// to weights that lie between that mean and a paraboloid.
inline Vertex mean_of(const Candidate& one, const Candidate& two, bool smooth) {
  const bool x = one.x == two.x || one.x == two.y, y = one.y == two.x || one.y == two.y;
  if (!smooth || x == y) return shifted_right(one.parallelogram() + two.parallelogram() + 1, 1);
  const Vertex common = x ? one.a : one.b, ends = one.a + one.b + two.a + two.b - common * 2;
  return shifted_right(common * 4 + ends * 5 - (one.o + two.o) * 3 + 4, 3);
}

// From the candidates of a step.
template <class Coder>
void PageCoder<Coder>::predict(const MeshletRow& m, uint32_t s, const Step& step, Prediction& p) {
  const uint32_t* values = to.streams[s].values.data();
  const uint8_t* opposite = &to.opposite[4 * m.triangle];
  const uint32_t c = step.corner[0], *corner = corners_.number;
  const Candidate one(values, corner, opposite, c);
  const uint8_t* sizes = sizes_.data();
  p.level = level_of(uint32_t(sizes[one.x]) + sizes[one.y] + sizes[one.z]);
  p.value = one.parallelogram();
  p.prediction_class = 1 + one.diagonal();
  if (step.candidates == 2 && s == 0) {
    const Candidate two(values, corner, opposite, step.corner[1]);
    choose(m, step, one, two, p);
    return;
  }
  p.spread = token_of(distance(one.a, one.b));
  if (class_ != kPairs) return;
  const uint32_t* positions = to.streams[0].values.data();
  const uint32_t* position = to.streams[s].numbered_as_first ? corner : positions_.number;
  const Candidate place(positions, position, opposite, c);
  VertexWeights weights;
  if (affine_weights(place.a, place.b, place.o, load(positions, position[c]), weights))
    p.value = affine(one.a, one.b, one.o, weights);
}

// Of two candidates: their mean, or one of them.
template <class Coder>
void PageCoder<Coder>::choose(const MeshletRow& m, const Step& step, const Candidate& one,
                              const Candidate& two, Prediction& p) {
  const Vertex predictions[3] = {mean_of(one, two, settings.smooth), one.parallelogram(),
                                 two.parallelogram()};
  const uint32_t apart = distance(predictions[1], predictions[2]);
  p.spread = token_of(apart);
  p.prediction_class = 3;
  p.value = predictions[0];
  if (!settings.choices || apart <= to.rows[0].elements()) return;
  Model& model = x.choice[one.diagonal() + 2 * two.diagonal()][p.spread];
  uint32_t choice = 0;
  if (kEncodes)
    choice = cheapest(source_value(0, m.vertex + step.vertex), predictions, model.cumulative());
  choice = coder.symbol(model, choice);
  p.value = predictions[std::min<uint32_t>(choice, 2)];
  if (choice) p.prediction_class = 4;
}

// Without candidates: from neighbours, or the value before.
template <class Coder>
void PageCoder<Coder>::start(uint32_t s, const Step& step, Prediction& p) const {
  const uint32_t* values = to.streams[s].values.data();
  const uint32_t n = step.neighbours, *corner = corners_.number;
  p = {last_, 0, n, kMostLevel};
  if (n == 0) return;
  const uint32_t first = corner[step.corner[0]];
  p.value = load(values, first);
  p.level = level_of(3u * sizes_[first]);
  if (n == 1) return;
  const Vertex second = load(values, corner[step.corner[1]]);
  p.spread = token_of(distance(p.value, second));
  p.value = shifted_right(p.value + second, 1);
}

// Returns the value. size: the sum of the residuals' magnitudes.
template <class Coder>
Vertex PageCoder<Coder>::code_residual(uint32_t s, size_t local, const Prediction& p,
                                       uint32_t& size) {
  ValueModels& models = x.values[class_];
  const uint32_t elements = to.rows[s].elements(), mask = to.rows[s].mask();
  const Vertex top = all_of(mask);
  const Vertex prediction = mask == ~0u ? p.value : clamped(p.value, Vertex{}, top);
  Vertex difference = {};
  if (kEncodes) difference = source_value(s, local) - prediction;
  uint32_t token;
  difference[0] =
      signed_number(difference[0], token, models.first[p.prediction_class][p.spread][p.level]);
  size = magnitude(difference[0]);
  // Known before the number, but for large ones: twice 2^31 is 0.
  uint32_t context = token < kLargeToken ? kDoubled[token] : token_of(2 * size);
  for (uint32_t e = 1; e < elements; e++) {
    difference[e] =
        signed_number(difference[e], token, models.near[e - 1][p.prediction_class][p.spread],
                      models.around[e - 1][context]);
    size += magnitude(difference[e]);
    context = token_of(size);
  }
  return (prediction + difference) & top;
}

// Codes the values of the vertices of stream s that are new with meshlet m: numbers from `first`.
// Returns how many they are.
template <class Coder>
uint32_t PageCoder<Coder>::code_values(MeshletRow& m, uint32_t s, uint32_t first) {
  Buffer<Step>* steps = &steps_;
  uint32_t begin = m.step;
  to.list_corners(m, s, corners_);
  if (s == 0) {
    m.step = begin = steps_.size();
    Plan(to, corners_, m, s, first).list(steps_);
    m.steps = uint8_t(steps_.size() - begin);
  } else if (!(m.shared >> s & 1)) {
    other_steps_.clear();
    Plan(to, corners_, m, s, first).list(other_steps_);
    steps = &other_steps_;
    begin = 0;
  }
  const uint32_t count = steps == &steps_ ? m.steps : steps->size();
  const uint32_t* id = &to.ids(s)[m.vertex];
  uint32_t* values = to.streams[s].values.data();
  if (class_ == kPairs && !to.streams[s].numbered_as_first) to.list_corners(m, 0, positions_);
  for (uint32_t i = 0; i < count; i++) {
    const Step& step = (*steps)[begin + i];
    const uint32_t number = id[step.vertex];
    const size_t local = m.vertex + step.vertex;
    uint32_t size = 0, match = 0;
    Prediction p;
    if (step.candidates) {
      predict(m, s, step, p);
    } else {
      start(s, step, p);
      match = code_match(s, local, step.neighbours);
    }
    last_ = match ? load(values, order_[order_.size() - match]) : code_residual(s, local, p, size);
    store(values, number, last_);
    sizes_[number] = uint8_t(std::min<uint32_t>(size, 255));
    if constexpr (kEncodes) coder.remember(last_, order_.size());
    order_.push(number);
  }
  return count;
}

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

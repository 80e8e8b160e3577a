// Codes a page both ways (spec/EXT_meshlet_transport.md, "Pages"): `from` is the page when packing
// and is not looked at when unpacking; `to` is what is known so far, in both directions.
#ifndef TRANSPORT_PAGE_CODER_H
#define TRANSPORT_PAGE_CODER_H
#include "transport/contexts.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

// The packer's choices for a page.
struct Settings {
  bool choices = false;  // positions may take one of their candidates
  bool matches = false;  // positions without candidates may repeat an earlier one;
  bool copies = false;   // so may the values of other streams
  bool angles = false;   // normals are weighted by angles instead of areas
  bool repeats = false;  // normals may repeat the one before
};

// Connectivity and positions; other values; normals.
constexpr uint32_t kParts = 3;

// Of the residuals around, by the sum of their sizes. The specification counts in tokens.
constexpr uint32_t kMostLevel = 3;
inline uint32_t level_of(uint32_t size) {
  return uint32_t(size >= 3) + uint32_t(size >= 8) + uint32_t(size >= 24);
}
constexpr uint8_t kNext[4] = {1, 2, 0, 1};  // the corners after a corner of a triangle

template <class Coder>
class PageCoder {
 public:
  explicit PageCoder(Page& known) : to(known) {}

  Coder coder;
  Settings settings;
  uint64_t room = ~0ull >> 3;  // bytes of the blob
  uint64_t cost[kParts];       // of the packed page's parts
  bool no_memory;              // a function returned false for the lack of it

  // Codes settings, streams and connectivity. Returns false if the page is malformed. triangles,
  // meshlets: of the page.
  bool begin(const Page* from, uint32_t triangles, uint32_t meshlets);
  // Codes the values of stream s; then only streams 0 and s have theirs. Streams come in order.
  // Returns false if the page is malformed.
  bool code_stream(uint32_t s);

 private:
  struct Ring;
  // How a vertex is predicted: from the triangles opposite to some of its corners, or from some of
  // its neighbours.
  struct Step {
    uint8_t corner[2];  // of the vertex; of neighbours
    uint8_t vertex, candidates, neighbours;
  };

  static constexpr bool kEncodes = !Coder::kDecodes;

  uint32_t unsigned_number(Model& a, Model& b, Model& large, uint32_t x);
  template <class... Models>
  uint32_t signed_number(uint32_t x, uint32_t& token, Model& large, Models&... models);
  uint32_t large_number(Model& large, uint32_t x, uint32_t sign);
  void code_settings();
  bool code_rows();
  bool code_connectivity(MeshletRow& m);
  bool code_references(MeshletRow& m);
  bool code_foreign(const MeshletRow& m, uint32_t j, bool fresh, bool after_foreign);
  uint32_t candidate_of(uint32_t reference, uint32_t meshlet, uint32_t& state) const;
  bool resolve_later_owners(const MeshletRow& m);
  void code_shares(MeshletRow& m, uint32_t j);
  bool code_symbols(MeshletRow& m);
  void plan_values(const MeshletRow& m, uint32_t s, uint32_t first, Buffer<Step>& steps) const;
  uint32_t code_values(MeshletRow& m, uint32_t s, uint32_t first);
  uint32_t code_match(uint32_t s, size_t local, uint32_t neighbours);
  void end_part(uint32_t part);
  void count_triangles(const MeshletRow& m);
  bool reserve_arrays(uint32_t triangles, uint32_t meshlets);
  bool begin_stream(uint32_t s);
  void sum_normals(uint32_t s);
  void code_normals(uint32_t s);

  bool may_repeat(uint32_t s) const { return s ? settings.copies : settings.matches; }
  const Reference& source(uint32_t reference) const { return from->references[reference]; }
  Vertex source_value(uint32_t s, size_t local) const {
    return load(from->streams[s].values.data(), from->streams[s].id[local]);
  }

  const Page* from = nullptr;
  Page& to;
  Contexts x;
  Buffer<uint8_t> valence_;   // triangles so far, per vertex of stream 0
  Buffer<uint8_t> sizes_;     // of the residuals, per vertex of the stream being coded
  Buffer<Step> steps_;        // of stream 0
  Buffer<Step> other_steps_;  // of a meshlet in another stream
  Buffer<uint32_t> order_;    // vertices of the stream as they were coded, if values may repeat
  Corners corners_;           // of a meshlet in the stream being coded
  Corners positions_;         // of it in stream 0

  uint64_t shared_;  // bit s: all references share stream s
  Vertex last_;      // value
  uint32_t last_match_;
  bool bad_;  // a number that the unpacker read is impossible
};

// --- numbers ---

template <class Coder>
uint32_t PageCoder<Coder>::large_number(Model& large, uint32_t x, uint32_t sign) {
  const uint32_t length = bit_length(x);
  uint32_t l = coder.symbol(large, kEncodes ? std::min<uint32_t>(length - kLargeLength, 15) : 0) +
               kLargeLength;
  if (l == kManyBits) l += coder.bits(length - kManyBits, 4);
  l = std::min<uint32_t>(l, 32);
  const uint32_t high = 1u << (l - 1);
  const uint32_t u = high | coder.bits(x & (high - 1), l - 1);
  return sign && coder.bits(sign & 1, 1) ? 0u - u : u;
}

template <class Coder>
uint32_t PageCoder<Coder>::unsigned_number(Model& a, Model& b, Model& large, uint32_t x) {
  const uint32_t token = coder.symbol(a, b, kEncodes ? token_of(x) : 0);
  if (token == kLargeToken) return large_number(large, x, 0);
  return kTokenBase[token] + coder.bits(x - kTokenBase[token], kTokenBits[token]);
}

// The sign is the lowest of the plain bits, 1 for negative numbers; 0 has none. models: one or two.
// token: of the magnitude. A context made of it instead of the number is known sooner.
template <class Coder>
template <class... Models>
uint32_t PageCoder<Coder>::signed_number(uint32_t x, uint32_t& token, Model& large,
                                         Models&... models) {
  const uint32_t size = magnitude(x), negative = x >> 31;
  token = coder.symbol(models..., kEncodes ? token_of(size) : 0);
  if (token == kLargeToken) return large_number(large, size, 2 | negative);
  const uint32_t bits =
      coder.bits((size - kTokenBase[token]) << 1 | negative, kTokenBits[token] + (token > 0));
  const uint32_t u = kTokenBase[token] + (bits >> 1);
  return bits & 1 ? 0u - u : u;
}

// --- settings and streams ---

template <class Coder>
void PageCoder<Coder>::code_settings() {
  for (bool* setting : {&settings.choices, &settings.matches, &settings.copies, &settings.angles,
                        &settings.repeats})
    *setting = coder.bits(*setting, 1);
}

// May the coder use this row? A reader of the blob checks it further.
inline bool usable(const StreamRow& row, bool first) {
  const uint32_t bits = row.bits(), elements = row.elements();
  if (elements < 1 || elements > STREAM_MAX_ELEMENTS || bits < 1 || bits > STREAM_MAX_BITS ||
      row.reserved() != 0)
    return false;
  if (bits > PREDICT_MAX_BITS && row.predictor() != PREDICT_COPY) return false;
  return row.predictor() != PREDICT_GEO ||
         (!first && elements == 2 && bits >= OCT_MIN_BITS && bits <= OCT_MAX_BITS);
}

// A word of a row that is that of the row before takes one bit. Returns false if a row is
// malformed.
template <class Coder>
bool PageCoder<Coder>::code_rows() {
  const uint32_t count = coder.bits(kEncodes ? from->stream_count() - 1 : 0, 6) + 1;
  StreamRow row = {};
  for (uint32_t s = 0; s < count; s++) {
    for (uint32_t i = 0; i < BLOB_STREAM_WORDS; i++) {
      const uint32_t word = kEncodes ? from->rows[s].words[i] : 0;
      if (coder.bits(word != row.words[i], 1)) row.words[i] = coder.bits(word, 32);
    }
    if (!usable(row, s == 0)) return false;
    to.rows.push(row);
  }
  return true;
}

// --- connectivity ---

template <class Coder>
bool PageCoder<Coder>::code_connectivity(MeshletRow& m) {
  const MeshletRow* source_row = kEncodes ? &from->meshlets[to.meshlets.size() - 1] : nullptr;
  const auto count = [&](Model& high, Model* low, uint32_t n) {
    const uint32_t h = coder.symbol(high, n >> 4);
    return h << 4 | coder.symbol(low[std::min<uint32_t>(h, 3)], n & 15);
  };
  const uint32_t triangles =
      count(x.triangles, x.triangles_low, kEncodes ? source_row->triangles - 1u : 0) + 1;
  const uint32_t references =
      count(x.references, x.references_low, kEncodes ? source_row->stored_references : 0);
  if (triangles > MESHLET_TRIANGLES || references > MESHLET_MAX_REFERENCES) return false;
  m.triangles = uint8_t(triangles);
  m.references = m.stored_references = uint8_t(references);
  m.shared = ~0ull;
  if (references && !code_references(m)) return false;
  if (!code_symbols(m) || !to.decode_connectivity(m)) return false;
  if (!references) {
    m.references = uint8_t(to.serial.disk_count);
    for (uint32_t d = 0; d < m.references; d++)
      to.references.push({0, kNone, to.meshlets.size() - 1, kPrivate, 1, 0, 0, 0, 0, 0, 0, 0});
  }
  return m.references <= MESHLET_VERTICES && to.place_references(m);
}

// Follows the references around the corner at which `reference`, a foreign one, ends, to the run
// that the next reference would continue. state: how it ended, for the model of kinds.
template <class Coder>
uint32_t PageCoder<Coder>::candidate_of(uint32_t reference, uint32_t meshlet,
                                        uint32_t& state) const {
  state = 0;
  uint32_t p = to.references[reference].partner;
  for (uint32_t step = 0; step < 16 && p != kNone; step++) {
    const Reference& a = to.references[p];
    if (a.meshlet == meshlet) {
      state = 1;
      return kNone;
    }
    const uint32_t q = to.meshlets[a.meshlet].reference + a.previous;
    const Reference& b = to.references[q];
    if (b.kind == kPrivate) {
      state = 2;
      return kNone;
    }
    if (b.kind == kOwned && b.partner == kNone) {
      state = 3;
      return q;
    }
    p = b.partner;
  }
  return kNone;
}

template <class Coder>
bool PageCoder<Coder>::code_references(MeshletRow& m) {
  enum { kIsOwned, kIsCandidate, kIsPrivate, kIsForeign };
  const uint32_t meshlet = to.meshlets.size() - 1;
  bool fresh = true;                       // the reference is the first of its loop
  uint32_t before = 0, before_before = 3;  // what was coded
  for (uint32_t j = 0; j < m.references; j++) {
    const uint32_t here = m.reference + j;
    const bool last = j + 1u == m.references;
    const bool after_foreign = j > 0 && to.references[here - 1].kind == kForeign;
    uint32_t state = 0, candidate = kNone;
    if (!fresh && after_foreign) candidate = candidate_of(here - 1, meshlet, state);
    uint32_t what = 0;
    if (kEncodes) {
      const Reference& r = source(here);
      what = r.kind == kOwned                               ? kIsOwned
             : r.kind == kPrivate                           ? kIsPrivate
             : candidate != kNone && r.partner == candidate ? kIsCandidate
                                                            : kIsForeign;
    }
    what = coder.symbol(
        x.reference_kind[fresh ? 4 : before][state + (before_before == kIsOwned ? 4 : 0)], what);
    if (what > kIsForeign || (what == kIsCandidate && candidate == kNone)) return false;
    before_before = before;
    before = what;
    const uint8_t kind = what == kIsOwned ? kOwned : what == kIsPrivate ? kPrivate : kForeign;
    to.references.push({0, kNone, meshlet, kPrivate, 1, 0, 0, 0, 0, 0, 0, 0});
    Reference& r = to.references[here];
    r.kind = kind & 3u;
    m.owned |= uint64_t(kind == kOwned) << j;
    if (!last) r.loop_end = coder.flag(x.loop_end[kind], kEncodes && source(here).loop_end);
    if (what == kIsCandidate) r.partner = candidate;
    if (what == kIsForeign && !code_foreign(m, j, fresh, after_foreign)) return false;
    if (kind == kForeign) {
      if (r.partner != kNone) {
        to.references[r.partner].partner = here;
        r.length = to.references[r.partner].length;
      }
      code_shares(m, j);
    } else if (kind == kOwned || !(r.loop_end && fresh)) {
      const uint32_t more =
          unsigned_number(x.length[std::min<uint32_t>(m.references, 15)],
                          x.length_before[kind * 4 + last + 2 * fresh], x.length_large,
                          kEncodes ? source(here).length - 1u : 0);
      if (more >= MESHLET_VERTICES) return false;
      r.length = uint8_t(more + 1);
    }
    fresh = r.loop_end;
  }
  // Where the next reference may continue, loops must be known before the symbols.
  for (uint32_t j = 0, begin = 0; j < m.references; j++) {
    Reference& r = to.references[m.reference + j];
    r.next = uint8_t(r.loop_end ? begin : j + 1);
    to.references[m.reference + r.next].previous = uint8_t(j);
    if (r.loop_end) begin = j + 1;
  }
  return resolve_later_owners(m);
}

// Names the owner of a foreign reference: its meshlet, and which of its owned references, of those
// without a partner or of all.
template <class Coder>
bool PageCoder<Coder>::code_foreign(const MeshletRow& m, uint32_t j, bool fresh,
                                    bool after_foreign) {
  const uint32_t here = m.reference + j, meshlet = to.meshlets.size() - 1;
  Reference& r = to.references[here];
  const Reference* owner = kEncodes ? &from->references[source(here).partner] : nullptr;
  const uint32_t delta = unsigned_number(x.delta[fresh ? 0 : 1], x.delta[2 + after_foreign],
                                         x.delta_large, kEncodes ? meshlet - owner->meshlet : 0);
  if (delta > meshlet) return false;
  const MeshletRow& o = to.meshlets[meshlet - delta];
  uint64_t open = 0;  // its owned references that none points at
  for (uint64_t owned = o.owned; owned; owned &= owned - 1)
    open |= uint64_t(to.references[o.reference + lowest(owned)].partner == kNone) << lowest(owned);
  uint32_t slot = 0;
  bool any = false;  // the slot counts all owned references
  if (kEncodes) {
    const uint32_t target = source(here).partner - o.reference;
    any = !(open >> target & 1);
    slot = count_of((any ? from->meshlets[owner->meshlet].owned : open) & below(target));
  }
  any = coder.flag(x.claimed, any);
  if (any || count_of(open) > 16)
    slot = coder.bits(slot, 6);
  else if (count_of(open) > 1)
    slot = coder.symbol(x.slot[count_of(open) - 1], slot);
  r.slot = uint8_t(slot);
  if (any && !delta) return true;  // see resolve_later_owners
  const uint32_t k = nth(any ? o.owned : open, slot);
  if (k != kNone) r.partner = o.reference + k;
  return k != kNone;
}

// Foreign references whose owner is another reference of the same meshlet, perhaps a later one.
// Then counts the slots of all.
template <class Coder>
bool PageCoder<Coder>::resolve_later_owners(const MeshletRow& m) {
  for (uint32_t here = m.reference; here < m.reference + m.references; here++) {
    Reference& r = to.references[here];
    if (r.kind != kForeign) continue;
    if (r.partner == kNone) {
      const uint32_t k = nth(m.owned, r.slot);
      if (k == kNone) return false;
      r.partner = m.reference + k;
      r.length = to.references[r.partner].length;
      to.references[r.partner].partner = here;
    }
    const MeshletRow& owner = to.meshlets[to.references[r.partner].meshlet];
    r.slot = uint8_t(count_of(owner.owned & below(r.partner - owner.reference)));
  }
  return true;
}

template <class Coder>
void PageCoder<Coder>::code_shares(MeshletRow& m, uint32_t j) {
  Reference& r = to.references[m.reference + j];
  r.shares = 1;
  bool shared = true;
  for (uint32_t s = 1; s < to.stream_count(); s++) {
    const Reference* p = j ? &to.references[m.reference + j - 1] : nullptr;
    const bool seam = p && p->kind == kForeign && !(p->shares >> s & 1);
    shared = coder.flag(x.shares[s][2 * shared + seam],
                        kEncodes && (source(m.reference + j).shares >> s & 1));
    r.shares |= uint64_t(shared) << s;
  }
  m.shared &= r.shares;
}

// The border of what is left of a disk, as a ring of nodes. The walk counts the triangles at each
// of them; those that decoded neighbours have there are known from the start.
template <class Coder>
struct PageCoder<Coder>::Ring {
  // Of a vertex, by its place: the state with the fewest triangles. Each further one is the next.
  enum State : uint8_t { kUnknown, kOnRun = 5, kRunEnd = 12, kInside = 17 };
  static constexpr uint32_t kLast = 1u << 4 | 1u << 11 | 1u << 16 | 1u << 23;
  static constexpr uint8_t kAbsent = 255;

  struct Node {
    uint8_t state, next, previous;
  };
  struct Split {
    uint8_t a, lefts;  // the left part's gate; L symbols that left the known ring since
  };

  Node node[kAbsent];  // at most 64 of loops, and 3 for each symbol
  uint8_t loop_begin[MESHLET_VERTICES], loop_size[MESHLET_VERTICES];
  Split splits[MESHLET_TRIANGLES];
  uint32_t nodes = 0, loops = 0, split = 0, disk = 0;
  bool known = true;  // the loops
  uint8_t a = 0, b = 0;

  uint8_t add(uint8_t state) {
    node[nodes] = {state, kAbsent, kAbsent};
    return uint8_t(nodes++);
  }
  void count(uint8_t v) { node[v].state += ~kLast >> node[v].state & 1; }
  void join(uint8_t p, uint8_t q) {
    node[p].next = q;
    node[q].previous = p;
  }
  // The node after v; a placeholder if it is not known.
  uint8_t after(uint8_t v) {
    if (node[v].next == kAbsent) {
      const uint8_t fresh = add(kUnknown);
      node[v].next = fresh;
    }
    return node[v].next;
  }
  void begin_disk() {
    split = 0;
    if (known && disk < loops && loop_size[disk] >= 3) {
      b = loop_begin[disk];
      a = node[b].previous;
    } else {
      a = add(kUnknown);
      b = add(kUnknown);
      node[a].next = b;
      known = false;
    }
    disk++;
  }
  // Returns true at the end of a disk.
  bool advance(uint32_t symbol) {
    count(a);
    count(b);
    switch (symbol) {
      case kC: {
        const uint8_t v = add(kInside);
        join(a, v);
        join(v, b);
        a = v;
        return false;
      }
      case kL: {
        uint8_t v = node[a].previous;
        if (v == kAbsent) {
          v = add(kUnknown);
          if (split) splits[split - 1].lefts++;
        }
        count(v);
        a = v;
        node[a].next = b;
        return false;
      }
      case kR: {
        b = after(b);
        count(b);
        node[a].next = b;
        return false;
      }
      case kS: {
        splits[split++] = {a, 0};
        const uint8_t v = add(kUnknown);
        node[v].next = b;
        a = v;
        return false;
      }
      default: {
        const uint8_t v = after(b);
        count(v);
        if (!split) return true;
        const Split s = splits[--split];
        uint8_t w = node[a].previous == kAbsent ? node[v].next : v;
        for (uint32_t i = 0; i < s.lefts && w != kAbsent; i++) w = node[w].next;
        if (w == kAbsent) w = add(kUnknown);
        count(w);
        a = s.a;
        b = w;
        node[a].next = b;
        return false;
      }
    }
  }
};

template <class Coder>
bool PageCoder<Coder>::code_symbols(MeshletRow& m) {
  Ring ring;
  ring.known = m.stored_references > 0;
  for (uint32_t j = 0; j < m.stored_references; j++) {
    const Reference& r = to.references[m.reference + j];
    const Reference& p = to.references[m.reference + r.previous];
    if (r.length == 0 || ring.nodes + r.length > MESHLET_VERTICES) {
      ring.known = false;
      break;
    }
    if (j == 0 || to.references[m.reference + j - 1].loop_end)
      ring.loop_begin[ring.loops] = uint8_t(ring.nodes);
    // Owners in earlier meshlets have their triangles already.
    const bool on = r.kind == kForeign && r.partner < m.reference;
    const bool ends = p.kind == kForeign && p.partner < m.reference;
    const Reference& o = to.references[on ? r.partner : ends ? p.partner : m.reference];
    const MeshletRow& owner = to.meshlets[o.meshlet];
    for (uint32_t k = 0; k < r.length; k++) {
      const uint8_t v = ring.add(Ring::kUnknown);
      if (v) ring.join(uint8_t(v - 1), v);
      if (!on && !(ends && k == 0)) continue;
      const uint32_t local = to.run_vertex(owner, o, on ? o.length - k : 0),
                     triangles = valence_[to.streams[0].id[owner.vertex + local]];
      ring.node[v].state = uint8_t(k ? Ring::kOnRun + std::min<uint32_t>(triangles - 1, 6)
                                     : Ring::kRunEnd + std::min<uint32_t>(triangles, 4));
    }
    if (r.loop_end) {
      ring.join(uint8_t(ring.nodes - 1), ring.loop_begin[ring.loops]);
      ring.loop_size[ring.loops] = uint8_t(ring.nodes - ring.loop_begin[ring.loops]);
      ring.loops++;
    }
  }
  const uint64_t* symbols = kEncodes ? from->meshlets[to.meshlets.size() - 1].symbols : nullptr;
  const uint32_t stored = m.triangles - 1u;
  bool fresh = true;
  for (uint32_t t = 0; t < stored; t++) {
    if (fresh) ring.begin_disk();
    uint32_t s = 0;
    while (kEncodes && !(symbols[s] >> t & 1)) s++;
    s = coder.symbol(x.symbols[ring.node[ring.b].state][ring.node[ring.a].state], s);
    if (s > kS) return false;
    m.symbols[s] |= 1ull << t;
    fresh = ring.advance(s);
  }
  m.symbols[kE] |= 1ull << stored;
  return true;
}

// --- values ---

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

// A vertex without a parallelogram may repeat the value of an earlier one: returns how many
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
  Model* models = x.match[s > 0];
  match =
      unsigned_number(models[last_match_ > 0], models[2 + (neighbours > 0)], x.match_large, match);
  last_match_ = match;
  bad_ = bad_ || match > order_.size();
  return bad_ ? 0 : match;
}

// The order in which the new vertices of a meshlet get their values: those with the most candidates
// first. Their numbers begin at `first`.
template <class Coder>
void PageCoder<Coder>::plan_values(const MeshletRow& m, uint32_t s, uint32_t first,
                                   Buffer<Step>& steps) const {
  const uint32_t *id = &to.ids(s)[m.vertex], *triangle = &to.triangles[m.triangle],
                 *corner = corners_.number;
  const uint8_t* opposite = &to.opposite[4 * m.triangle];
  uint64_t fan[MESHLET_VERTICES] = {};  // the triangles around a local vertex
  for (uint32_t t = 0; t < m.triangles; t++)
    for (uint32_t k = 0; k < 3; k++) fan[Page::local(triangle[t], k)] |= 1ull << t;
  uint64_t unknown = 0;                          // local vertices without a value
  uint64_t lacking[4] = {};                      // triangles by how many of them they have
  uint64_t one = 0, two = 0;                     // local vertices with so many candidates
  uint8_t candidates[MESHLET_VERTICES][2] = {};  // corners
  uint32_t numbers = first;
  for (uint32_t v = 0; v < m.vertices; v++) {
    unknown |= uint64_t(id[v] >= first) << v;
    numbers = std::max<uint32_t>(numbers, id[v] + 1);
  }
  const bool doubles = count_of(unknown) != numbers - first;  // local vertices of one number
  const auto lacks = [&](uint32_t packed, uint32_t k) {
    return uint32_t(unknown >> Page::local(packed, k) & 1);
  };
  for (uint64_t x = unknown; x; x &= x - 1) {
    const uint64_t around = fan[lowest(x)];
    lacking[3] |= lacking[2] & around;
    lacking[2] |= lacking[1] & around;
    lacking[1] |= around;
  }
  lacking[1] &= ~lacking[2];
  lacking[2] &= ~lacking[3];

  // Triangle t lacks one vertex: adds it to the vertex's candidates if the one across is known.
  const auto add = [&](uint32_t t) __attribute__((always_inline)) {
    const uint32_t k = lacks(triangle[t], 1) + 2 * lacks(triangle[t], 2),
                   v = Page::local(triangle[t], k), c = 4 * t + k, across = opposite[c],
                   u = across >> 2, side = across & 3;
    if (!(unknown >> v & 1) || (two >> v & 1)) return;
    if (side == 3 ? !(corners_.known >> u & 1) : lacks(triangle[u], side)) return;
    if (s && side < 3 &&
        (corner[4 * u + kNext[side]] != corner[4 * t + kNext[k + 1]] ||
         corner[4 * u + kNext[side + 1]] != corner[4 * t + kNext[k]]))
      return;  // a seam
    const bool more = one >> v & 1;
    candidates[v][more] = uint8_t(c);
    two |= uint64_t(more) << v;
    one ^= 1ull << v;
  };
  for (uint64_t ts = lacking[1]; ts; ts &= ts - 1) add(lowest(ts));

  while (unknown) {
    Step step = {};
    uint32_t v;
    if (const uint64_t best = two ? two : one) {
      v = lowest(best);
      step.candidates = two ? 2 : 1;
      for (uint32_t i = 0; i < 2; i++) step.corner[i] = candidates[v][i];
    } else {
      v = lowest(unknown);
      if (const uint64_t some = lacking[1] ? lacking[1] : lacking[2]) {
        const uint32_t t = lowest(some);
        for (uint32_t k = 3; k-- > 0;) {
          if (lacks(triangle[t], k))
            v = Page::local(triangle[t], k);
          else
            step.corner[step.neighbours++] = uint8_t(4 * t + k);
        }
      }
    }
    step.vertex = uint8_t(v);
    steps.push(step);
    uint64_t same = 1ull << v;
    for (uint64_t x = doubles ? unknown : 0; x; x &= x - 1)
      same |= uint64_t(id[lowest(x)] == id[v]) << lowest(x);
    unknown &= ~same;
    one &= ~same;
    two &= ~same;
    for (; same; same &= same - 1) {
      const uint64_t around = fan[lowest(same)];
      uint64_t whole = lacking[1] & around, next = lacking[2] & around;
      lacking[1] = (lacking[1] & ~around) | next;
      lacking[2] = (lacking[2] & ~around) | (lacking[3] & around);
      lacking[3] &= ~around;
      for (; next; next &= next - 1) add(lowest(next));
      for (; whole; whole &= whole - 1) {  // the vertex may be across from another triangle's
        const uint32_t t = lowest(whole), w = lowest(same);
        const uint32_t k =
            (Page::local(triangle[t], 1) == w) + 2 * (Page::local(triangle[t], 2) == w);
        const uint32_t across = opposite[4 * t + k], u = across >> 2;
        if ((across & 3) < 3 && (lacking[1] >> u & 1)) add(u);
      }
    }
  }
}

// Codes the values of the vertices of stream s that are new with meshlet m: numbers from `first`.
// Returns how many they are.
template <class Coder>
uint32_t PageCoder<Coder>::code_values(MeshletRow& m, uint32_t s, uint32_t first) {
  const StreamRow& row = to.rows[s];
  Stream& stream = to.streams[s];
  Buffer<Step>* steps = &steps_;
  uint32_t begin = m.step;
  to.list_corners(m, s, corners_);
  if (s == 0) {
    m.step = begin = steps_.size();
    plan_values(m, s, first, steps_);
    m.steps = uint8_t(steps_.size() - begin);
  } else if (!(m.shared >> s & 1)) {
    other_steps_.clear();
    plan_values(m, s, first, other_steps_);
    steps = &other_steps_;
    begin = 0;
  }
  const uint32_t count = steps == &steps_ ? m.steps : steps->size();
  const uint32_t elements = row.elements(), mask = row.mask();
  const uint32_t *id = &to.ids(s)[m.vertex], *corner = corners_.number,
                 *position = stream.numbered_as_first ? corner : positions_.number,
                 *positions = to.streams[0].values.data();
  const uint8_t* opposite = &to.opposite[4 * m.triangle];
  uint32_t* values = stream.values.data();
  uint8_t* sizes = sizes_.data();
  const StreamClass kind = s == 0                                     ? kPositions
                           : row.kind() == KIND_GRID && elements == 2 ? kPairs
                                                                      : kOthers;
  ValueModels& models = x.values[kind];
  if (kind == kPairs && !stream.numbered_as_first) to.list_corners(m, 0, positions_);
  const bool repeats = may_repeat(s);
  const Vertex zero = {}, top = all_of(mask);

  for (uint32_t i = 0; i < count; i++) {
    const Step& step = (*steps)[begin + i];
    const uint32_t number = id[step.vertex];
    uint32_t prediction_class = step.candidates > 0, spread, level, match = 0;
    Vertex prediction;
    if (step.candidates) {
      const uint32_t c = step.corner[0], base = c & ~3u, p = corner[base + kNext[c & 3]],
                     q = corner[base + kNext[(c & 3) + 1]], across = corner[opposite[c]];
      const Vertex a = load(values, p), b = load(values, q), o = load(values, across);
      level = level_of(uint32_t(sizes[p]) + sizes[q] + sizes[across]);
      prediction = a + b - o;
      uint32_t apart = distance(a, b);
      if (step.candidates == 2 && s == 0) {
        const uint32_t d = step.corner[1], other = d & ~3u;
        const Vertex one = prediction, two = load(values, corner[other + kNext[d & 3]]) +
                                             load(values, corner[other + kNext[(d & 3) + 1]]) -
                                             load(values, corner[opposite[d]]);
        prediction = shifted_right(one + two + 1, 1);
        prediction_class = 2;
        apart = distance(one, two);
        if (settings.choices && apart > elements) {
          const Vertex predictions[3] = {prediction, one, two};
          Model& model = x.choice[token_of(apart)];
          uint32_t choice = 0;
          if (kEncodes)
            choice =
                cheapest(source_value(s, m.vertex + step.vertex), predictions, model.cumulative());
          choice = coder.symbol(model, choice);
          prediction = predictions[std::min<uint32_t>(choice, 2)];
          if (choice) prediction_class = 3;
        }
      }
      spread = token_of(apart);
      VertexWeights weights;
      if (kind == kPairs && affine_weights(load(positions, position[base + kNext[c & 3]]),
                                           load(positions, position[base + kNext[(c & 3) + 1]]),
                                           load(positions, position[opposite[c]]),
                                           load(positions, position[c]), weights))
        prediction = affine(a, b, o, weights);
    } else {
      const uint32_t n = step.neighbours, p = corner[step.corner[0]], q = corner[step.corner[1]];
      const Vertex a = load(values, n ? p : 0), b = load(values, n > 1 ? q : 0);
      prediction = n == 2 ? shifted_right(a + b, 1) : n == 1 ? a : last_;
      spread = n == 2 ? token_of(distance(a, b)) : n;
      level = n ? level_of(3u * sizes[p]) : kMostLevel;
      if (repeats) match = code_match(s, m.vertex + step.vertex, n);
    }
    uint32_t size = 0;
    if (match) {
      last_ = load(values, order_[order_.size() - match]);
    } else {
      if (mask != ~0u) prediction = clamped(prediction, zero, top);
      Vertex difference = {};
      if (kEncodes) difference = source_value(s, m.vertex + step.vertex) - prediction;
      uint32_t token;
      difference[0] = signed_number(difference[0], token, models.large,
                                    models.first[prediction_class][spread][level]);
      size = magnitude(difference[0]);
      // Known before the number, but for large ones: twice 2^31 is 0.
      uint32_t context = token < kLargeToken ? kDoubled[token] : token_of(2 * size);
      for (uint32_t e = 1; e < elements; e++) {
        Model& by_size = models.around[e - 1][context][level];
        difference[e] = signed_number(difference[e], token, models.large,
                                      models.near[e - 1][prediction_class][spread], by_size);
        size += magnitude(difference[e]);
        context = token_of(size);
      }
      last_ = (prediction + difference) & top;
    }
    store(values, number, last_);
    sizes[number] = uint8_t(std::min<uint32_t>(size, 255));
    if (!repeats) continue;
    if constexpr (kEncodes) coder.remember(last_, order_.size());
    order_.push(number);
  }
  return count;
}

// --- normals ---

constexpr uint32_t kHalfTurn = 1608;  // in 1/512 of a radian

// The angle of the vector (x, y), y >= 0, nearly.
inline uint32_t angle_of(int32_t x, uint32_t y) {
  const uint32_t size = magnitude(uint32_t(x)), large = std::max<uint32_t>(size, y),
                 small = std::min<uint32_t>(size, y);
  const uint32_t length = bit_length(large), k = length > 19 ? length - 19 : 0;
  const uint32_t q = ((small >> k) << 12) / std::max<uint32_t>(large >> k, 1);  // 0 .. 4096
  uint32_t angle = q * (402 + (140 * (4096 - q) >> 12)) >> 12;
  if (y > size) angle = kHalfTurn / 2 - angle;
  return x < 0 ? kHalfTurn - angle : angle;
}

// The floor of the square root of x < 2^52.
inline uint32_t root(uint64_t x) { return uint32_t(__builtin_sqrt(double(x))); }

// Weighs the normal of a triangle with the edges e and f by its angles, for each of its corners.
inline void weigh_by_angles(Vertex e, Vertex f, Vertex (&normals)[3]) {
  const Vertex n = normals[0];
  uint64_t square = 0;
  for (uint32_t i = 0; i < 3; i++) square += uint64_t(int64_t(int32_t(n[i])) * int32_t(n[i]));
  const uint32_t length = root(square);
  const int64_t scale = length ? (int64_t(1) << 38) / length : 0;
  Vertex unit = {};  // of 4096
  for (uint32_t i = 0; i < 3; i++) unit[i] = uint32_t(int32_t(n[i]) * scale >> 26);
  const uint32_t first = angle_of(int32_t(dot(e, f)), length),
                 second = angle_of(int32_t(dot(e, e - f)), length);
  normals[0] = unit * first;
  normals[1] = unit * second;
  normals[2] = unit * (kHalfTurn - first - second);
}

// For each vertex the sum of the vectors of all triangles around it, in the place of its value.
template <class Coder>
void PageCoder<Coder>::sum_normals(uint32_t s) {
  const uint32_t bits = to.rows[0].bits(), shift = bits > 12 ? bits - 12 : 0;
  const uint32_t* positions = to.streams[0].values.data();
  uint32_t* sums = to.streams[s].values.data();
  std::memset(sums, 0, 16 * size_t(to.streams[s].vertices));
  for (uint32_t i = 0; i < to.meshlets.size(); i++) {
    const MeshletRow& m = to.meshlets[i];
    const uint32_t *position = &to.streams[0].id[m.vertex], *id = &to.ids(s)[m.vertex];
    for (uint32_t t = m.triangle; t < m.triangle + m.triangles; t++) {
      const uint32_t triangle = to.triangles[t];
      const auto point = [&](uint32_t k) {
        return load(positions, position[Page::local(triangle, k)]) >> shift;
      };
      const Vertex a = point(0), e = point(1) - a, f = point(2) - a, n = cross(e, f);
      Vertex parts[3] = {n, n, n};
      if (settings.angles) weigh_by_angles(e, f, parts);
      for (uint32_t k = 0; k < 3; k++) {
        const uint32_t v = id[Page::local(triangle, k)];
        store(sums, v, load(sums, v) + parts[k]);
      }
    }
  }
}

// The octahedral square seen from its centre, turned inside out: points near the corners, which
// are one direction, come together.
inline void invert(int32_t& s, int32_t& t, int32_t centre) {
  const int32_t corner_s = s > 0 || (s == 0 && t > 0) ? centre : -centre;
  const int32_t corner_t = t > 0 || (t == 0 && s > 0) ? centre : -centre;
  const bool same = corner_s == corner_t;
  const int32_t u = same ? -s : s, v = same ? -t : t;
  s = corner_s + v;
  t = corner_t + u;
}
inline int32_t wrapped(int32_t d, int32_t centre) {
  return d > centre ? d - 2 * centre - 1 : d < -centre ? d + 2 * centre + 1 : d;
}

// The vertices of an OCT stream that GEO predicts, in their order, from all triangles around.
template <class Coder>
void PageCoder<Coder>::code_normals(uint32_t s) {
  sum_normals(s);
  const uint32_t bits = to.rows[s].bits();
  const int32_t centre = int32_t((1u << bits) - 2) / 2;
  Stream& stream = to.streams[s];
  uint32_t* values = stream.values.data();
  NormalModels& models = x.normals;
  uint32_t last = 0, before = 0, repeated = 0;
  Buffer<Vertex> sources;
  if (kEncodes) {
    sources.grow(stream.vertices);
    const Buffer<uint32_t>& ids = to.ids(s);
    for (uint32_t i = 0; i < ids.size(); i++) sources[ids[i]] = source_value(s, i);
  }
  for (uint32_t i = 0; i < stream.vertices; i++) {
    const Vertex source = kEncodes ? sources[i] : Vertex{};
    if (settings.repeats && i > 0) {
      const Vertex previous = load(values, i - 1);
      const bool same =
          coder.flag(models.repeated[repeated & 3],
                     kEncodes && source[0] == previous[0] && source[1] == previous[1]);
      repeated = repeated << 1 | same;
      if (same) {
        store(values, i, previous);
        continue;
      }
    }
    const Vertex normal = load(values, i), prediction = octahedral(normal, bits);
    int32_t p[2] = {int32_t(prediction[0]) - centre, int32_t(prediction[1]) - centre};
    const bool inside_out =
        magnitude(uint32_t(p[0])) + magnitude(uint32_t(p[1])) > uint32_t(centre);
    if (inside_out) invert(p[0], p[1], centre);
    int32_t q[2] = {int32_t(source[0]) - centre, int32_t(source[1]) - centre};
    if (kEncodes) {
      bad_ = bad_ || q[0] > centre || q[1] > centre;
      if (inside_out) invert(q[0], q[1], centre);
    }
    const uint32_t area = std::min<uint32_t>(bit_length(any(absolute(normal))) / 2, 15);
    uint32_t size = 0, near = token_of(2 * last + before);
    for (uint32_t e = 0; e < 2; e++) {
      const uint32_t d = signed_number(kEncodes ? uint32_t(wrapped(q[e] - p[e], centre)) : 0, near,
                                       models.large, models.near[e][area][near]);
      bad_ = bad_ || magnitude(d) > uint32_t(2 * centre);
      size += magnitude(d);
      q[e] = bad_ ? 0 : wrapped(p[e] + int32_t(d), centre);
    }
    before = last;
    last = std::min<uint32_t>(size, 255);
    if (inside_out) {
      invert(q[0], q[1], centre);
      // At the edge of the square two points are one direction, at its corners four.
      const bool edge = magnitude(uint32_t(q[0])) == uint32_t(centre) ||
                        magnitude(uint32_t(q[1])) == uint32_t(centre);
      for (uint32_t e = 0; edge && e < 2; e++)
        if (coder.flag(models.mirrored[e], kEncodes && q[e] != int32_t(source[e]) - centre))
          q[e] = -q[e];
    }
    store(values, i, Vertex{uint32_t(q[0] + centre), uint32_t(q[1] + centre), 0, 0});
  }
}

// --- the page ---

template <class Coder>
void PageCoder<Coder>::end_part(uint32_t part) {
  if constexpr (kEncodes) {
    const uint64_t others = cost[0] + cost[1] + cost[2];
    cost[part] += coder.cost() - others;
  }
}

template <class Coder>
bool PageCoder<Coder>::begin_stream(uint32_t s) {
  Stream& stream = to.streams[s];
  // Each stream gets the arrays of the one before: they have room for the largest.
  const bool alike = (shared_ & to.all_streams()) == to.all_streams();
  const uint64_t most_vertices = alike ? to.streams[0].vertices : to.streams[0].id.size();
  no_memory = true;  // unless all of it is there
  if (s == 0) {
    if (!steps_.reserve(stream.vertices)) return false;
  } else {
    if (s > 1) stream.id.take(to.streams[s - 1].id);
    if (s > 1) stream.values.take(to.streams[s - 1].values);
    stream.numbered_as_first = shared_ >> s & 1;
    stream.vertices = stream.numbered_as_first ? to.streams[0].vertices : 0;
    if (!stream.numbered_as_first && !stream.id.reserve(to.streams[0].id.size())) return false;
    for (uint32_t i = 0; i < to.meshlets.size() && !stream.numbered_as_first; i++)
      if (!to.number_vertices(to.meshlets[i], s)) {
        no_memory = false;
        return false;
      }
  }
  sizes_.clear();
  order_.clear();
  const uint64_t vertices = most_vertices < stream.vertices ? stream.vertices : most_vertices;
  if (!stream.values.reserve(4 * vertices) || !sizes_.reserve(vertices) ||
      (may_repeat(s) && !order_.reserve(vertices)))
    return false;
  no_memory = false;
  stream.values.grow(4 * uint64_t(stream.vertices));
  sizes_.grow(stream.vertices);
  last_ = Vertex{};
  last_match_ = 0;
  if constexpr (kEncodes) coder.forget();
  return true;
}

// Of vertices at the border of a meshlet: others have no neighbours later.
template <class Coder>
void PageCoder<Coder>::count_triangles(const MeshletRow& m) {
  uint8_t count[MESHLET_VERTICES] = {};
  for (uint32_t t = m.triangle; t < m.triangle + m.triangles; t++)
    for (uint32_t k = 0; k < 3; k++) count[Page::local(to.triangles[t], k)]++;
  for (uint32_t i = m.border; i < m.border + m.border_size; i++) {
    const uint32_t v = to.border[i];
    uint8_t& valence = valence_[to.streams[0].id[m.vertex + v]];
    valence = uint8_t(std::min<uint32_t>(valence + count[v], 255));
  }
}

// Makes room for all that the blob can have: no array of connectivity grows further. So what a page
// takes depends on its counts alone, and is the same in WebAssembly, where nothing is freed.
template <class Coder>
bool PageCoder<Coder>::reserve_arrays(uint32_t triangles, uint32_t meshlets) {
  // A meshlet has a bit or more for each of its vertices: R adds one and takes a bit, L adds one
  // and takes two, E adds three at most and takes three; the head has more than the last E adds.
  uint64_t vertices = 8 * room;
  for (uint64_t limit : {MESHLET_VERTICES * uint64_t(meshlets), 3 * uint64_t(triangles)})
    if (limit < vertices) vertices = limit;
  // A reference has a bit beside that of the vertex where it begins.
  const uint64_t references = vertices < 4 * room ? vertices : 4 * room;
  return other_steps_.reserve(MESHLET_VERTICES) && to.rows.reserve(BLOB_MAX_STREAMS) &&
         to.meshlets.reserve(meshlets) && to.triangles.reserve(triangles) &&
         to.opposite.reserve(4 * uint64_t(triangles)) && to.references.reserve(references) &&
         to.streams[0].id.reserve(vertices) && to.traversed.reserve(vertices) &&
         to.border.reserve(vertices) && to.border_corner.reserve(vertices) &&
         valence_.reserve(vertices);
}

template <class Coder>
bool PageCoder<Coder>::begin(const Page* source_page, uint32_t triangles, uint32_t meshlets) {
  if (triangles >> 30) return false;  // corners have 32 bits
  from = source_page;
  to.clear();
  x.reset();
  valence_.clear();
  steps_.clear();
  bad_ = no_memory = false;
  for (uint64_t& c : cost) c = 0;
  shared_ = ~0ull;
  code_settings();
  if (!reserve_arrays(triangles, meshlets)) {
    no_memory = true;
    return false;
  }
  if (!code_rows()) return false;
  uint64_t bytes = 0;
  for (uint32_t i = 0; i < meshlets; i++) {
    MeshletRow& m = to.begin_meshlet();
    if (!code_connectivity(m) || to.triangles.size() > triangles) return false;
    // What a page takes is bounded by what the blob can hold.
    bytes += to.least_bytes(m);
    if (bytes > room) return false;
    const uint32_t first = to.streams[0].vertices;
    if (!to.number_vertices(m, 0)) return false;
    to.link_corners(m);
    shared_ &= m.shared;
    std::memset(valence_.grow(to.streams[0].vertices - first), 0, to.streams[0].vertices - first);
    count_triangles(m);
  }
  return to.triangles.size() == triangles;
}

template <class Coder>
bool PageCoder<Coder>::code_stream(uint32_t s) {
  if (!begin_stream(s)) return false;
  const bool normals = to.rows[s].predictor() == PREDICT_GEO;
  uint32_t first = 0;
  if (normals)
    code_normals(s);
  else
    for (uint32_t i = 0; i < to.meshlets.size(); i++)
      first += code_values(to.meshlets[i], s, first);
  end_part(s == 0 ? 0 : normals ? 2 : 1);
  return !bad_;
}

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

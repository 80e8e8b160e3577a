// Codes symbols and references: see page_coder.h.
#ifndef TRANSPORT_CONNECTIVITY_CODER_H
#define TRANSPORT_CONNECTIVITY_CODER_H
#include "transport/page_coder.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

// The parts of a meshlet that symbols have built, from the last symbol to the first: the border of
// each as a ring of nodes. The model of a symbol is that of the triangles at the gate's nodes.
class Parts {
 public:
  Parts() { add_triangle(); }
  // Triangles at the nodes of the gate.
  uint32_t first() const { return counted(gate_[parts_ - 1]); }
  uint32_t second() const { return counted(next_[gate_[parts_ - 1]]); }
  // Adds the triangle of a symbol before those so far. Returns false if S has no two parts to join.
  bool add(uint32_t symbol) {
    if (symbol == kE) {
      add_triangle();
      return true;
    }
    uint8_t& gate = gate_[parts_ - 1];
    const uint8_t p = gate, q = next_[p];
    triangles_[q]++;
    if (symbol == kC) {  // p is an inner vertex now
      gate = previous_[p];
      join(gate, q);
      triangles_[gate]++;
      return true;
    }
    triangles_[p]++;
    if (symbol == kS) {
      if (--parts_ == 0) return false;
      const uint8_t a = gate_[parts_ - 1], v = next_[a];  // v and p are one vertex
      triangles_[a]++;
      triangles_[p] = uint8_t(triangles_[p] + triangles_[v]);
      join(p, next_[v]);
      join(a, q);
      return true;
    }
    const uint8_t v = nodes_++;
    triangles_[v] = 1;
    join(p, v);
    join(v, q);
    if (symbol == kL) gate = v;
    return true;
  }

 private:
  uint32_t counted(uint8_t node) const {
    return std::min<uint32_t>(triangles_[node], kMostCounted);
  }
  void join(uint8_t p, uint8_t q) {
    next_[p] = q;
    previous_[q] = p;
  }
  void add_triangle() {
    gate_[parts_++] = nodes_;
    for (uint32_t k = 0; k < 3; k++) {
      triangles_[nodes_ + k] = 1;
      join(uint8_t(nodes_ + k), uint8_t(nodes_ + (k + 1) % 3));
    }
    nodes_ += 3;
  }

  uint8_t next_[3 * MESHLET_TRIANGLES], previous_[3 * MESHLET_TRIANGLES];
  uint8_t triangles_[3 * MESHLET_TRIANGLES];
  uint8_t gate_[MESHLET_TRIANGLES];  // of each part the first node of its gate
  uint8_t nodes_ = 0, parts_ = 0;
};

template <class Coder>
bool PageCoder<Coder>::code_symbols(MeshletRow& m) {
  const MeshletRow* source_row = kEncodes ? &from->meshlets[to.meshlets.size() - 1] : nullptr;
  const uint32_t count = kEncodes ? source_row->triangles - 1u : 0;
  const uint32_t high = coder.symbol(x.triangles, count >> 4);
  const uint32_t low = coder.symbol(x.triangles_low[std::min<uint32_t>(high, 3)], count & 15);
  const uint32_t stored = high << 4 | low;
  if (stored >= MESHLET_TRIANGLES) return false;
  m.triangles = uint8_t(stored + 1);
  m.symbols[kE] = 1ull << stored;
  Parts parts;
  uint32_t one = kE, two = kE;  // coded before
  for (uint32_t t = stored; t-- > 0;) {
    uint32_t s = 0;
    while (kEncodes && !(source_row->symbols[s] >> t & 1)) s++;
    s = coder.symbol(x.gate[parts.first()][parts.second()], x.before[5 * one + two][parts.first()],
                     s);
    if (s > kS || !parts.add(s)) return false;
    m.symbols[s] |= 1ull << t;
    two = one;
    one = s;
  }
  return true;
}

template <class Coder>
bool PageCoder<Coder>::code_connectivity(MeshletRow& m) {
  if (!code_symbols(m) || !to.decode_connectivity(m)) return false;
  m.shared = ~0ull;
  bool stored = false;  // not every loop is one private reference
  for (uint32_t d = 0; d < to.serial.disk_count; d++) {
    uint32_t left = count_of(to.serial.boundary & below(to.serial.disk_first[d + 1]) &
                             ~below(to.serial.disk_first[d]));
    for (bool fresh = true; left > 0; fresh = false) {
      if (m.references == MESHLET_MAX_REFERENCES || !code_reference(m, fresh, left)) return false;
      stored |= left > 0 || !fresh || to.references[to.references.size() - 1].kind != kPrivate;
    }
  }
  if (stored) m.stored_references = m.references;
  return resolve_later_owners(m) && to.place_references(m);
}

// Follows the references around the corner at which `reference`, a foreign one, ends, to the run
// that the next reference would continue. state: how that ended, for the model of kinds.
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

// left: border edges of the loop that have no reference yet. fresh: it is the loop's first one.
template <class Coder>
bool PageCoder<Coder>::code_reference(MeshletRow& m, bool fresh, uint32_t& left) {
  enum { kIsOwned, kIsCandidate, kIsPrivate, kIsForeign };
  constexpr Kind kKinds[4] = {kOwned, kForeign, kPrivate, kForeign};
  const uint32_t meshlet = to.meshlets.size() - 1, here = to.references.size(), j = m.references;
  const Kind before = fresh ? kOwned : Kind(to.references[here - 1].kind);
  uint32_t state = 0, candidate = kNone;
  if (!fresh && before == kForeign) candidate = candidate_of(here - 1, meshlet, state);
  uint32_t what = 0;
  if (kEncodes) {
    const Reference& r = source(here);
    what = r.kind == kOwned                               ? kIsOwned
           : r.kind == kPrivate                           ? kIsPrivate
           : candidate != kNone && r.partner == candidate ? kIsCandidate
                                                          : kIsForeign;
  }
  what = coder.symbol(x.reference_kind[fresh ? 0 : 1 + before][state], what);
  if (what > kIsForeign || (what == kIsCandidate && candidate == kNone)) return false;
  const Kind kind = kKinds[what];
  m.references++;
  m.owned |= uint64_t(kind == kOwned) << j;
  to.references.push({0, candidate, meshlet, uint8_t(kind & 127), 0, 0, 0, 0, 0, 0, 0, 0});
  Reference& r = to.references[here];
  bool later = false;  // its owner may come later in the meshlet
  if (what != kIsCandidate) r.partner = kNone;
  if (what == kIsForeign && !code_foreign(m, j, fresh, !fresh && before == kForeign, later))
    return false;
  if (kind == kForeign && !later) {
    to.references[r.partner].partner = here;
    r.length = to.references[r.partner].length;
  } else if (!code_length(r, fresh, left)) {
    return false;
  }
  if (kind == kForeign) code_shares(m, j);
  if (r.length > left) return false;
  left -= r.length;
  r.loop_end = left == 0;
  return true;
}

// Of a reference whose owner does not tell it.
template <class Coder>
bool PageCoder<Coder>::code_length(Reference& r, bool fresh, uint32_t left) {
  const uint32_t length = kEncodes ? source(to.references.size() - 1).length : 0;
  r.length = uint8_t(left);
  if (left == 1 || coder.flag(x.last[r.kind][fresh], length == left)) return true;
  const uint32_t more =
      unsigned_number(length - 1, x.length[token_of(left)], x.length_of[r.kind][fresh]);
  r.length = uint8_t(more + 1);
  return more + 1 < left;
}

// Names the owner of a foreign reference: its meshlet, and which of its owned references, of those
// without a partner or of all. later: all of the same meshlet count, also later ones.
template <class Coder>
bool PageCoder<Coder>::code_foreign(const MeshletRow& m, uint32_t j, bool fresh, bool after_foreign,
                                    bool& later) {
  const uint32_t here = m.reference + j, meshlet = to.meshlets.size() - 1;
  Reference& r = to.references[here];
  const Reference* owner = kEncodes ? &from->references[source(here).partner] : nullptr;
  const uint32_t delta = unsigned_number(kEncodes ? meshlet - owner->meshlet : 0,
                                         x.delta[fresh ? 0 : 1 + after_foreign]);
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
  any = coder.flag(x.taken, any);
  if (any || count_of(open) > 16)
    slot = coder.bits(slot, 6);
  else if (count_of(open) > 1)
    slot = coder.symbol(x.slot[count_of(open) - 1], slot);
  r.slot = uint8_t(slot);
  later = any && !delta;
  if (later) return true;
  const uint32_t k = nth(any ? o.owned : open, slot);
  if (k != kNone) r.partner = o.reference + k;
  return k != kNone;
}

// Foreign references whose owner is a reference of the same meshlet, perhaps a later one. Then
// counts the slots of all.
template <class Coder>
bool PageCoder<Coder>::resolve_later_owners(const MeshletRow& m) {
  for (uint32_t here = m.reference; here < m.reference + m.references; here++) {
    Reference& r = to.references[here];
    if (r.kind != kForeign) continue;
    if (r.partner == kNone) {
      const uint32_t k = nth(m.owned, r.slot);
      if (k == kNone || to.references[m.reference + k].length != r.length) return false;
      r.partner = m.reference + k;
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

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

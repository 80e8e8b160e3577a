// The decoder of blobs, for one instruction set: processors.cpp includes it for each.
#ifndef DECODE_BULK_DECODER_H
#define DECODE_BULK_DECODER_H
#include <cstring>

#include "decode/decoder.h"
#include "decode/dequantise.h"
#include "decode/serial_decoder.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace {

// Does anyone decode with begins? Without, WebAssembly has 1.6 kB less.
#ifdef MESHLET_NO_BEGINS
constexpr bool kBegins = false;
#else
constexpr bool kBegins = true;
#endif
// Boundary vertices, local ids and slots of owned references per meshlet.
constexpr uint32_t kPlaces = 64;
// Values of one stream of a vertex and of all vertices, as the serial decoder stores them.
constexpr uint32_t kStored = STREAM_MAX_ELEMENTS;
constexpr uint32_t kStream = kStored * MESHLET_VERTICES;
// Directions converted at a time: a fixed count lets compilers vectorise.
constexpr uint32_t kBatch = 8;

void copy_stored(const uint32_t* from, uint32_t* to) {
  std::memcpy(to, from, kStored * sizeof(uint32_t));
}

// Memory for numbers, freed all at once: allocations for each meshlet took 3 % of the decoding
// time. Blocks are linked by their first bytes.
class NumberStore {
 public:
  NumberStore() = default;
  NumberStore(const NumberStore&) = delete;
  ~NumberStore() { clear(); }

  void clear() {
    while (block_ != nullptr) {
      Block* before = block_->before;
      release(block_);
      block_ = before;
    }
    left_ = 0;
  }

  // Returns null if there is no memory.
  uint32_t* take(size_t count) {
    if (count > left_) {
      const size_t size = count > kBlockSize ? count : kBlockSize;
      void* const memory = allocate(sizeof(Block) + size * sizeof(uint32_t));
      if (!memory) return nullptr;
      Block* const block = static_cast<Block*>(memory);
      block->before = block_;
      block_ = block;
      left_ = size;
    }
    left_ -= count;
    return reinterpret_cast<uint32_t*>(block_ + 1) + left_;
  }

 private:
  static constexpr size_t kBlockSize = 1 << 14;
  struct Block {
    Block* before;
  };
  Block* block_ = nullptr;
  size_t left_ = 0;  // numbers in block_ that are not taken
};

// A vertex on the owned references of a meshlet. Of a meshlet in the history: its number among
// them, both ends of each reference included, in loop order. Of an earlier one: the reference's
// slot
// << kSlotShift, and the edges from the reference's start.
struct Place {
  uint32_t meshlet, place;
};
constexpr uint32_t kSlotShift = 8;

// The vertices of a meshlet that are those of an owner, by local id: aliases.
struct Aliases {
  Place of[kPlaces]{};
  uint64_t mask = 0;

  void clear() { mask = 0; }

  // Adds the vertices of a foreign reference without seams, from the place of its owner's first
  // vertex to that of its last one.
  void add(const SerialDecoder& d, uint32_t r, uint32_t owner, uint32_t start, uint32_t end) {
    const uint32_t n = d.reference_length[r], rank = d.reference_rank[r];
    uint64_t inner = 0;  // vertices that are no corners
    for (uint32_t i = 1; i < n; i++) {
      const uint32_t id = d.loop_vertex[rank + i];
      of[id] = {owner, start + n - i};
      inner |= 1ull << id;
    }
    mask |= inner;
    add_corner(d.loop_vertex[rank], {owner, end}, true);
    add_corner(d.reference_end[r], {owner, start}, false);
  }

  // Two references share a corner: the one with the smaller owner wins; on a tie, the one that
  // starts there.
  void add_corner(uint32_t id, Place target, bool starts) {
    const bool wins = !(mask >> id & 1) | (target.meshlet < of[id].meshlet + uint32_t(starts));
    of[id] = {SerialDecoder::choose(wins, target.meshlet, of[id].meshlet),
              SerialDecoder::choose(wins, target.place, of[id].place)};
    mask |= 1ull << id;
  }
};

// The part of connect_meshlet that tells which vertices are those of owners.
void locate_boundary(SerialDecoder& d) {
  d.find_seams(d.opened);
  d.place_references(d.opened);
}

// Numbers of the vertices of meshlets before those that are decoded, from vertex_begins and their
// connectivity.
class EarlierNumbers : public Allocated {
 public:
  void open(const uint8_t* data, uint32_t size) {
    d_.data = data;
    d_.size = size;
    d_.load_tables();
    d_.load_streams(0, d_.stream_total);
    connected_ = NO_MESHLET;
  }

  // Before a range: what hostile references may cost is in proportion to its meshlets. Valid ones
  // lead to a vertex's number by a few of them.
  void begin(const Outputs& out, uint32_t meshlets) {
    vertex_begins_ = out.vertex_begins;
    vertex_limit_ = out.vertex_limit;
    steps_ = kStepsOfMeshlet * (uint64_t(meshlets) + 16);
  }

  static constexpr uint32_t kNone = ~0u;

  // Returns kNone if there is no such vertex.
  uint32_t number(Place place) {
    while (steps_ > 0) {
      steps_--;
      if (place.meshlet != connected_ && !connect(place.meshlet)) return kNone;
      const uint32_t r = d_.slot_reference(d_.opened, place.place >> kSlotShift);
      const uint32_t edges = place.place & ((1u << kSlotShift) - 1);
      if (d_.error != ERROR_NONE || edges > d_.reference_length[r]) return kNone;
      const uint32_t id = edges < d_.reference_length[r]
                              ? d_.loop_vertex[d_.reference_rank[r] + edges]
                              : d_.reference_end[r];
      if (!(aliases_.mask >> id & 1)) {
        const uint64_t number = uint64_t(vertex_begins_[place.meshlet]) +
                                d_.mask_count(~aliases_.mask & d_.mask_below(id));
        return number < vertex_limit_ ? uint32_t(number) : kNone;
      }
      place = aliases_.of[id];
    }
    return kNone;
  }

 private:
  static constexpr uint64_t kStepsOfMeshlet = 64;

  bool connect(uint32_t m) {
    connected_ = NO_MESHLET;
    d_.open_meshlet(m);
    if (d_.error == ERROR_NONE) locate_boundary(d_);
    if (d_.error != ERROR_NONE) return false;
    aliases_.clear();
    for (uint64_t rest = d_.opened.foreign_refs; rest; rest &= rest - 1) {
      const uint32_t r = d_.mask_lsb(rest), start = uint32_t(d_.reference_slot[r]) << kSlotShift;
      if (!(d_.seamed_refs >> r & 1))
        aliases_.add(d_, r, d_.reference_owner[r], start, start + d_.reference_length[r]);
    }
    connected_ = m;
    return true;
  }

  SerialDecoder d_{};
  Aliases aliases_;
  const uint32_t* vertex_begins_ = nullptr;  // of the caller, who may have kept wrong ones
  uint32_t vertex_limit_ = 0;
  uint64_t steps_ = 0;
  uint32_t connected_ = NO_MESHLET;
};

// Vertex numbers and values of earlier meshlets: foreign vertices are copied, not decoded again.
// The group table's delta widths bound how far references reach back: a ring of meshlets suffices.
class History {
 public:
  explicit History(SerialDecoder& d) : d_(d) {}
  ~History() { clear(); }
  History(const History&) = delete;

  // Begins with meshlet `begin`, whose first new vertex gets this number. References to earlier
  // meshlets lead to the numbers of `earlier`, or are not followed if it is null. Returns false if
  // there is no memory.
  bool start(uint32_t begin, uint32_t first_number, EarlierNumbers* earlier);
  void clear();

  // Makes room for meshlet m, the next one. Returns false if there is no memory.
  bool reserve(uint32_t m) {
    if (m - begin_ > d_.ring_mask && !complete() && !grow(m)) return false;
    d_.chain_lengths = lengths_;
    return true;
  }

  void continue_at(uint32_t number) { next_ = number; }

  // Is there room for all meshlets that references may reach?
  bool complete() const { return d_.ring_mask >= reach_; }

  // Looks up the vertices shared with earlier meshlets. Call after place_references. provide: also
  // copies their values, if all of their meshlets are decoded: see has_values.
  void look_up(bool provide);
  // Do all vertices that the meshlet shares with earlier ones have values?
  bool has_values() const { return has_values_; }

  // Copies the values of vertices shared with the meshlet itself: corners, after read_corners, and
  // chains, after read_chains. A corner may set the decoder's error.
  void copy_own_corners();
  void copy_own_chains();

  // Numbers the meshlet's vertices after look_up (spec, appendix A.8): global[local id]. new_ids
  // receives the local ids without alias, in order, and kBatch zeros. Returns the number of new
  // vertices, or kCircle.
  uint32_t number(uint32_t* global, uint32_t* new_ids);
  // The number of new vertices after look_up, without their numbers.
  uint32_t count_new() const {
    return d_.mask_count(d_.mask_below(d_.vertex_count) & ~aliases_.mask);
  }

  // Keeps the decoded meshlet. Returns false if there is no memory.
  bool append(const uint32_t* global);

  // Notes, after append, which vertices share a position: see Outputs::shared.
  void note_shared(const uint32_t* global, uint32_t* shared);

  // Does the meshlet, decoded and appended, agree with the owners of its foreign references on
  // their shared vertices?
  bool consistent();

  static constexpr uint32_t kCircle = ~0u;  // aliases form a cycle, or more than MAX_HOPS hops

 private:
  struct Kept {
    uint32_t numbers[kPlaces];  // by place
    uint8_t start[kPlaces];     // per owned reference: place of its first vertex
    uint8_t end[kPlaces];       // per owned reference: place of its last vertex
    uint32_t* values;           // kStored for each stream of each place
    uint32_t capacity;          // places that `values` holds
  };

  Kept& kept(uint32_t meshlet) { return ring_[meshlet & d_.ring_mask]; }
  // Numbers that are kept of a place.
  uint32_t place_size() const { return kStored * d_.stream_total; }
  void copy_vertex(uint32_t r, const uint32_t* from, uint32_t step, uint32_t id);
  void copy_reference(uint32_t r, const uint32_t* from);
  template <uint32_t streams>
  void copy_streams(uint32_t r, const uint32_t* from);
  uint32_t corner_with_value(uint32_t corner, uint32_t s);
  void copy_own_corner(uint32_t corner);
  bool same_vertex(uint32_t r, uint32_t place, uint32_t id);
  void keep_references();
  uint32_t resolve(uint32_t id, const uint32_t* global);

  // Calls visit(place on the owner's boundary, local id) for the vertices of foreign reference r,
  // both corners included.
  template <class Visit>
  void for_vertices(uint32_t r, Visit visit);

  bool grow(uint32_t m);

  SerialDecoder& d_;
  EarlierNumbers* earlier_ = nullptr;
  uint32_t begin_ = 0;
  uint32_t reach_ = 0;  // references lead to at most this many meshlets back
  uint32_t next_ = 0;   // number of the next new vertex
  bool has_values_ = false;
  Kept* ring_ = nullptr;
  NumberStore store_;
  uint8_t* lengths_ = nullptr;  // kPlaces for each meshlet in the ring
  Aliases aliases_;             // of the current meshlet
  uint64_t own_refs_ = 0;       // foreign references whose owner is the current meshlet
  uint64_t owned_ = 0;          // mask of the loop's vertices that have a place
};

bool History::start(uint32_t begin, uint32_t first_number, EarlierNumbers* earlier) {
  clear();
  begin_ = d_.first_listed = begin;
  next_ = first_number;
  earlier_ = earlier;
  reach_ = 0;
  for (uint32_t m = 0; m < d_.meshlet_total; m += BLOB_GROUP_MESHLETS) {
    const uint32_t fields =
        d_.load_word(d_.group_table + BLOB_GROUP_WORDS * (m / BLOB_GROUP_MESHLETS) + 2);
    reach_ = d_.max(reach_, (1u << (fields >> GROUP_DELTA_SHIFT & 31u)) - 1);
  }
  reach_ = d_.min(reach_, d_.meshlet_total - 1);
  return grow(begin);
}

void History::clear() {
  release(ring_);
  release(lengths_);
  ring_ = nullptr;
  lengths_ = nullptr;
  store_.clear();
}

// Enlarges the ring for meshlet m. At first it is for kLeast meshlets, or for all if they have
// kMeshletBytes on average, fewer than encoders write: the header's count and the widths of
// references prove nothing. If there are more meshlets, it doubles once they are decoded and found
// not to share bytes.
bool History::grow(uint32_t m) {
  constexpr uint32_t kMeshletBytes = 64, kLeast = 4096;
  const uint32_t before = ring_ ? d_.ring_mask + 1 : 0;
  const uint32_t wanted = d_.max(d_.max(2 * before, kLeast), d_.size / kMeshletBytes);
  uint32_t size = 1;
  while (size <= reach_ && size < wanted) size *= 2;
  Kept* const ring = static_cast<Kept*>(allocate(sizeof(Kept) * size_t(size)));
  uint8_t* const lengths = static_cast<uint8_t*>(allocate(kPlaces * size_t(size)));
  if (!ring || !lengths) {
    release(ring);
    release(lengths);
    return false;
  }
  for (uint32_t i = 0; i < size; i++) {
    ring[i].values = nullptr;
    ring[i].capacity = 0;
  }
  for (uint32_t i = m - before; i < m; i++) {
    const uint32_t from = i & (before - 1), to = i & (size - 1);
    ring[to] = ring_[from];
    std::memcpy(lengths + kPlaces * size_t(to), lengths_ + kPlaces * size_t(from), kPlaces);
  }
  release(ring_);
  release(lengths_);
  ring_ = ring;
  lengths_ = lengths;
  d_.ring_mask = size - 1;
  return true;
}

template <class Visit>
INLINE void History::for_vertices(uint32_t r, Visit visit) {
  const Kept& owner = kept(d_.reference_owner[r]);
  const uint32_t slot = d_.reference_slot[r], start = owner.start[slot], end = owner.end[slot];
  const uint32_t n = d_.reference_length[r], rank = d_.reference_rank[r];
  for (uint32_t i = 0; i <= n; i++)
    visit(i == 0 ? end : start + n - i, i < n ? d_.loop_vertex[rank + i] : d_.reference_end[r]);
}

// Copies the streams that r shares from a vertex of its owner. step: from stream to stream there.
INLINE void History::copy_vertex(uint32_t r, const uint32_t* from, uint32_t step, uint32_t id) {
  uint32_t* to = d_.vertex(0, id);
  if (!(d_.seamed_refs >> r & 1)) {
    for (uint32_t s = d_.stream_total; s > 0; s--, to += kStream, from += step)
      copy_stored(from, to);
    return;
  }
  for (uint32_t s = 0; s < d_.stream_total; s++, to += kStream, from += step)
    if (!(d_.seam_refs[s] >> r & 1)) copy_stored(from, to);
}

// Copies the streams that r shares with its owner, whose values are at `from`, by place.
void History::copy_reference(uint32_t r, const uint32_t* from) {
#ifndef __wasm__
  if (!(d_.seamed_refs >> r & 1)) {
    if (d_.stream_total == 3) return copy_streams<3>(r, from);
    if (d_.stream_total == 2) return copy_streams<2>(r, from);
  }
#endif
  for_vertices(r, [&, size = place_size()](uint32_t place, uint32_t id) {
    copy_vertex(r, from + size * size_t(place), kStored, id);
  });
}

#ifndef __wasm__
// All streams: a count that compilers know takes half the instructions.
template <uint32_t streams>
void History::copy_streams(uint32_t r, const uint32_t* from) {
  for_vertices(r, [&](uint32_t place, uint32_t id) {
    const uint32_t* values = from + kStored * streams * size_t(place);
    for (uint32_t s = 0; s < streams; s++) copy_stored(values + kStored * s, d_.vertex(s, id));
  });
}
#endif

// Follows references inside the meshlet from a corner to one that has its value of stream s: by an
// anchor or by an earlier meshlet.
uint32_t History::corner_with_value(uint32_t corner, uint32_t s) {
  const SerialDecoder::Header& h = d_.opened;
  for (uint32_t hop = 0; hop <= MAX_HOPS; hop++) {
    const uint32_t source = d_.corner_source(h, corner, d_.previous_reference(h, corner), s);
    if (source == 64u || !d_.mask_test(own_refs_, source)) return corner;
    const uint32_t owned = d_.slot_reference(h, d_.reference_slot[source]);
    corner = source == corner ? d_.next_reference(h, owned) : owned;
  }
  d_.error = ERROR_HOPS;
  return corner;
}

void History::copy_own_corner(uint32_t corner) {
  const uint32_t id = d_.loop_vertex[d_.reference_rank[corner]];
  uint32_t from = id;
  for (uint32_t s = 0; s < d_.stream_total; s++) {
    if (s == 0 || d_.seamed_refs != 0)
      from = d_.loop_vertex[d_.reference_rank[corner_with_value(corner, s)]];
    if (from != id) copy_stored(d_.vertex(s, from), d_.vertex(s, id));
  }
}

void History::copy_own_corners() {
  for (uint64_t rest = own_refs_; rest; rest &= rest - 1) {
    const uint32_t r = d_.mask_lsb(rest);
    copy_own_corner(r);
    copy_own_corner(d_.next_reference(d_.opened, r));
  }
}

void History::copy_own_chains() {
  for (uint64_t rest = own_refs_; rest; rest &= rest - 1) {
    const uint32_t r = d_.mask_lsb(rest), n = d_.reference_length[r];
    const uint32_t owned = d_.slot_reference(d_.opened, d_.reference_slot[r]);
    for (uint32_t i = 1; i < n; i++)
      copy_vertex(r, d_.vertex(0, d_.inner_vertex(owned, n - i)), kStream, d_.inner_vertex(r, i));
  }
}

// Runs before aliases are set: they may lead to the meshlet itself.
void History::keep_references() {
  const SerialDecoder::Header& h = d_.opened;
  Kept& self = kept(h.meshlet);
  uint8_t* length = lengths_ + kPlaces * size_t(h.meshlet & d_.ring_mask);
  std::memset(length, 0, kPlaces);
  uint32_t slot = 0;
  owned_ = 0;
  for (uint64_t rest = h.owned_refs; rest; rest &= rest - 1, slot++) {
    const uint32_t r = d_.mask_lsb(rest), first = d_.reference_rank[r],
                   last = d_.reference_rank[d_.next_reference(h, r)];
    self.start[slot] = uint8_t(first);
    self.end[slot] = uint8_t(last);
    length[slot] = uint8_t(d_.reference_length[r]);
    owned_ |= d_.mask_below(d_.reference_length[r]) << first | d_.mask_bit(last);
  }
  for (uint32_t i = 0; i < slot; i++) {
    self.start[i] = uint8_t(d_.mask_count(owned_ & d_.mask_below(self.start[i])));
    self.end[i] = uint8_t(d_.mask_count(owned_ & d_.mask_below(self.end[i])));
  }
}

void History::look_up(bool provide) {
  keep_references();
  aliases_.clear();
  own_refs_ = 0;
  has_values_ = provide;
  for (uint64_t rest = d_.opened.foreign_refs; rest; rest &= rest - 1) {
    const uint32_t r = d_.mask_lsb(rest), owner = d_.reference_owner[r];
    if (owner < begin_) {
      has_values_ = false;
      const uint32_t start = uint32_t(d_.reference_slot[r]) << kSlotShift;
      if (kBegins && earlier_ && !(d_.seamed_refs >> r & 1))
        aliases_.add(d_, r, owner, start, start + d_.reference_length[r]);
      continue;
    }
    const uint32_t slot = d_.reference_slot[r], start = kept(owner).start[slot],
                   end = kept(owner).end[slot];
    if (has_values_ && owner != d_.opened.meshlet) copy_reference(r, kept(owner).values);
    own_refs_ |= uint64_t(owner == d_.opened.meshlet) << r;
    if (!(d_.seamed_refs >> r & 1)) aliases_.add(d_, r, owner, start, end);
  }
}

uint32_t History::resolve(uint32_t id, const uint32_t* global) {
  Place target = aliases_.of[id];
  for (uint32_t hops = 0; target.meshlet == d_.opened.meshlet; hops++) {
    const uint64_t place = d_.mask_scatter(d_.mask_bit(target.place), owned_);
    const uint32_t other = d_.loop_vertex[d_.mask_lsb(place)];
    if (!(aliases_.mask >> other & 1)) return global[other];
    if (hops >= MAX_HOPS) return kCircle;
    target = aliases_.of[other];
  }
  if (kBegins && target.meshlet < begin_) return earlier_->number(target);
  return kept(target.meshlet).numbers[target.place];
}

uint32_t History::number(uint32_t* global, uint32_t* new_ids) {
  uint32_t count = 0;
  for (uint64_t rest = d_.mask_below(d_.vertex_count) & ~aliases_.mask; rest; rest &= rest - 1) {
    uint32_t id = d_.mask_lsb(rest);
    global[id] = next_ + count;
    new_ids[count++] = id;
  }
  for (uint32_t i = 0; i < kBatch; i++) new_ids[count + i] = 0;
  next_ += count;
  for (uint64_t rest = aliases_.mask; rest; rest &= rest - 1) {
    uint32_t id = d_.mask_lsb(rest);
    global[id] = resolve(id, global);
    if (global[id] == kCircle) return kCircle;
  }
  return count;
}

bool History::append(const uint32_t* global) {
  Kept& self = kept(d_.opened.meshlet);
  const uint32_t places = d_.mask_count(owned_);
  if (self.capacity < places) {  // rounded up, or a hostile blob could take many times the memory
    const uint32_t capacity = (places + 7u) / 8u * 8u;
    uint32_t* const values = store_.take(place_size() * capacity);
    if (!values) return false;
    self.values = values;
    self.capacity = capacity;
  }
  uint32_t* to = self.values;
  uint32_t* number = self.numbers;
  for (uint64_t rest = owned_; rest; rest &= rest - 1) {
    const uint32_t id = d_.loop_vertex[d_.mask_lsb(rest)];
    *number++ = global[id];
    const uint32_t* from = d_.vertex(0, id);
    for (uint32_t* end = to + place_size(); to != end; to += kStored, from += kStream)
      copy_stored(from, to);
  }
  return true;
}

#ifndef __wasm__  // which has no use for it
void History::note_shared(const uint32_t* global, uint32_t* shared) {
  const auto first = [&](uint32_t v) {
    while (shared[v] != v) v = shared[v] = shared[shared[v]];
    return v;
  };
  for (uint64_t rest = d_.opened.foreign_refs; rest; rest &= rest - 1) {
    const uint32_t r = d_.mask_lsb(rest);
    if (d_.reference_owner[r] < begin_) continue;
    const uint32_t* numbers = kept(d_.reference_owner[r]).numbers;
    for_vertices(r, [&](uint32_t place, uint32_t id) {
      const uint32_t a = first(global[id]), b = first(numbers[place]);
      shared[d_.max(a, b)] = d_.min(a, b);
    });
  }
}

#endif

bool History::same_vertex(uint32_t r, uint32_t place, uint32_t id) {
  const uint32_t* values = kept(d_.reference_owner[r]).values + place_size() * place;
  for (uint32_t s = 0; s < d_.stream_total; s++, values += kStored)
    for (uint32_t c = 0; c < d_.stream_elements[s] && !(d_.seam_refs[s] >> r & 1); c++)
      if (d_.vertex(s, id)[c] != values[c]) return false;
  return true;
}

bool History::consistent() {
  bool same = true;
  for (uint64_t rest = d_.opened.foreign_refs; rest; rest &= rest - 1) {
    uint32_t r = d_.mask_lsb(rest);
    for_vertices(r, [&](uint32_t place, uint32_t id) { same = same && same_vertex(r, place, id); });
  }
  return same;
}

// --- from integers to values ---

// Each converts the kStored integers of a vertex: a fixed count lets compilers vectorise.

struct AsInteger {
  using Out = uint32_t;
  void operator()(const uint32_t* q, uint32_t* out) const { copy_stored(q, out); }
};

struct AsReal {
  using Out = float;
  double step, offset[kStored];
  void operator()(const uint32_t* q, float* out) const {
#ifdef __wasm_simd128__  // -Os would leave a loop
    Doubles offsets;
    std::memcpy(&offsets, offset, sizeof offsets);
    const auto integers = SignedVertex(load(q, 0));
    const auto sum = offsets + __builtin_convertvector(integers, Doubles) * step;
    const auto rounded = __builtin_convertvector(sum, float __attribute__((vector_size(16))));
    std::memcpy(out, &rounded, sizeof rounded);
#else
    for (uint32_t c = 0; c < kStored; c++) out[c] = grid_value(q[c], step, offset[c]);
#endif
  }
};

// The integers of an INTEGER stream as floats.
struct AsWhole {
  using Out = float;
  void operator()(const uint32_t* q, float* out) const {
    for (uint32_t c = 0; c < kStored; c++) out[c] = float(q[c]);
  }
};

struct AsFloatBits {
  using Out = uint32_t;
  void operator()(const uint32_t* q, uint32_t* out) const {
    for (uint32_t c = 0; c < kStored; c++) out[c] = float_bits(q[c]);
  }
};

// The new vertices of one meshlet.
struct NewVertices {
  const uint32_t* ids;  // local ids, padded to whole batches
  uint32_t count;
  uint32_t first;  // number of the first
  uint32_t room;   // vertices that the outputs hold from `first` on
};

// WebAssembly gets one function for all n: 12 would be a tenth of the module.
#ifdef __wasm__
#define WRITE_INLINE
#else
#define WRITE_INLINE INLINE
#endif

// Converts one stream of n elements of the new vertices. Writes kStored numbers for each if there
// is room; the next vertex overwrites the surplus.
template <class Convert>
WRITE_INLINE void write_elements(uint32_t n, const uint32_t* values, const NewVertices& v,
                                 void* out, const Convert& convert) {
  using Out = typename Convert::Out;
  Out* to = static_cast<Out*>(out) + n * size_t(v.first);
  const uint32_t roomy = v.room < kStored ? 0 : v.room - kStored + 1;
  const uint32_t wide = v.count < roomy ? v.count : roomy;
  uint32_t i = 0;
  for (; i < wide; i++, to += n) convert(values + kStored * size_t(v.ids[i]), to);
  for (; i < v.count; i++, to += n) {
    Out converted[kStored];
    convert(values + kStored * size_t(v.ids[i]), converted);
    std::memcpy(to, converted, sizeof(Out) * n);
  }
}

template <class Convert>
void write_stream(const Stream& s, const uint32_t* values, const NewVertices& v, void* out,
                  const Convert& convert) {
#ifdef __wasm__
  write_elements(s.elements, values, v, out, convert);
#else
  switch (s.elements) {
    case 1: return write_elements(1, values, v, out, convert);
    case 2: return write_elements(2, values, v, out, convert);
    case 3: return write_elements(3, values, v, out, convert);
    default: return write_elements(4, values, v, out, convert);
  }
#endif
}

// Elements 0 and 1 of a batch of vertices.
inline void load_pairs(const uint32_t* values, const uint32_t* ids, uint32_t (*q)[kBatch]) {
#if MESHLET_AVX2
  auto pair = [&](uint32_t k) {
    return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(values + kStored * size_t(ids[k])));
  };
  auto four = [&](uint32_t low, uint32_t high) {
    return _mm256_inserti128_si256(
        _mm256_castsi128_si256(_mm_unpacklo_epi64(pair(low), pair(low + 1))),
        _mm_unpacklo_epi64(pair(high), pair(high + 1)), 1);
  };
  const __m256 a = _mm256_castsi256_ps(four(0, 4)), b = _mm256_castsi256_ps(four(2, 6));
  _mm256_storeu_ps(reinterpret_cast<float*>(q[0]), _mm256_shuffle_ps(a, b, 0x88));
  _mm256_storeu_ps(reinterpret_cast<float*>(q[1]), _mm256_shuffle_ps(a, b, 0xDD));
#else
  for (uint32_t k = 0; k < kBatch; k++)
    for (uint32_t c = 0; c < 2; c++) q[c][k] = values[kStored * ids[k] + c];
#endif
}

// Converts an OCT stream, a batch at a time. The last batch may write too much; the next meshlet
// overwrites it.
void write_directions(const Stream& s, const uint32_t* values, const NewVertices& v, float* out) {
  const float scale = octahedral_scale(s.bits);
  float* to = out + 3 * size_t(v.first);
  for (uint32_t i = 0; i < v.count; i += kBatch, to += 3 * kBatch) {
    uint32_t q[2][kBatch];
    float x[kBatch], y[kBatch], z[kBatch], rest[3 * kBatch];
    load_pairs(values, v.ids + i, q);
    for (uint32_t k = 0; k < kBatch; k++)
      octahedral_direction(q[0][k], q[1][k], scale, x[k], y[k], z[k]);
    const bool room = i + kBatch <= v.room;
    float* vertices = room ? to : rest;
    for (uint32_t k = 0; k < kBatch; k++, vertices += 3) {
      vertices[0] = x[k];
      vertices[1] = y[k];
      vertices[2] = z[k];
    }
    if (!room) std::memcpy(to, rest, sizeof(float) * 3 * (v.count - i));
  }
}

WRITE_INLINE void write_values(const Stream& s, const uint32_t* values, const NewVertices& v,
                               void* out) {
  const AsReal grid = {s.step, {s.offset[0], s.offset[1], s.offset[2], s.offset[3]}};
  const AsReal sign = {2.0, {-1.0, -1.0, -1.0, -1.0}};
  switch (s.kind) {
    case kOct: return write_directions(s, values, v, static_cast<float*>(out));
    case kInteger: return write_stream(s, values, v, out, AsInteger());
    case kFloat32: return write_stream(s, values, v, out, AsFloatBits());
    case kSign: return write_stream(s, values, v, out, sign);
    default: return write_stream(s, values, v, out, grid);
  }
}

void write_vertices(const SerialDecoder& d, const Stream* streams, StreamRange range,
                    const NewVertices& v, const Outputs& out) {
  for (uint32_t s = range.first; s < range.end; s++) {
    const uint32_t* values = d.vertex(s, 0);
    if (out.integers && out.integers[s])
      write_stream(streams[s], values, v, out.integers[s], AsInteger());
    if (out.values && out.values[s]) write_values(streams[s], values, v, out.values[s]);
  }
}

#ifndef MESHLET_NO_BEGINS  // nor has WebAssembly a use for these
#ifdef __GNUC__
#define RARELY __attribute__((noinline))  // kept out of the way of the loop over meshlets
#else
#define RARELY
#endif

// All vertices of a meshlet, in order.
struct LocalIds {
  uint32_t ids[kPlaces + kBatch];
  LocalIds() {
    for (uint32_t i = 0; i < kPlaces + kBatch; i++) ids[i] = i % kPlaces;
  }
};

// Values as floats, those of INTEGER streams, too.
RARELY void write_floats(const Stream& s, const uint32_t* values, const NewVertices& v,
                         float* out) {
  if (s.kind == kInteger)
    write_stream(s, values, v, out, AsWhole());
  else
    write_values(s, values, v, out);
}

// To the caller's layout. row: of the first new vertex.
RARELY void write_attributes(const SerialDecoder& d, const Stream* streams, const NewVertices& v,
                             const Outputs& out, size_t row) {
  const NewVertices apart = {v.ids, v.count, 0, kPlaces + kBatch};
  for (uint32_t i = 0; i < out.attribute_count; i++) {
    const VertexAttribute& to = out.attributes[i];
    const Stream& s = streams[to.stream];
    uint8_t* const first = to.data + to.stride * row;
    if (holds_integers(to.format)) {
      uint32_t integers[kStored * (kPlaces + kBatch)];
      write_stream(s, d.vertex(to.stream, 0), apart, integers, AsInteger());
      pack_integers(to.format, integers, v.count, s.elements, first, to.stride);
      continue;
    }
    float values[kStored * (kPlaces + kBatch)];
    write_floats(s, d.vertex(to.stream, 0), apart, values);
    pack_values(to.format, values, v.count, value_count(s), first, to.stride);
  }
}

// Stream 0 has three elements.
RARELY void write_bounds(const SerialDecoder& d, const Stream* streams, MeshletBounds& out) {
  float positions[kStored * (kPlaces + kBatch)];
  const LocalIds local;
  const NewVertices all = {local.ids, d.vertex_count, 0, kPlaces + kBatch};
  write_floats(streams[0], d.vertex(0, 0), all, positions);
  out = BoundsOf(positions, d.vertex_count, d.triangles, d.triangle_count).bounds();
}
#endif

void write_triangles(const SerialDecoder& d, const uint32_t* global, uint32_t* out) {
  uint32_t count = d.triangle_count;
  for (uint32_t t = 0; t < count; t++, out += 3) {
    uint32_t triangle = d.triangles[t];
    out[0] = global[triangle & 255u];
    out[1] = global[triangle >> 8 & 255u];
    out[2] = global[triangle >> 16 & 255u];
  }
}

#ifndef MESHLET_NO_BEGINS
RARELY void write_narrow_triangles(const SerialDecoder& d, const uint32_t* global, uint16_t* out) {
  for (uint32_t t = 0; t < d.triangle_count; t++)
    for (uint32_t k = 0; k < 3; k++) *out++ = uint16_t(global[d.triangles[t] >> 8 * k & 255u]);
}
#endif

// First byte after meshlet m.
uint32_t meshlet_end(SerialDecoder& d, uint32_t m) {
  const uint32_t next = m + 1;
  if (next == d.meshlet_total) return d.byte_length - BLOB_PADDING_BYTES;
  if (next % BLOB_GROUP_MESHLETS > 0) return d.meshlet_start(next);
  return d.load_word(d.group_table + BLOB_GROUP_WORDS * (next / BLOB_GROUP_MESHLETS));
}

Problem malformed(uint32_t m, uint32_t error) { return {error_text(error), 0, m}; }

constexpr const char* kTooManyVertices = "the blob has more vertices than its header says";
constexpr const char* kTooFewVertices = "the blob has fewer vertices than its header says";

// Not for the stack: more than 100 kB.
class BlobDecoder : public Decoder {
 public:
  ~BlobDecoder() override { delete earlier_; }

 private:
  size_t bytes() const override { return sizeof(*this); }
  void opened() override;
  void restart() override { next_ = NO_MESHLET; }
  using Decoder::decode;
  Problem decode(uint32_t first, uint32_t count, StreamRange streams, const Outputs& out,
                 DecodedCounts& counts) override;
  Problem count_vertices(uint32_t first, uint32_t count, uint32_t* vertices) override;
  Problem validate() override;

  Problem decode_alone(uint32_t first, uint32_t count, StreamRange streams, const Outputs& out);
  void load_streams(StreamRange streams);
  bool start(uint32_t begin, uint32_t first_number, const uint32_t* vertex_begins);
  bool open_earlier();
  // Of a meshlet's vertices: their numbers, and the new ones' local ids.
  struct Numbers {
    uint32_t global[kPlaces], new_ids[kPlaces + kBatch];
    uint32_t new_count;
  };
  Problem decode_next(uint32_t m, bool alone, Numbers& out);
  void decode_values(uint32_t m);
  Problem count_room(uint32_t m, uint32_t end, const Outputs& out, const Numbers& numbers,
                     uint32_t& room) const;

  SerialDecoder d_{};
  History history_{d_};
  EarlierNumbers* earlier_ = nullptr;  // made when it is needed
  bool earlier_open_ = false;          // on the open blob
  StreamRange loaded_;
  // Of calls that continue each other, to arrays: the first meshlet of the first one; the next
  // meshlet, or NO_MESHLET if no call can continue; the vertices so far; their vertex_begins.
  uint32_t begin_ = 0, next_ = NO_MESHLET, vertices_ = 0;
  const uint32_t* vertex_begins_ = nullptr;
};

void BlobDecoder::opened() {
  d_.data = data_;
  d_.size = size_;
  d_.load_tables();
  loaded_ = {0, 0};
  next_ = NO_MESHLET;
  earlier_open_ = false;
  history_.clear();
}

void BlobDecoder::load_streams(StreamRange streams) {
  if (streams.end > stream_count_) streams.end = stream_count_;
  if (streams.first == loaded_.first && streams.end == loaded_.end) return;
  d_.load_streams(streams.first, streams.end);
  loaded_ = streams;
}

Problem BlobDecoder::decode_alone(uint32_t first, uint32_t count, StreamRange streams,
                                  const Outputs& out) {
  load_streams(streams);
  d_.chain_lengths = nullptr;
  for (uint32_t m = first; m - first < count; m++) {
    d_.decode_meshlet(m);
    if (d_.error != ERROR_NONE) return malformed(m, d_.error);
  }
  *out.meshlet = {d_.triangle_count, d_.vertex_count, d_.triangles, d_.values, d_.stream_element};
#ifndef MESHLET_NO_BEGINS
  if (out.bounds) write_bounds(d_, streams_, *out.bounds);
  if (out.attribute_count) {
    const LocalIds local;
    write_attributes(d_, streams_, {local.ids, d_.vertex_count, 0, 0}, out, out.attribute_row);
  }
#endif
  return {};
}

bool BlobDecoder::open_earlier() {
  if (!earlier_) earlier_ = new EarlierNumbers;
  if (!earlier_) return false;
  if (!earlier_open_) earlier_->open(data_, size_);
  earlier_open_ = true;
  return true;
}

// Begins to decode to arrays. Returns false if there is no memory.
bool BlobDecoder::start(uint32_t begin, uint32_t first_number, const uint32_t* vertex_begins) {
  begin_ = begin;
  next_ = NO_MESHLET;
  vertices_ = 0;
  vertex_begins_ = vertex_begins;
  const bool looks_back = kBegins && vertex_begins && begin > 0;
  if (looks_back && !open_earlier()) return false;
  return history_.start(begin, first_number, looks_back ? earlier_ : nullptr);
}

// Decodes the values and lists the triangles of meshlet m with the vertices of earlier meshlets
// that the history holds. Sets the serial decoder's error.
void BlobDecoder::decode_values(uint32_t m) {
  d_.open_meshlet(m);
  if (d_.error == ERROR_NONE) d_.connect_meshlet();
  if (d_.error != ERROR_NONE) return;
  history_.look_up(true);
  if (!history_.has_values()) return d_.decode_meshlet(m);
  d_.read_corners();
  history_.copy_own_corners();
  if (d_.error == ERROR_NONE) d_.read_chains(d_.opened);
  history_.copy_own_chains();
  if (d_.error == ERROR_NONE) d_.read_interiors();
}

// Decodes meshlet m, numbers its vertices and keeps it. alone: without the values of earlier ones.
Problem BlobDecoder::decode_next(uint32_t m, bool alone, Numbers& out) {
  if (!history_.reserve(m)) return {kNoMemory};
  if (alone)
    d_.decode_meshlet(m);
  else
    decode_values(m);
  if (d_.error != ERROR_NONE) return malformed(m, d_.error);
  if ((alone || !history_.complete()) && d_.low_cursor > 8 * meshlet_end(d_, m))
    return {"its data run past the start of the next meshlet", 0, m};
  if (alone) history_.look_up(false);
  out.new_count = history_.number(out.global, out.new_ids);
  if (out.new_count == History::kCircle) return malformed(m, ERROR_HOPS);
  if (!history_.append(out.global)) return {kNoMemory};
  return {};
}

// Finds how many vertices the outputs hold for meshlet m and those up to `end`, which overwrite
// what m writes too much. More than a meshlet needs makes no difference.
Problem BlobDecoder::count_room(uint32_t m, uint32_t end, const Outputs& out,
                                const Numbers& numbers, uint32_t& room) const {
  if (kBegins && out.vertex_begins) {
    const uint32_t* begins = out.vertex_begins;
    room = begins[end] - begins[m];
    if (begins[m + 1] - begins[m] != numbers.new_count || numbers.new_count > room ||
        out.triangle_begins[m + 1] - out.triangle_begins[m] != d_.triangle_count)
      return {"the meshlet has not the vertices and triangles that its begins say", 0, m};
    return {};
  }
  room = MESHLET_VERTICES * SerialDecoder::min(end - m, 2);
  if (begin_ > 0) return {};
  room = SerialDecoder::min(room, vertex_count_ - vertices_);
  if (numbers.new_count > room) return {kTooManyVertices};
  return {};
}

Problem BlobDecoder::decode(uint32_t first, uint32_t count, StreamRange streams, const Outputs& out,
                            DecodedCounts& counts) {
  if (out.meshlet) return decode_alone(first, count, streams, out);
  if ((first != next_ || out.vertex_begins != vertex_begins_) &&
      !start(first, out.first_vertex, out.vertex_begins))
    return {kNoMemory};
  next_ = NO_MESHLET;
  if (kBegins && out.vertex_begins && begin_ > 0) earlier_->begin(out, count);
  load_streams({});
  if (streams.end > stream_count_) streams.end = stream_count_;
  const uint32_t end = first + count, vertices_before = vertices_;
  uint32_t* triangles = out.triangles;
  uint32_t triangle_count = 0;
  for (uint32_t m = first; m < end; m++) {
    Numbers numbers;
    uint32_t room;
    if (kBegins && out.vertex_begins) history_.continue_at(out.vertex_begins[m]);
    if (const Problem problem = decode_next(m, false, numbers)) return problem;
    if (const Problem problem = count_room(m, end, out, numbers, room)) return problem;
#ifndef __wasm__
    if (out.shared) {
      for (uint32_t i = 0; i < numbers.new_count; i++) {
        const uint32_t v = numbers.global[numbers.new_ids[i]];
        out.shared[v] = v;
      }
      history_.note_shared(numbers.global, out.shared);
    }
#endif
    if (kBegins && out.triangle_begins && triangles)
      triangles = out.triangles + 3 * size_t(out.triangle_begins[m]);
    if (!kBegins || triangles) {
      write_triangles(d_, numbers.global, triangles);
      triangles += 3 * d_.triangle_count;
    }
#ifndef MESHLET_NO_BEGINS
    if (out.narrow_triangles) {
      const size_t first_of = out.triangle_begins ? out.triangle_begins[m] : triangle_count;
      write_narrow_triangles(d_, numbers.global, out.narrow_triangles + 3 * first_of);
    }
#endif
    triangle_count += d_.triangle_count;
    const uint32_t at =
        kBegins && out.vertex_begins ? out.vertex_begins[m] : vertices_ - vertices_before;
    const NewVertices added = {numbers.new_ids, numbers.new_count, at, room};
    write_vertices(d_, streams_, streams, added, out);
#ifndef MESHLET_NO_BEGINS
    if (out.attribute_count) write_attributes(d_, streams_, added, out, out.attribute_row + at);
    if (out.bounds) write_bounds(d_, streams_, out.bounds[m - first]);
#endif
    vertices_ += numbers.new_count;
  }
  counts = {triangle_count, vertices_ - vertices_before};
  if (end < meshlet_count_) {
    next_ = end;
    return {};
  }
  history_.clear();
  if (begin_ == 0 && vertices_ != vertex_count_) return {kTooFewVertices};
  return {};
}

Problem BlobDecoder::count_vertices(uint32_t first, uint32_t count, uint32_t* vertices) {
  if (!kBegins) return {"this build cannot count vertices"};
  load_streams({});
  if (!open_earlier() || !history_.start(first, 0, earlier_)) return {kNoMemory};
  next_ = NO_MESHLET;
  for (uint32_t m = first; m - first < count; m++) {
    if (!history_.reserve(m)) return {kNoMemory};
    d_.open_meshlet(m);
    if (d_.error == ERROR_NONE) locate_boundary(d_);
    if (d_.error != ERROR_NONE) return malformed(m, d_.error);
    history_.look_up(false);
    vertices[m - first] = history_.count_new();
  }
  history_.clear();
  return {};
}

Problem BlobDecoder::validate() {
  load_streams({});
  if (!start(0, 0, nullptr)) return {kNoMemory};
  for (uint32_t m = 0; m < meshlet_count_; m++) {
    Numbers numbers;
    if (const Problem problem = decode_next(m, true, numbers)) return problem;
    vertices_ += numbers.new_count;
    if (!history_.consistent()) return {"a shared vertex differs from its owner's", 0, m};
  }
  history_.clear();
  if (vertices_ > vertex_count_) return {kTooManyVertices};
  if (vertices_ < vertex_count_) return {kTooFewVertices};
  return {};
}

}  // namespace
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

// Writes the blob of a page in canonical form (spec/EXT_meshlet_transport.md, "Canonical form").
#ifndef TRANSPORT_BLOB_EMITTER_H
#define TRANSPORT_BLOB_EMITTER_H
#include "format/codes.h"
#include "transport/page.h"
#include "transport/resident_values.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

constexpr uint32_t kSpare = 8;  // bytes that may be touched behind those that are written or read

// Reads bits, the lowest first.
struct BitReader {
  const uint8_t* bytes;
  uint64_t at;

  // n <= 32.
  uint32_t take(uint32_t n) {
    uint64_t word;
    std::memcpy(&word, bytes + (at >> 3), 8);
    word >>= at & 7;
    at += n;
    return uint32_t(word & ((1ull << n) - 1));
  }
};

// Appends bits likewise. The bytes after its place must be writable.
class BitWriter {
 public:
  explicit BitWriter(uint8_t* place) : begin_(place), place_(place) {}
  uint64_t bits() const { return 8 * uint64_t(place_ - begin_) + filled_; }
  // value < 2^bits, bits <= 32.
  void put(uint32_t value, uint32_t bits) {
    word_ |= uint64_t(value) << filled_;
    filled_ += bits;
    std::memcpy(place_, &word_, 8);
    place_ += filled_ >> 3;
    word_ >>= filled_ & ~7u;
    filled_ &= 7;
  }
  void put_mask(uint64_t mask, uint32_t bits) {
    put(uint32_t(mask), std::min<uint32_t>(bits, 32));
    if (bits > 32) put(uint32_t(mask >> 32), bits - 32);
  }
  void put_unary(uint32_t quotient) {
    for (; quotient >= 31; quotient -= 31) put(0, 31);
    put(1u << quotient, quotient + 1);
  }
  void copy(BitReader& from, uint32_t bits) {
    for (; bits > 32; bits -= 32) put(from.take(32), 32);
    put(from.take(bits), bits);
  }
  // Fills the last byte with zeros; returns the place after it.
  uint8_t* align() {
    if (filled_) *place_++ = uint8_t(word_);
    filled_ = 0;
    word_ = 0;
    return place_;
  }

 private:
  uint8_t *begin_, *place_;
  uint64_t word_ = 0;
  uint32_t filled_ = 0;
};

class BlobEmitter {
 public:
  // The blob has `size` bytes and these streams and meshlets.
  // Returns false if there is no memory.
  bool begin(Page& page, size_t size);
  // Writes the bits of stream s of all meshlets, of which the page needs no values from then on.
  // Streams come in order. Returns false if the blob has fewer bytes.
  bool add_stream(uint32_t s);
  // Writes the blob. Returns false if it has another number of bytes.
  bool emit(uint8_t* out);

 private:
  struct Group {
    uint32_t flags, delta_width, slot_width, reference_width, table;
  };

  Group measure(uint32_t first, uint32_t end) const;
  uint32_t owned_vertices(const MeshletRow& m) const;
  uint8_t* emit_meshlet(uint8_t* place, uint32_t number, const Group& group);
  void emit_symbols(BitWriter& w, const MeshletRow& m, const Group& group) const;
  void emit_references(BitWriter& w, uint32_t number, uint32_t flags, const Group& group) const;
  void emit_anchors(BitWriter& w, const StreamRow& row);
  void emit_low(BitWriter& w, const List& list, const Code& code, uint32_t elements) const;
  void emit_unary(BitWriter& w, const List& list, const Code& code) const;
  Code emit_code(BitWriter& w, const List& list, const StreamRow& row, bool chain) const;
  uint32_t flags_of(const MeshletRow& m) const;
  bool whole(const Reference& r) const {
    return r.kind == kForeign && (r.shares & page_->all_streams()) == page_->all_streams();
  }

  // The bits of a stream of a meshlet, in the order in which the blob has them, between those of
  // the other streams.
  enum Part : uint8_t {
    kCodes,
    kAnchors,
    kChainLow,
    kChainUnary,
    kInteriorUnary,
    kInteriorLow,
    kParts
  };
  struct Lengths {
    uint16_t of[kParts];
  };
  // The shortest code of a list takes at most 32 bits and a little for each number.
  static constexpr size_t kStreamRoom = STREAM_MAX_ELEMENTS * (64 * 5 + 16) + kSpare;

  Page* page_ = nullptr;  // whose serial decoder predicts
  size_t size_ = 0;
  Buffer<uint8_t> bits_;     // of all streams
  uint8_t* bits_end_;        // of those so far
  Buffer<Lengths> lengths_;  // by stream and meshlet
  BitReader stream_[BLOB_MAX_STREAMS];
  Buffer<uint8_t> data_;  // of a group's meshlets
  ResidentValues values_;
};

inline uint32_t BlobEmitter::flags_of(const MeshletRow& m) const {
  uint32_t flags = 0;
  if (!m.stored_references) return 0;
  for (uint32_t j = 0; j < m.references; j++) {
    const Reference& r = page_->references[m.reference + j];
    if (r.loop_end && j + 1u < m.references) flags |= FLAG_LOOPS;
    if (r.kind == kPrivate) flags |= FLAG_PRIVATE;
    if (r.kind == kForeign && !whole(r)) flags |= FLAG_SEAMS;
  }
  return flags;
}

// A.8: the vertices that are no aliases.
inline uint32_t BlobEmitter::owned_vertices(const MeshletRow& m) const {
  uint32_t count = m.vertices;
  for (uint32_t j = 0; j < m.references; j++) {
    const Reference& r = page_->references[m.reference + j];
    if (whole(r)) count -= r.length - 1u;
    count -= whole(r) || whole(page_->before(r));
  }
  return count;
}

inline BlobEmitter::Group BlobEmitter::measure(uint32_t first, uint32_t end) const {
  Group g = {0, 0, 0, 0, 0};
  int32_t gain = 0;  // bits that symbol table 1 saves
  for (uint32_t number = first; number < end; number++) {
    const MeshletRow& m = page_->meshlets[number];
    g.flags |= flags_of(m);
    g.reference_width = std::max<uint32_t>(g.reference_width, bit_length(m.stored_references));
    gain += 2 * int32_t(count_of(m.symbols[kL])) - int32_t(count_of(m.symbols[kC])) -
            (int32_t(count_of(m.symbols[kE])) - 1);
    for (uint32_t j = 0; j < m.stored_references; j++) {
      const Reference& r = page_->references[m.reference + j];
      if (r.kind != kForeign) continue;
      const uint32_t delta = number - page_->references[r.partner].meshlet;
      g.delta_width = std::max<uint32_t>(g.delta_width, bit_length(delta));
      g.slot_width = std::max<uint32_t>(g.slot_width, bit_length(r.slot));
    }
  }
  g.table = gain > 0;
  return g;
}

inline void BlobEmitter::emit_symbols(BitWriter& w, const MeshletRow& m, const Group& group) const {
  const uint64_t* of = m.symbols;
  uint64_t rest = below(m.triangles - 1u);
  for (uint64_t zero : {of[kR], of[group.table ? kL : kC], of[group.table ? kC : kE], ~of[kS]}) {
#if MESHLET_AVX2
    w.put_mask(__builtin_ia32_pext_di(~zero, rest), count_of(rest));
#else
    for (uint64_t left = rest; left; left &= left - 1) w.put(~zero >> lowest(left) & 1, 1);
#endif
    rest &= ~zero;
  }
}

inline void BlobEmitter::emit_references(BitWriter& w, uint32_t number, uint32_t flags,
                                         const Group& group) const {
  const MeshletRow& m = page_->meshlets[number];
  const Reference* reference = &page_->references[m.reference];
  uint64_t foreign = 0, last = 0, is_private = 0, sized = 0;
  uint32_t width = 0;
  for (uint32_t j = 0; j < m.references; j++) {
    const Reference& r = reference[j];
    foreign |= uint64_t(r.kind == kForeign) << j;
    is_private |= uint64_t(r.kind == kPrivate) << j;
    last |= uint64_t(r.loop_end) << j;
    const bool alone = r.loop_end && (j == 0 || reference[j - 1].loop_end);
    if (r.kind == kForeign || (r.kind == kPrivate && alone)) continue;
    sized |= 1ull << j;
    width = std::max<uint32_t>(width, bit_length(r.length - 1u));
  }
  w.put_mask(foreign, m.references);
  if (flags & FLAG_LOOPS) w.put_mask(last, m.references);
  if (flags & FLAG_PRIVATE) w.put_mask(is_private, m.references);
  w.put(width, LENGTH_WIDTH_BITS);
  for (; sized; sized &= sized - 1) w.put(reference[lowest(sized)].length - 1u, width);
  for (; foreign; foreign &= foreign - 1) {
    const Reference& r = reference[lowest(foreign)];
    w.put(number - page_->references[r.partner].meshlet, group.delta_width);
    w.put(r.slot, group.slot_width);
    if (flags & FLAG_SEAMS)
      w.put_mask((r.shares & page_->all_streams()) >> 1, page_->stream_count() - 1);
  }
}

// Bits of the residuals under a code of chains or interiors; ~0 if it cannot hold them.
inline uint64_t bits_of(const List& list, const Code& code) {
  const uint32_t k = code.k;
  uint64_t quotients = 0;
  if (code.kind == Code::kRice) {
    if (list.length > k + bit_length(MAX_QUOTIENT)) return ~0ull;
    if (list.length > k) quotients = list.sum_of([=](const Eight& u) { return u >> k; });
  } else if (list.length >= 24) {
    for (uint32_t i = 0; i < list.count; i++) {
      if (k == 0 && list.u[i] == ~0u) return ~0ull;
      quotients += 2ull * code.quotient(list.u[i]);
    }
  } else if (list.length >= k) {  // a float's exponent is its bit length, and these are exact
    quotients = 2ull * list.sum_of([=](const Eight& u) {
      const EightFloats x = __builtin_convertvector(SignedEight(u + (1u << k)), EightFloats);
      return (Eight(x) >> 23) - (127 + k);
    });
  }
  return list.count * uint64_t(k + 1) + quotients;
}

// The code of the fewest bits, of several the one with the lowest number.
inline Code BlobEmitter::emit_code(BitWriter& w, const List& list, const StreamRow& row,
                                   bool chain) const {
  const uint32_t base = chain ? row.chain_base() : row.interior_base(), elements = row.elements();
  const CodedList coded = chain ? CodedList::kChain : CodedList::kInterior;
  uint32_t best = 0;
  uint64_t fewest = ~0ull;
  for (uint32_t field = 0; field < CODE_ESCAPE; field++) {
    const Code code = code_of_field(coded, field, base);
    if (code.k > CODE_MAX_PARAMETER || list.count * uint64_t(code.k + 1) >= fewest) continue;
    const uint64_t bits = bits_of(list, code);
    if (bits >= fewest) continue;
    fewest = bits;
    best = field;
  }
  Code fixed = {Code::kFixed, 0, {}};
  uint64_t bits = WIDTH_BITS * elements;
  for (uint32_t e = 0; e < elements; e++) {
    fixed.widths[e] = fixed_width(bit_length(list.any[e]));
    bits += uint64_t(fixed.widths[e]) * (list.count / elements);
  }
  if (bits < fewest) best = CODE_ESCAPE;
  w.put(best, CODE_BITS);
  if (best != CODE_ESCAPE) return code_of_field(coded, best, base);
  for (uint32_t e = 0; e < elements; e++)
    w.put(std::min<uint32_t>(fixed.widths[e], WIDTH_ESCAPE), WIDTH_BITS);
  return fixed;
}

inline void BlobEmitter::emit_anchors(BitWriter& w, const StreamRow& row) {
  List& list = values_.anchors;
  const uint32_t elements = row.elements(), bits = row.bits(), base = row.anchor_base();
  if (!list.count) return;
  for (uint32_t e = 0; e < elements; e++) w.put(list.u[e], bits);
  if (list.count == elements) return;
  uint32_t any[4] = {}, width[4];
  for (uint32_t i = elements; i < list.count; i++) {
    list.u[i] = zigzag(list.u[i] - list.u[i % elements], bits);
    any[i % elements] |= list.u[i];
  }
  for (uint32_t e = 0; e < elements; e++) {
    const uint32_t field = anchor_field(bit_length(any[e]), bits, base);
    width[e] = anchor_width(field, bits, base);
    w.put(field, ANCHOR_WIDTH_BITS);
  }
  for (uint32_t i = elements; i < list.count; i++) w.put(list.u[i], width[i % elements]);
}

inline void BlobEmitter::emit_low(BitWriter& w, const List& list, const Code& code,
                                  uint32_t elements) const {
  const uint32_t* u = list.u;
  uint32_t i = 0;
  if (code.kind == Code::kFixed) {
    for (; i < list.count; i++) w.put(u[i], code.widths[i % elements]);
  } else if (code.kind == Code::kRice) {
    const uint32_t k = code.k, low = (1u << k) - 1;
    if (k == 0) return;
    for (; k <= 10 && i + 3 <= list.count; i += 3)  // three at a time
      w.put((u[i] & low) | (u[i + 1] & low) << k | (u[i + 2] & low) << 2 * k, 3 * k);
    for (; i < list.count; i++) w.put(u[i] & low, k);
  } else {
    for (; i < list.count; i++) {
      const uint32_t bits = code.quotient(u[i]) + code.k;
      w.put((u[i] + (1u << code.k)) & uint32_t((1ull << bits) - 1), bits);
    }
  }
}

inline void BlobEmitter::emit_unary(BitWriter& w, const List& list, const Code& code) const {
  if (code.kind == Code::kFixed) return;
  uint32_t i = 0;
  for (; i + 3 <= list.count; i += 3) {  // three at a time
    const uint32_t p = code.quotient(list.u[i]), q = code.quotient(list.u[i + 1]),
                   r = code.quotient(list.u[i + 2]), bits = p + q + r + 3;
    if (bits <= 32) {
      w.put(1u << p | 1u << (p + q + 1) | 1u << (bits - 1), bits);
    } else {
      for (uint32_t quotient : {p, q, r}) w.put_unary(quotient);
    }
  }
  for (; i < list.count; i++) w.put_unary(code.quotient(list.u[i]));
}

inline bool BlobEmitter::begin(Page& page, size_t size) {
  page_ = &page;
  size_ = size;
  bits_.clear();
  lengths_.clear();
  data_.clear();
  // Connectivity and references of a meshlet take at most 1024 bytes.
  if (!bits_.reserve(size + kStreamRoom) ||
      !lengths_.reserve(uint64_t(page.stream_count()) * page.meshlets.size()) ||
      !data_.reserve(BLOB_GROUP_MESHLETS * 1024 + size + kStreamRoom))
    return false;
  bits_end_ = bits_.grow(size + kStreamRoom);
  return true;
}

inline bool BlobEmitter::add_stream(uint32_t s) {
  const StreamRow& row = page_->rows[s];
  const uint32_t elements = row.elements(), meshlets = page_->meshlets.size();
  const List &chains = values_.chains, &interior = values_.interior;
  const uint64_t room = 8 * uint64_t(bits_.data() + size_ - bits_end_);
  stream_[s] = {bits_end_, 0};
  BitWriter w(bits_end_);
  Lengths* lengths = lengths_.grow(meshlets);
  for (uint32_t i = 0; i < meshlets; i++) {
    const MeshletRow& m = page_->meshlets[i];
    uint64_t before = w.bits();
    if (before > room) return false;
    const auto end = [&](Part part) {
      lengths[i].of[part] = uint16_t(w.bits() - before);
      before = w.bits();
    };
    values_.compute(*page_, m, s);
    const Code chain = m.owned ? emit_code(w, chains, row, true) : Code{};
    const Code inner = emit_code(w, interior, row, false);
    end(kCodes);
    emit_anchors(w, row);
    end(kAnchors);
    emit_low(w, chains, chain, elements);
    end(kChainLow);
    emit_unary(w, chains, chain);
    end(kChainUnary);
    emit_unary(w, interior, inner);
    end(kInteriorUnary);
    emit_low(w, interior, inner, elements);
    end(kInteriorLow);
  }
  bits_end_ = w.align();
  return bits_end_ <= bits_.data() + size_;
}

// Returns the place after it.
inline uint8_t* BlobEmitter::emit_meshlet(uint8_t* place, uint32_t number, const Group& group) {
  const MeshletRow& m = page_->meshlets[number];
  const uint32_t streams = page_->stream_count(), flags = flags_of(m);
  BitWriter w(place);
  w.put(m.triangles - 1u, BLOB_TRIANGLE_BITS);
  w.put(m.stored_references, group.reference_width);
  for (uint32_t flag : {FLAG_LOOPS, FLAG_PRIVATE, FLAG_SEAMS})
    if (group.flags & flag) w.put((flags & flag) != 0, 1);
  emit_symbols(w, m, group);
  if (m.stored_references) emit_references(w, number, flags, group);
  const auto copy = [&](uint32_t part, uint32_t first, uint32_t end) {
    for (uint32_t s = first; s < end; s++)
      w.copy(stream_[s], lengths_[size_t(s) * page_->meshlets.size() + number].of[part]);
  };
  for (uint32_t part = 0; part < kInteriorUnary; part++) copy(part, 0, streams);
  for (uint32_t first : {0u, 1u})
    for (uint32_t part : {kInteriorUnary, kInteriorLow}) copy(part, first, first ? streams : 1);
  return w.align();
}

inline bool BlobEmitter::emit(uint8_t* out) {
  const Page& page = *page_;
  const size_t size = size_;
  const uint32_t streams = page.stream_count(), meshlets = page.meshlets.size(),
                 groups = (meshlets + BLOB_GROUP_MESHLETS - 1) / BLOB_GROUP_MESHLETS;
  const uint32_t group_table = BLOB_HEADER_BYTES + BLOB_STREAM_BYTES * streams,
                 tables = group_table + BLOB_GROUP_BYTES * groups;
  if (tables > size) return false;
  const uint32_t header[BLOB_HEADER_WORDS] = {
      BLOB_MAGIC, BLOB_VERSION | streams << 8, page.triangles.size(), 0, meshlets, 0, tables, 0};
  std::memcpy(out, header, sizeof header);
  std::memcpy(out + BLOB_HEADER_BYTES, page.rows.data(), BLOB_STREAM_BYTES * streams);
  size_t at = tables;
  uint32_t vertices = 0;
  data_.grow(BLOB_GROUP_MESHLETS * 1024 + size_t(bits_end_ - bits_.data()));
  const auto put_word = [&](size_t place, uint32_t word) { std::memcpy(out + place, &word, 4); };
  for (uint32_t g = 0; g < groups; g++) {
    const uint32_t first = g * BLOB_GROUP_MESHLETS,
                   count = std::min<uint32_t>(meshlets - first, BLOB_GROUP_MESHLETS);
    const Group group = measure(first, first + count);
    uint32_t starts[BLOB_GROUP_MESHLETS];
    uint8_t* end = data_.data();
    for (uint32_t i = 0; i < count; i++) {
      starts[i] = uint32_t(end - data_.data());
      vertices += owned_vertices(page.meshlets[first + i]);
      end = emit_meshlet(end, first + i, group);
    }
    const uint32_t length = uint32_t(end - data_.data());
    const GroupEntries in_group = entries_of(starts, count, length);
    const size_t row = group_table + BLOB_GROUP_BYTES * g;
    put_word(row, uint32_t(at));
    put_word(row + 4, in_group.stride | in_group.bias << 16);
    put_word(row + 8, in_group.width << GROUP_ENTRY_SHIFT | group.delta_width << GROUP_DELTA_SHIFT |
                          group.slot_width << GROUP_SLOT_SHIFT |
                          group.reference_width << GROUP_REFERENCE_SHIFT |
                          group.flags << GROUP_FLAGS_SHIFT | group.table << GROUP_TABLE_SHIFT);
    uint8_t entries[4 * BLOB_GROUP_MESHLETS + kSpare];
    BitWriter w(entries);
    for (uint32_t i = 0; i < count; i++) w.put(in_group.entry(i, starts[i]), in_group.width);
    const uint32_t entry_bytes = uint32_t(w.align() - entries);
    if (entry_bytes + length + BLOB_PADDING_BYTES > size - at) return false;
    std::memcpy(out + at, entries, entry_bytes);
    std::memcpy(out + at + entry_bytes, data_.data(), length);
    at += entry_bytes + length;
  }
  if ((at + BLOB_PADDING_BYTES + 3) / 4 * 4 != size) return false;
  std::memset(out + at, 0, size - at);
  put_word(4 * BLOB_WORD_VERTICES, vertices);
  put_word(4 * BLOB_WORD_BYTES, uint32_t(size));
  return true;
}

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

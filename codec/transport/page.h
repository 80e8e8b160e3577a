// A page, which is one blob of EXT_meshlet_edgebreaker, as arrays: triangles, references, the
// numbers of vertices and their integers. Both the packer and the unpacker fill one.
#ifndef TRANSPORT_PAGE_H
#define TRANSPORT_PAGE_H
#include "decode/memory.h"
#include "decode/serial_decoder.h"
#include "decode/vertex.h"
#include "transport/adaptive_coder.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

constexpr uint32_t kNone = ~0u;
enum Kind : uint8_t { kOwned, kForeign, kPrivate };
enum Symbol : uint8_t { kC, kL, kE, kR, kS };

inline uint32_t lowest(uint64_t mask) { return uint32_t(__builtin_ctzll(mask)); }
inline uint64_t below(uint32_t n) { return n < 64 ? (1ull << n) - 1 : ~0ull; }
// The n-th bit that is set, from 0 on; kNone if there are fewer.
inline uint32_t nth(uint64_t mask, uint32_t n) {
  for (; n > 0 && mask; n--) mask &= mask - 1;
  return mask ? lowest(mask) : kNone;
}

// A growing array whose new elements are not initialised, which may be more than an address
// counts.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  Buffer(const Buffer&) = delete;
  ~Buffer() { release(bytes_); }
  T& operator[](size_t i) { return data()[i]; }
  const T& operator[](size_t i) const { return data()[i]; }
  T* data() { return reinterpret_cast<T*>(bytes_); }
  const T* data() const { return reinterpret_cast<const T*>(bytes_); }
  // Only values may be more than 32 bits count: see grow.
  uint32_t size() const { return uint32_t(size_); }
  void clear() { size_ = 0; }
  void push(const T& value) { *grow(1) = value; }
  // Takes the memory of another buffer, which is empty then: in WebAssembly nothing is freed.
  void take(Buffer& other) {
    release(bytes_);
    bytes_ = other.bytes_;
    capacity_ = other.capacity_;
    size_ = 0;
    other.bytes_ = nullptr;
    other.capacity_ = other.size_ = 0;
  }
  // Makes room for so many elements in all. Returns false if there is no memory, of which more
  // bytes than an address counts are none.
  bool reserve(uint64_t count) {
    if (count < capacity_) return true;
    const uint64_t size = (count + 1) * sizeof(T);
    uint8_t* bytes = size > ~size_t(0) ? nullptr : static_cast<uint8_t*>(allocate(size_t(size)));
    if (!bytes) return false;
    if (size_) std::memcpy(bytes, bytes_, size_t(size_ * sizeof(T)));
    release(bytes_);
    bytes_ = bytes;
    capacity_ = count + 1;
    return true;
  }
  // Appends elements and returns the first of them; never null. The unpacker makes room before:
  // only the packer may end here without memory.
  T* grow(uint64_t count) {
    const uint64_t before = size_;
    if (before + count >= capacity_ && !reserve(2 * before + count)) out_of_memory();
    size_ = before + count;
    return data() + before;
  }

 private:
  uint8_t* bytes_ = nullptr;
  uint64_t capacity_ = 0, size_ = 0;
};

// A row of the blob's stream table.
struct StreamRow {
  uint32_t words[BLOB_STREAM_WORDS];

  uint32_t byte(uint32_t i) const { return words[i >> 2] >> 8 * (i & 3) & 255; }
  uint32_t kind() const { return byte(0); }
  uint32_t elements() const { return byte(1); }
  uint32_t bits() const { return byte(2); }
  uint32_t predictor() const { return byte(3); }
  uint32_t chain_base() const { return byte(4); }
  uint32_t interior_base() const { return byte(5); }
  uint32_t anchor_base() const { return byte(6); }
  uint32_t reserved() const { return byte(7); }
  uint32_t mask() const { return uint32_t((1ull << bits()) - 1); }
};

struct Reference {
  uint64_t shares;   // bit s: the values of stream s are the owner's; foreign ones only
  uint32_t partner;  // foreign: the owner's reference; owned: the last one that points at it
  uint32_t meshlet;
  uint8_t kind : 7, loop_end : 1;
  uint8_t slot;
  uint8_t length;                        // 0: not known yet
  uint8_t first, loop_begin, loop_size;  // border positions in the meshlet
  uint8_t next, previous;                // references of the meshlet, along the loop

  bool foreign(uint32_t s) const { return shares >> s & 1; }
};

// Its place in the arrays, its counts and masks.
struct MeshletRow {
  uint32_t triangle, vertex, reference, border, traversed, step;
  uint8_t triangles, vertices, references, stored_references, border_size, traversed_size, steps;
  uint64_t symbols[5];  // bit t: triangle t has the Symbol
  uint64_t shared;      // bit s: all foreign references share stream s
  uint64_t owned;       // bit j: reference j is an owned one
};

struct Stream {
  Buffer<uint32_t> id;      // per local vertex of all meshlets: the vertex's number
  Buffer<uint32_t> values;  // four per vertex
  uint32_t vertices;
  bool numbered_as_first;  // `id` is that of stream 0 and not filled here
};

// What predicts a meshlet's vertices in a stream.
struct Corners {
  uint32_t number[4 * MESHLET_TRIANGLES];  // per corner; at 4 p + 3: across border position p
  uint64_t known;  // bit p: it is of an earlier meshlet, and the stream has no seam there
};

struct Page {
  static constexpr uint8_t kAbsent = 255;

  Buffer<StreamRow> rows;
  Buffer<MeshletRow> meshlets;
  Buffer<uint32_t> triangles;  // packed as in serial_decoder.glsl
  Buffer<uint32_t> traversed;  // likewise: those that introduce a vertex, in the blob's order
  Buffer<Reference> references;
  Buffer<uint8_t> border;         // local ids of the loops
  Buffer<uint8_t> border_corner;  // the corner opposite to the edge that begins there, or kAbsent
  // Corner 4 t + k of a meshlet is vertex k of its triangle t. Four per triangle: the corner across
  // the edge opposite to a corner, the corner itself if there is none, or 4 p + 3 if it is that of
  // another meshlet, across border position p.
  Buffer<uint8_t> opposite;
  Stream streams[BLOB_MAX_STREAMS];
  SerialDecoder serial;  // of the last meshlet's connectivity

  uint32_t stream_count() const { return rows.size(); }
  uint64_t all_streams() const { return below(stream_count()); }

  void clear() {
    rows.clear();
    meshlets.clear();
    triangles.clear();
    traversed.clear();
    references.clear();
    border.clear();
    border_corner.clear();
    opposite.clear();
    for (Stream& s : streams) {
      s.id.clear();
      s.values.clear();
      s.vertices = 0;
      s.numbered_as_first = false;
    }
  }
  const Buffer<uint32_t>& ids(uint32_t s) const {
    return streams[streams[s].numbered_as_first ? 0 : s].id;
  }
  MeshletRow& begin_meshlet() {
    MeshletRow m = {};
    m.triangle = triangles.size();
    m.vertex = streams[0].id.size();
    m.reference = references.size();
    m.border = border.size();
    m.traversed = traversed.size();
    meshlets.push(m);
    return meshlets[meshlets.size() - 1];
  }
  // The least bytes that the blob has for the connectivity, the references and the codes of a
  // meshlet. It has a mask and a width for references, and a second code where one is owned.
  uint32_t least_bytes(const MeshletRow& m) const {
    const uint32_t stored = m.triangles - 1u, r = count_of(m.symbols[kR]),
                   e = count_of(m.symbols[kE]) - 1, s = count_of(m.symbols[kS]);
    const uint32_t symbols = 2 * stored - r + e + 2 * s,
                   references = m.stored_references ? m.stored_references + LENGTH_WIDTH_BITS : 0,
                   codes = CODE_BITS * stream_count() * (m.owned ? 2 : 1);
    return (BLOB_TRIANGLE_BITS + symbols + references + codes + 7) / 8;
  }
  // Of corner k of a packed triangle.
  static uint32_t local(uint32_t triangle, uint32_t k) { return triangle >> 8 * k & 255; }

  const Reference& before(const Reference& r) const {
    return references[meshlets[r.meshlet].reference + r.previous];
  }
  // The border position k edges along a run.
  static uint32_t along(const Reference& r, uint32_t k) {
    const uint32_t at = r.first + k;
    return at < uint32_t(r.loop_begin) + r.loop_size ? at : at - r.loop_size;
  }
  // The local vertex k edges along a run.
  uint32_t run_vertex(const MeshletRow& m, const Reference& r, uint32_t k) const {
    return border[m.border + along(r, k)];
  }

  // The three functions below take the last meshlet, in this order. Those that return a bool return
  // false if it is malformed, number_vertices too.

  bool decode_connectivity(MeshletRow& m);
  bool place_references(MeshletRow& m);  // and lists the traversed triangles
  void link_corners(const MeshletRow& m);

  // Numbers the vertices of stream s. Any time later, but in the order of meshlets.
  bool number_vertices(const MeshletRow& m, uint32_t s);
  void list_corners(const MeshletRow& m, uint32_t s, Corners& corners) const;

 private:
  uint32_t hop(uint32_t reference, uint32_t s) const;
};

// Needs the symbols.
inline bool Page::decode_connectivity(MeshletRow& m) {
  serial.error = ERROR_NONE;
  serial.triangle_count = m.triangles;
  serial.symbol_c = m.symbols[kC];
  serial.symbol_e = m.symbols[kE];
  serial.symbol_r = m.symbols[kR];
  serial.symbol_s = m.symbols[kS];
  serial.decode_apexes();
  if (serial.error != ERROR_NONE) return false;
  serial.decode_triangles();
  m.vertices = uint8_t(serial.vertex_count);
  m.border_size = uint8_t(count_of(serial.boundary));
  uint8_t* place = border.grow(m.border_size);
  for (uint64_t x = serial.boundary; x; x &= x - 1) *place++ = uint8_t(lowest(x));
  std::memcpy(triangles.grow(m.triangles), serial.triangles, 4u * m.triangles);
  return true;
}

// Sets the places of the references on the loops. The lengths of foreign ones are known.
inline bool Page::place_references(MeshletRow& m) {
  uint32_t at = 0, j = 0;
  uint64_t known = 0;  // vertices that are not traversed
  for (uint32_t d = 0; d < serial.disk_count; d++) {
    const uint64_t ids = below(serial.disk_first[d + 1]) & ~below(serial.disk_first[d]);
    const uint32_t size = count_of(serial.boundary & ids), begin = j;
    uint32_t sum = 0;
    for (bool last = false; !last; j++) {
      if (j >= m.references) return false;
      Reference& r = references[m.reference + j];
      last = r.loop_end;
      if (r.kind == kPrivate && last && j == begin) r.length = uint8_t(size);
      r.first = uint8_t(at + sum);
      r.loop_begin = uint8_t(at);
      r.loop_size = uint8_t(size);
      r.next = uint8_t(last ? begin : j + 1);
      sum += r.length;
      if (r.length == 0 || sum > size) return false;
      references[m.reference + r.next].previous = uint8_t(j);
      for (uint32_t k = 0; k < (r.kind == kPrivate ? 1u : r.length); k++)
        known |= 1ull << border[m.border + r.first + k];
    }
    if (sum != size) return false;
    at += size;
  }
  if (j != m.references) return false;
  serial.list_traversed(known);
  m.traversed_size = uint8_t(serial.traversed_count);
  std::memcpy(traversed.grow(m.traversed_size), serial.traversed, 4u * m.traversed_size);
  return serial.error == ERROR_NONE;
}

// The reference at whose start the corner of `reference` is, a hop on; kNone if it is stored.
inline uint32_t Page::hop(uint32_t reference, uint32_t s) const {
  const Reference &r = references[reference], &p = before(r);
  const bool x = r.foreign(s), y = p.foreign(s);
  if (!x && !y) return kNone;
  if (!x || (y && references[p.partner].meshlet < references[r.partner].meshlet)) return p.partner;
  const Reference& owner = references[r.partner];
  return meshlets[owner.meshlet].reference + owner.next;
}

inline bool Page::number_vertices(const MeshletRow& m, uint32_t s) {
  Stream& stream = streams[s];
  uint32_t* id = stream.id.grow(m.vertices);
  uint64_t alias = 0, inside = 0;  // inside: aliases of vertices of this meshlet
  uint8_t target[MESHLET_VERTICES];
  const auto name = [&](uint32_t v, const MeshletRow& owner, uint32_t w) {
    alias |= 1ull << v;
    inside &= ~(1ull << v);
    target[v] = uint8_t(w);
    if (&owner == &m)
      inside |= 1ull << v;
    else
      id[v] = stream.id[owner.vertex + w];
  };
  for (uint32_t j = m.reference; j < m.reference + m.references; j++) {
    const Reference& r = references[j];
    uint32_t h = hop(j, s);
    if (h != kNone) {
      for (uint32_t hops = 1; references[h].meshlet == r.meshlet; hops++) {
        const uint32_t further = hop(h, s);
        if (further == kNone) break;
        if (hops >= MAX_HOPS) return false;
        h = further;
      }
      const Reference& o = references[h];
      const MeshletRow& owner = meshlets[o.meshlet];
      name(border[m.border + r.first], owner, border[owner.border + o.first]);
    }
    if (!r.foreign(s)) continue;
    const Reference& o = references[r.partner];
    const MeshletRow& owner = meshlets[o.meshlet];
    for (uint32_t k = 1; k < r.length; k++)
      name(run_vertex(m, r, k), owner, run_vertex(owner, o, r.length - k));
  }
  for (uint64_t x = below(m.vertices) & ~alias; x; x &= x - 1) id[lowest(x)] = stream.vertices++;
  for (uint64_t x = inside; x; x &= x - 1) {
    const uint32_t v = lowest(x);
    uint32_t w = target[v];
    for (uint32_t steps = 0; inside >> w & 1; steps++) {
      if (steps >= MESHLET_VERTICES) return false;
      w = target[w];
    }
    id[v] = id[w];
  }
  return true;
}

// Of two equal directed edges in a meshlet the later one counts.
inline void Page::link_corners(const MeshletRow& m) {
  uint8_t edge[MESHLET_VERTICES][MESHLET_VERTICES];  // the corner opposite to a directed edge
  std::memset(edge, kAbsent, sizeof edge[0] * m.vertices);
  const uint32_t* triangle = &triangles[m.triangle];
  for (uint32_t t = 0; t < m.triangles; t++) {
    const uint32_t a = local(triangle[t], 0), b = local(triangle[t], 1), v = local(triangle[t], 2);
    edge[b][v] = uint8_t(4 * t);
    edge[v][a] = uint8_t(4 * t + 1);
    edge[a][b] = uint8_t(4 * t + 2);
  }
  uint8_t* across = opposite.grow(4u * m.triangles);
  for (uint32_t t = 0; t < m.triangles; t++) {
    const uint32_t a = local(triangle[t], 0), b = local(triangle[t], 1), v = local(triangle[t], 2);
    const uint8_t corners[3] = {edge[v][b], edge[a][v], edge[b][a]};
    for (uint32_t k = 0; k < 3; k++)
      across[4 * t + k] = corners[k] == kAbsent ? uint8_t(4 * t + k) : corners[k];
  }
  uint8_t* corner = border_corner.grow(m.border_size);
  for (uint32_t j = 0; j < m.references; j++) {
    const Reference& r = references[m.reference + j];
    for (uint32_t k = 0; k < r.length; k++)
      corner[along(r, k)] = edge[run_vertex(m, r, k)][run_vertex(m, r, k + 1)];
  }
  for (uint32_t j = 0; j < m.references; j++) {
    const Reference& r = references[m.reference + j];
    if (r.kind != kForeign) continue;
    const Reference& o = references[r.partner];
    const MeshletRow& owner = meshlets[o.meshlet];
    for (uint32_t k = 0; k < r.length; k++) {
      const uint32_t p = along(r, k), q = along(o, r.length - 1u - k);
      const uint8_t c = corner[p], d = border_corner[owner.border + q];
      if (c == kAbsent || d == kAbsent) continue;
      const bool inside = &owner == &m;
      across[c] = inside ? d : uint8_t(4 * p + 3);
      opposite[4 * owner.triangle + d] = inside ? c : uint8_t(4 * q + 3);
    }
  }
}

inline void Page::list_corners(const MeshletRow& m, uint32_t s, Corners& corners) const {
  const Buffer<uint32_t>& numbers = ids(s);
  const uint32_t* id = &numbers[m.vertex];
  for (uint32_t t = 0; t < m.triangles; t++)
    for (uint32_t k = 0; k < 3; k++)
      corners.number[4 * t + k] = id[local(triangles[m.triangle + t], k)];
  corners.known = 0;
  for (uint32_t j = 0; j < m.references; j++) {
    const Reference& r = references[m.reference + j];
    if (r.kind != kForeign || r.partner >= m.reference) continue;
    const Reference& o = references[r.partner];
    const MeshletRow& owner = meshlets[o.meshlet];
    const uint32_t* owner_id = &numbers[owner.vertex];
    for (uint32_t k = 0; k < r.length; k++) {
      const uint32_t p = along(r, k), back = r.length - 1u - k,
                     d = border_corner[owner.border + along(o, back)];
      if (d == kAbsent) continue;
      const bool seam =
          s > 0 && (id[run_vertex(m, r, k)] != owner_id[run_vertex(owner, o, back + 1)] ||
                    id[run_vertex(m, r, k + 1)] != owner_id[run_vertex(owner, o, back)]);
      corners.number[4 * p + 3] = owner_id[local(triangles[owner.triangle + (d >> 2)], d & 3)];
      corners.known |= uint64_t(!seam) << p;
    }
  }
}

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

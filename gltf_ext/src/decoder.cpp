#include "decoder.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace meshlet {
namespace {

constexpr uint32_t kBatch = 64;            // values of one lane of one meshlet

// What whole-blob decoding keeps of the meshlets behind it: their boundaries, which later ones refer to, as global vertex numbers and
// integer values. It saves looking up and decoding foreign vertices once more. References reach back no farther than the group
// table's delta widths allow, so a ring of meshlets suffices.
class History {
 public:
  History(MeshletDecoder& d, const BlobHeader& header);
  ~History() { d_.chain_lengths = nullptr; }

  // Between connect_meshlet and read_foreign: puts the values of earlier meshlets in place.
  void provide_foreign();

  // Numbers the meshlet's vertices: global[local id], and the local ids that are no aliases, in order (spec, appendix A.8).
  // Returns how many are none.
  uint32_t number(uint32_t* global, uint8_t* new_ids);

  // Keeps the decoded meshlet.
  void append(const uint32_t* global);

  // Do the decoded meshlet, which is kept already, and the owners of its foreign references agree on their shared vertices?
  bool consistent();

 private:
  struct Alias {
    uint32_t meshlet, place;
  };
  struct Slot {
    uint32_t numbers[64];                  // boundary vertices in loop order
    uint8_t start[64], end[64];            // per owned reference: places of its first and last vertex
    std::vector<uint32_t> values;          // lanes_ for each boundary vertex
  };

  Slot& slot(uint32_t meshlet) { return slots_[meshlet & d_.ring_mask]; }
  uint32_t start(uint32_t r) { return slot(d_.reference_owner[r]).start[d_.reference_slot[r]]; }
  uint32_t end(uint32_t r) { return slot(d_.reference_owner[r]).end[d_.reference_slot[r]]; }
  bool shares_all(uint32_t r) const;
  void alias_reference(uint32_t r);
  void copy_vertex(uint32_t r, uint32_t place, uint32_t id, bool all);
  bool same_vertex(uint32_t r, uint32_t place, uint32_t id);

  MeshletDecoder& d_;
  uint32_t lanes_ = 0;
  uint32_t next_ = 0;
  std::vector<Slot> slots_;
  std::vector<uint8_t> lengths_;           // 64 per slot
  Alias alias_[64];                        // per boundary place of the current meshlet
  uint64_t is_alias_ = 0;                  // boundary places
};

History::History(MeshletDecoder& d, const BlobHeader& header) : d_(d) {
  for (const Stream& s : header.streams) lanes_ += s.components;
  uint32_t reach = 0, size = 1;
  for (uint32_t m = 0; m < header.meshlet_count; m += kGroupMeshlets)
    reach = std::max(reach, d.load_word(d.group_table + 2 * (m / kGroupMeshlets) + 1) & 31u);
  while (size < header.meshlet_count && size < (1u << reach)) size *= 2;
  slots_.resize(size);
  lengths_.resize(64 * size_t(size));
  d_.ring_mask = size - 1;
  d_.chain_lengths = lengths_.data();
}

bool History::shares_all(uint32_t r) const {
  if (!(d_.opened.foreign_refs >> r & 1)) return false;
  for (uint32_t s = 1; s < d_.stream_total && (d_.opened.flags & FLAG_SEAMS); s++)
    if (!d_.shares(d_.opened, r, s)) return false;
  return true;
}

// Copies a vertex of r's owner, the streams that r shares.
void History::copy_vertex(uint32_t r, uint32_t place, uint32_t id, bool all) {
  const uint32_t* from = &slot(d_.reference_owner[r]).values[place * lanes_];
  if (all) {
    for (uint32_t lane = 0; lane < lanes_; lane++) d_.values[lane * 64u + id] = from[lane];
    return;
  }
  for (uint32_t s = 0; s < d_.stream_total; s++)
    for (uint32_t c = 0; c < d_.stream_components[s] && d_.shares(d_.opened, r, s); c++)
      d_.values[(d_.stream_lane[s] + c) * 64u + id] = from[d_.stream_lane[s] + c];
}

void History::provide_foreign() {
  for (uint64_t rest = d_.opened.foreign_refs; rest; rest &= rest - 1) {
    uint32_t r = d_.mask_lsb(rest), n = d_.reference_length[r];
    if (d_.reference_owner[r] == d_.opened.meshlet) continue;
    bool all = shares_all(r);
    copy_vertex(r, end(r), d_.loop_vertex[d_.reference_rank[r]], all);
    copy_vertex(r, start(r), d_.reference_end[r], all);
    for (uint32_t i = 1; i < n; i++) copy_vertex(r, start(r) + n - i, d_.inner_vertex(r, i), all);
    d_.provided_refs |= 1ull << r;
  }
}

void History::alias_reference(uint32_t r) {
  uint32_t before = d_.previous_reference(d_.opened, r), rank = d_.reference_rank[r];
  bool here = shares_all(r), there = shares_all(before);
  uint32_t way = here && there ? (d_.reference_owner[before] < d_.reference_owner[r] ? before : r) : here ? r : before;
  if (here || there) {
    alias_[rank] = {d_.reference_owner[way], way == r ? end(way) : start(way)};
    is_alias_ |= 1ull << rank;
  }
  for (uint32_t i = 1; here && i < d_.reference_length[r]; i++) {
    alias_[rank + i] = {d_.reference_owner[r], start(r) + d_.reference_length[r] - i};
    is_alias_ |= 1ull << (rank + i);
  }
}

uint32_t History::number(uint32_t* global, uint8_t* new_ids) {
  const MeshletDecoder::Header& h = d_.opened;
  Slot& self = slot(h.meshlet);
  uint8_t* length = &lengths_[64 * size_t(h.meshlet & d_.ring_mask)];
  std::memset(length, 0, 64);
  uint32_t i = 0;
  for (uint64_t rest = h.owned_refs; rest; rest &= rest - 1, i++) {   // before the aliases, which may lead to the meshlet itself
    uint32_t r = d_.mask_lsb(rest);
    self.start[i] = uint8_t(d_.reference_rank[r]);
    self.end[i] = uint8_t(d_.reference_rank[d_.next_reference(h, r)]);
    length[i] = uint8_t(d_.reference_length[r]);
  }
  is_alias_ = 0;
  for (uint32_t r = 0; r < h.references && h.foreign_refs; r++) alias_reference(r);
  uint64_t alias_ids = 0;
  for (uint64_t rest = is_alias_; rest; rest &= rest - 1) alias_ids |= 1ull << d_.loop_vertex[d_.mask_lsb(rest)];
  uint32_t count = 0;
  for (uint32_t id = 0; id < d_.vertex_count; id++) {
    new_ids[count] = uint8_t(id);
    global[id] = next_;
    uint32_t is_new = ~alias_ids >> id & 1;
    count += is_new;
    next_ += is_new;
  }
  for (uint64_t rest = is_alias_; rest; rest &= rest - 1) {
    uint32_t place = d_.mask_lsb(rest), hops = 0;
    Alias target = alias_[place];
    for (; target.meshlet == h.meshlet && (is_alias_ >> target.place & 1); target = alias_[target.place])
      if (++hops > MAX_HOPS) throw Malformed(error_text(ERROR_HOPS));
    global[d_.loop_vertex[place]] =
        target.meshlet == h.meshlet ? global[d_.loop_vertex[target.place]] : slot(target.meshlet).numbers[target.place];
  }
  return count;
}

void History::append(const uint32_t* global) {
  Slot& self = slot(d_.opened.meshlet);
  uint32_t places = d_.mask_count(d_.boundary);
  self.values.resize(places * lanes_);
  uint32_t* out = self.values.data();
  for (uint32_t i = 0; i < places; i++) {
    uint32_t id = d_.loop_vertex[i];
    self.numbers[i] = global[id];
    for (uint32_t lane = 0; lane < lanes_; lane++) *out++ = d_.values[lane * 64u + id];
  }
}

bool History::same_vertex(uint32_t r, uint32_t place, uint32_t id) {
  const uint32_t* owner = &slot(d_.reference_owner[r]).values[place * lanes_];
  for (uint32_t s = 0; s < d_.stream_total; s++)
    for (uint32_t c = 0; c < d_.stream_components[s] && d_.shares(d_.opened, r, s); c++)
      if (d_.values[(d_.stream_lane[s] + c) * 64u + id] != owner[d_.stream_lane[s] + c]) return false;
  return true;
}

bool History::consistent() {
  for (uint64_t rest = d_.opened.foreign_refs; rest; rest &= rest - 1) {
    uint32_t r = d_.mask_lsb(rest), n = d_.reference_length[r];
    if (!same_vertex(r, end(r), d_.loop_vertex[d_.reference_rank[r]]) || !same_vertex(r, start(r), d_.reference_end[r])) return false;
    for (uint32_t i = 1; i < n; i++)
      if (!same_vertex(r, start(r) + n - i, d_.inner_vertex(r, i))) return false;
  }
  return true;
}

// ---- from integers to values --------------------------------------------------------------------------------------------------

// The loops below run over whole batches of 8, so that compilers vectorise them; what lies behind the last vertex is not used.
uint32_t padded(uint32_t n) { return (n + 7) / 8 * 8; }

// Unit vectors from n octahedral pairs (spec, appendix A.9).
void decode_oct(const uint32_t* u, const uint32_t* v, uint32_t n, uint32_t bits, float (*out)[kBatch]) {
  const float scale = 2.0f / float((1u << bits) - 1u);
  for (uint32_t i = 0; i < padded(n); i++) {
    float x = float(int32_t(u[i])) * scale - 1.0f, y = float(int32_t(v[i])) * scale - 1.0f;
    float z = 1.0f - std::fabs(x) - std::fabs(y);
    float fold = z < 0.0f ? -z : 0.0f;
    x -= std::copysign(fold, x);
    y -= std::copysign(fold, y);
    float inverse = 1.0f / std::sqrt(x * x + y * y + z * z);
    out[0][i] = x * inverse;
    out[1][i] = y * inverse;
    out[2][i] = z * inverse;
  }
}

// One rounding at the end: offset + q * step is exact enough in double.
void decode_grid(const uint32_t* q, uint32_t n, double step, double offset, float* out) {
  for (uint32_t i = 0; i < padded(n); i++) out[i] = float(offset + double(int32_t(q[i])) * step);
}

void decode_float_bits(const uint32_t* q, uint32_t n, float* out) {
  for (uint32_t i = 0; i < n; i++) {
    uint32_t bits = q[i] >> 31 ? q[i] ^ 0x80000000u : ~q[i];
    std::memcpy(out + i, &bits, 4);
  }
}

// lanes: one array of n integers per component; out: n x value_components, float or uint32.
template <uint32_t components, class T>
void interleave(const T (*lanes)[kBatch], uint32_t n, T* out) {
  for (uint32_t i = 0; i < n; i++)
    for (uint32_t c = 0; c < components; c++) out[i * components + c] = lanes[c][i];
}

template <class T>
void interleave(const T (*lanes)[kBatch], uint32_t components, uint32_t n, T* out) {
  switch (components) {
    case 1: return interleave<1>(lanes, n, out);
    case 2: return interleave<2>(lanes, n, out);
    case 3: return interleave<3>(lanes, n, out);
    default: return interleave<4>(lanes, n, out);
  }
}

void write_values(const Stream& s, const uint32_t (*lanes)[kBatch], uint32_t n, void* out) {
  if (s.kind == kInteger) return interleave(lanes, s.components, n, static_cast<uint32_t*>(out));
  float reals[4][kBatch];
  if (s.kind == kOct) decode_oct(lanes[0], lanes[1], n, s.bits, reals);
  for (uint32_t c = 0; c < s.components && s.kind != kOct; c++) {
    if (s.kind == kGrid) decode_grid(lanes[c], n, s.step, s.offset[c], reals[c]);
    else if (s.kind == kFloat32) decode_float_bits(lanes[c], n, reals[c]);
    else decode_grid(lanes[c], n, 2.0, -1.0, reals[c]);
  }
  interleave(reals, value_components(s), n, static_cast<float*>(out));
}

}  // namespace

const char* error_text(uint32_t error) {
  switch (error) {
    case ERROR_OFFSET: return "a meshlet's data lie outside the blob";
    case ERROR_CLERS: return "a meshlet's CLERS symbols do not describe disks";
    case ERROR_VERTICES: return "a meshlet has more than 64 vertices";
    case ERROR_REFERENCES: return "a meshlet's references do not fit its boundary";
    case ERROR_OWNER: return "a reference leads to no owned boundary of an earlier meshlet";
    case ERROR_HOPS: return "a corner is more than 8 references away";
    case ERROR_CODE: return "a Rice parameter is above 31";
    case ERROR_UNARY: return "a meshlet's residuals run past the end of the blob";
    default: return "malformed";
  }
}

Decoder::Decoder(const uint8_t* data, size_t size) : header_(read_blob_header(data, size)), lane_(std::make_unique<MeshletDecoder>()) {
  lane_->data = data;
  lane_->size = uint32_t(size);
  lane_->load_streams(0, uint32_t(header_.streams.size()));
}

MeshletDecoder& Decoder::meshlet(uint32_t m) {
  lane_->decode_meshlet(m);
  check(m);
  return *lane_;
}

void Decoder::check(uint32_t m) const {
  if (lane_->error != ERROR_NONE) throw Malformed("meshlet " + std::to_string(m) + ": " + error_text(lane_->error));
}

// Values of the meshlet's new vertices to the arrays of the caller, from vertex `first` on.
void Decoder::write_vertices(const uint8_t* ids, uint32_t count, uint32_t first, uint32_t* const* integers, void* const* values) const {
  for (uint32_t s = 0; s < header_.streams.size(); s++) {
    const Stream& stream = header_.streams[s];
    uint32_t lanes[4][kBatch];
    for (uint32_t c = 0; c < stream.components; c++) {
      std::fill(lanes[c] + count, lanes[c] + padded(count), 0u);
      const uint32_t* lane = &lane_->values[(lane_->stream_lane[s] + c) * 64u];
      for (uint32_t i = 0; i < count; i++) lanes[c][i] = lane[ids[i]];
    }
    if (integers && integers[s]) interleave(lanes, stream.components, count, integers[s] + size_t(first) * stream.components);
    if (values && values[s])
      write_values(stream, lanes, count, static_cast<uint32_t*>(values[s]) + size_t(first) * value_components(stream));
  }
}

void Decoder::decode(uint32_t* triangles, uint32_t* const* integers, void* const* values) {
  MeshletDecoder& d = *lane_;
  History history(d, header_);
  uint32_t first = 0;                      // vertices before this meshlet
  for (uint32_t m = 0; m < header_.meshlet_count; m++) {
    d.open_meshlet(m);
    if (d.error == ERROR_NONE) d.connect_meshlet();
    check(m);
    history.provide_foreign();
    d.read_foreign();
    if (d.error == ERROR_NONE) d.read_own();
    check(m);
    uint32_t global[64];
    uint8_t new_ids[65];
    uint32_t count = history.number(global, new_ids);
    if (first + count > header_.vertex_count) throw Malformed("the blob has more vertices than its header says");
    history.append(global);
    for (uint32_t t = 0; t < d.triangle_count; t++, triangles += 3) {
      triangles[0] = global[d.triangles[t] & 255u];
      triangles[1] = global[d.triangles[t] >> 8 & 255u];
      triangles[2] = global[d.triangles[t] >> 16 & 255u];
    }
    write_vertices(new_ids, count, first, integers, values);
    first += count;
  }
  if (first != header_.vertex_count) throw Malformed("the blob has fewer vertices than its header says");
}

void Decoder::validate() {
  History history(*lane_, header_);
  uint32_t vertices = 0;
  for (uint32_t m = 0; m < header_.meshlet_count; m++) {
    meshlet(m);
    uint32_t global[64];
    uint8_t new_ids[65];
    vertices += history.number(global, new_ids);
    history.append(global);
    if (!history.consistent()) throw Malformed("meshlet " + std::to_string(m) + ": a shared vertex differs from its owner's");
  }
  if (vertices != header_.vertex_count) throw Malformed("the blob's vertices are not as many as its header says");
}

}  // namespace meshlet

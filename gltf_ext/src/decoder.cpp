#include "decoder.h"

#include <cmath>
#include <cstring>

namespace meshlet {
namespace {

constexpr uint32_t kBatch = 64;            // values of one lane of one meshlet

// The global vertex numbers of a decoded meshlet's boundary, kept for the meshlets that refer to it.
struct BoundaryNumbers {
  struct Chain {
    uint8_t start, length, end;            // places in the boundary: first vertex, and last vertex
  };
  std::vector<uint32_t> number_begin;      // per meshlet, into numbers
  std::vector<uint32_t> numbers;           // boundary vertices in loop order
  std::vector<uint32_t> chain_begin;       // per meshlet, into chains
  std::vector<Chain> chains;               // owned references, by slot
};

// An alias names a boundary place of another meshlet, or of its own.
struct Alias {
  uint32_t meshlet, place;
};

class Numbering {
 public:
  explicit Numbering(uint32_t meshlets) {
    boundary_.number_begin.reserve(meshlets);
    boundary_.chain_begin.reserve(meshlets);
  }

  // Global vertex numbers of meshlet m's local ids; new_ids: the local ids that are no aliases, in order.
  void number(MeshletDecoder& d, uint32_t m, uint32_t* global, uint8_t* new_ids, uint32_t& new_count);
  uint32_t vertex_count() const { return next_; }

 private:
  void alias_reference(MeshletDecoder& d, const MeshletDecoder::Header& h, uint32_t r);
  void alias_corner(MeshletDecoder& d, const MeshletDecoder::Header& h, uint32_t r, bool at_end, uint32_t place);
  void append_boundary(MeshletDecoder& d, const MeshletDecoder::Header& h);

  BoundaryNumbers boundary_;
  uint32_t next_ = 0;
  Alias alias_[64];                        // per boundary place of the current meshlet
  uint64_t is_alias_ = 0;                  // boundary places
};

bool shares_all(MeshletDecoder& d, const MeshletDecoder::Header& h, uint32_t r) {
  if (!(h.foreign_refs >> r & 1)) return false;
  for (uint32_t s = 1; s < d.stream_total && (h.flags & FLAG_SEAMS); s++)
    if (!d.shares(h, r, s)) return false;
  return true;
}

void Numbering::alias_corner(MeshletDecoder& d, const MeshletDecoder::Header&, uint32_t r, bool at_end, uint32_t place) {
  const auto& chain = boundary_.chains[boundary_.chain_begin[d.reference_owner[r]] + d.reference_slot[r]];
  alias_[place] = {d.reference_owner[r], at_end ? chain.end : chain.start};
  is_alias_ |= 1ull << place;
}

void Numbering::alias_reference(MeshletDecoder& d, const MeshletDecoder::Header& h, uint32_t r) {
  uint32_t before = d.previous_reference(h, r);
  bool from_r = shares_all(d, h, r), from_before = shares_all(d, h, before);
  uint32_t rank = d.reference_rank[r];
  if (from_r && from_before) from_r = d.reference_owner[before] >= d.reference_owner[r];
  if (from_r) alias_corner(d, h, r, true, rank);
  else if (from_before) alias_corner(d, h, before, false, rank);
  if (!shares_all(d, h, r)) return;
  uint32_t owner = d.reference_owner[r];
  const auto& chain = boundary_.chains[boundary_.chain_begin[owner] + d.reference_slot[r]];
  for (uint32_t i = 1; i < d.reference_length[r]; i++) {
    alias_[rank + i] = {owner, uint32_t(chain.start) + chain.length - i};
    is_alias_ |= 1ull << (rank + i);
  }
}

// Slots of meshlet m become known before its own aliases are looked at: they may lead to itself.
void Numbering::append_boundary(MeshletDecoder& d, const MeshletDecoder::Header& h) {
  boundary_.number_begin.push_back(uint32_t(boundary_.numbers.size()));
  boundary_.chain_begin.push_back(uint32_t(boundary_.chains.size()));
  for (uint64_t rest = h.owned_refs; rest; rest &= rest - 1) {
    uint32_t r = d.mask_lsb(rest);
    boundary_.chains.push_back({uint8_t(d.reference_rank[r]), uint8_t(d.reference_length[r]),
                                uint8_t(d.reference_rank[d.next_reference(h, r)])});
  }
}

void Numbering::number(MeshletDecoder& d, uint32_t m, uint32_t* global, uint8_t* new_ids, uint32_t& new_count) {
  MeshletDecoder::Header h = d.opened;
  append_boundary(d, h);
  is_alias_ = 0;
  for (uint32_t r = 0; r < h.references; r++)
    if (h.foreign_refs) alias_reference(d, h, r);
  uint32_t places = d.mask_count(d.boundary);
  uint64_t alias_ids = 0;
  uint8_t place_of[64];
  uint64_t ids = d.boundary;
  for (uint32_t place = 0; place < places; place++, ids &= ids - 1) {
    uint32_t id = d.mask_lsb(ids);
    place_of[place] = uint8_t(id);
    if (is_alias_ >> place & 1) alias_ids |= 1ull << id;
  }
  new_count = 0;
  for (uint32_t id = 0; id < d.vertex_count; id++) {
    if (alias_ids >> id & 1) continue;
    global[id] = next_++;
    new_ids[new_count++] = uint8_t(id);
  }
  size_t begin = boundary_.numbers.size();
  boundary_.numbers.resize(begin + places);
  for (uint64_t rest = is_alias_; rest; rest &= rest - 1) {
    uint32_t place = d.mask_lsb(rest);
    Alias target = alias_[place];
    for (uint32_t hop = 0; target.meshlet == m && (is_alias_ >> target.place & 1); hop++) {
      if (hop > MAX_HOPS) throw Malformed(error_text(ERROR_HOPS));
      target = alias_[target.place];
    }
    global[place_of[place]] =
        target.meshlet == m ? global[place_of[target.place]] : boundary_.numbers[boundary_.number_begin[target.meshlet] + target.place];
  }
  for (uint32_t place = 0; place < places; place++) boundary_.numbers[begin + place] = global[place_of[place]];
}

// ---- from integers to values --------------------------------------------------------------------------------------------------

// Unit vectors from n octahedral pairs (spec, appendix A.9).
void decode_oct(const uint32_t* u, const uint32_t* v, uint32_t n, uint32_t bits, float* out) {
  const float scale = 2.0f / float((1u << bits) - 1u);
  for (uint32_t i = 0; i < n; i++) {
    float x = float(int32_t(u[i])) * scale - 1.0f, y = float(int32_t(v[i])) * scale - 1.0f;
    float z = 1.0f - std::fabs(x) - std::fabs(y);
    float fold = z < 0.0f ? -z : 0.0f;
    x -= std::copysign(fold, x);
    y -= std::copysign(fold, y);
    float inverse = 1.0f / std::sqrt(x * x + y * y + z * z);
    out[3 * i] = x * inverse;
    out[3 * i + 1] = y * inverse;
    out[3 * i + 2] = z * inverse;
  }
}

// One rounding at the end: offset + q * step is exact enough in double.
void decode_grid(const uint32_t* q, uint32_t n, double step, double offset, float* out, uint32_t stride) {
  for (uint32_t i = 0; i < n; i++) out[i * stride] = float(offset + double(int32_t(q[i])) * step);
}

void decode_float_bits(const uint32_t* q, uint32_t n, uint32_t* out, uint32_t stride) {
  for (uint32_t i = 0; i < n; i++) out[i * stride] = q[i] >> 31 ? q[i] ^ 0x80000000u : ~q[i];
}

// lanes: one array of n integers per component.
void write_values(const Stream& s, const uint32_t (*lanes)[kBatch], uint32_t n, void* out) {
  float* reals = static_cast<float*>(out);
  if (s.kind == kOct) return decode_oct(lanes[0], lanes[1], n, s.bits, reals);
  for (uint32_t c = 0; c < s.components; c++) {
    if (s.kind == kGrid) decode_grid(lanes[c], n, s.step, s.offset[c], reals + c, s.components);
    else if (s.kind == kFloat32) decode_float_bits(lanes[c], n, static_cast<uint32_t*>(out) + c, s.components);
    else if (s.kind == kSign) decode_grid(lanes[c], n, 2.0, -1.0, reals + c, s.components);
    else for (uint32_t i = 0; i < n; i++) static_cast<uint32_t*>(out)[i * s.components + c] = lanes[c][i];
  }
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
  if (lane_->error != ERROR_NONE) throw Malformed("meshlet " + std::to_string(m) + ": " + error_text(lane_->error));
  return *lane_;
}

void Decoder::decode(uint32_t* triangles, uint32_t* const* integers, void* const* values) {
  Numbering numbering(header_.meshlet_count);
  uint32_t first = 0;                      // vertices before this meshlet
  for (uint32_t m = 0; m < header_.meshlet_count; m++) {
    MeshletDecoder& d = meshlet(m);
    uint32_t global[64], new_count = 0;
    uint8_t new_ids[64];
    numbering.number(d, m, global, new_ids, new_count);
    if (first + new_count > header_.vertex_count) throw Malformed("the blob has more vertices than its header says");
    for (uint32_t t = 0; t < d.triangle_count; t++, triangles += 3) {
      triangles[0] = global[d.triangle_a[t]];
      triangles[1] = global[d.triangle_b[t]];
      triangles[2] = global[d.triangle_v[t]];
    }
    for (uint32_t s = 0; s < header_.streams.size(); s++) {
      const Stream& stream = header_.streams[s];
      uint32_t lanes[4][kBatch];
      for (uint32_t c = 0; c < stream.components; c++)
        for (uint32_t i = 0; i < new_count; i++) lanes[c][i] = d.values[(d.stream_lane[s] + c) * 64u + new_ids[i]];
      if (integers && integers[s])
        for (uint32_t i = 0; i < new_count; i++)
          for (uint32_t c = 0; c < stream.components; c++) integers[s][(first + i) * stream.components + c] = lanes[c][i];
      if (values && values[s])
        write_values(stream, lanes, new_count, static_cast<uint32_t*>(values[s]) + size_t(first) * value_components(stream));
    }
    first += new_count;
  }
  if (first != header_.vertex_count) throw Malformed("the blob has fewer vertices than its header says");
}

}  // namespace meshlet

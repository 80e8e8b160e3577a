#include "format/blob.h"

#include <cmath>
#include <cstring>

namespace gltf_meshlet_codec {
namespace {

constexpr const char* kOverlap = "meshlets overlap or are out of order";

uint32_t word(const uint8_t* data, size_t byte) {
  uint32_t w;
  std::memcpy(&w, data + byte, 4);
  return w;
}

float real(const uint8_t* data, size_t byte) {
  float f;
  std::memcpy(&f, data + byte, 4);
  return f;
}

Stream parse_stream(const uint8_t* p) {
  Stream s;
  s.kind = p[0];
  s.elements = p[1];
  s.bits = p[2];
  s.predictor = p[3];
  s.chain_base = p[4];
  s.interior_base = p[5];
  s.anchor_base = p[6];
  s.step = real(p, 8);
  for (uint32_t c = 0; c < STREAM_MAX_ELEMENTS; c++) s.offset[c] = real(p, 12 + 4 * c);
  return s;
}

uint32_t group_count(uint32_t meshlets) {
  return (meshlets + BLOB_GROUP_MESHLETS - 1) / BLOB_GROUP_MESHLETS;
}

// The lowest `bits` <= 32 bits at bit `position`. The blob's padding covers the read.
uint32_t bits_at(const uint8_t* data, uint64_t position, uint32_t bits) {
  uint64_t w;
  std::memcpy(&w, data + position / 8, 8);
  return uint32_t(w >> position % 8 & ((1ull << bits) - 1));
}

// A row of the group table.
struct Group {
  uint32_t base, stride, bias, fields;
  uint32_t meshlets;

  Group(const uint8_t* data, uint32_t meshlet_count, uint32_t g) {
    const size_t at = BLOB_HEADER_BYTES + BLOB_STREAM_BYTES * data[kStreamCountByte] +
                      BLOB_GROUP_BYTES * size_t(g);
    base = word(data, at);
    stride = word(data, at + 4) & 0xFFFFu;
    bias = word(data, at + 4) >> 16;
    fields = word(data, at + 8);
    const uint32_t rest = meshlet_count - g * BLOB_GROUP_MESHLETS;
    meshlets = rest < BLOB_GROUP_MESHLETS ? rest : BLOB_GROUP_MESHLETS;
  }

  uint32_t entry_width() const { return fields >> GROUP_ENTRY_SHIFT & 31u; }
  // First byte after the entries, which must lie inside the blob.
  uint64_t data_begin() const { return base + (uint64_t(meshlets) * entry_width() + 7) / 8; }
  uint32_t start(const uint8_t* data, uint32_t i) const {
    return uint32_t(data_begin()) + stride * i - bias +
           bits_at(data, 8ull * base + uint64_t(i) * entry_width(), entry_width());
  }
};

// The functions below return the rule that is broken, or null.

const char* group_problem(const uint8_t* data, const Group& g, uint64_t end) {
  if ((g.fields >> GROUP_DELTA_SHIFT & 31u) > GROUP_MAX_DELTA_WIDTH ||
      (g.fields >> GROUP_SLOT_SHIFT & 7u) > GROUP_MAX_SLOT_WIDTH ||
      (g.fields >> GROUP_REFERENCE_SHIFT & 7u) > GROUP_MAX_REFERENCE_WIDTH ||
      g.fields >> GROUP_BITS != 0)
    return "a group table entry is out of range";
  if (g.data_begin() > end) return "a group's entries lie outside the blob";
  const uint64_t entries_end = 8ull * g.base + uint64_t(g.meshlets) * g.entry_width();
  if (bits_at(data, entries_end, uint32_t(8 * g.data_begin() - entries_end)) != 0)
    return "the padding of a group's entries is not 0";
  return nullptr;
}

// The triangles sum to the header's count; meshlets lie in order and inside the blob.
const char* groups_problem(const uint8_t* data, size_t size, const BlobCounts& h) {
  const uint64_t end = size - BLOB_PADDING_BYTES;
  uint64_t triangles = 0, least = h.data_offset;  // least: the next meshlet's smallest start
  for (uint32_t g = 0; g < group_count(h.meshlet_count); g++) {
    const Group group(data, h.meshlet_count, g);
    if (group.base < least) return kOverlap;
    if (const char* problem = group_problem(data, group, end)) return problem;
    least = group.data_begin();
    for (uint32_t i = 0; i < group.meshlets; i++) {
      const uint32_t start = group.start(data, i);
      if (start < least) return kOverlap;
      if (start >= end) return "a meshlet lies outside the blob";
      triangles += bits_at(data, 8ull * start, BLOB_TRIANGLE_BITS) + 1;
      least = start + 1ull;
    }
  }
  if (triangles != h.triangle_count)
    return "the meshlets' triangle counts do not sum to the header's";
  return nullptr;
}

// The header without its streams.
const char* read_counts(const uint8_t* data, size_t size, BlobCounts& h) {
  if (size < BLOB_HEADER_BYTES + BLOB_PADDING_BYTES) return "the blob is too short for a header";
  if (size % 4 != 0) return "the blob's length is not a multiple of 4";
  if (size > BLOB_MAX_BYTES) return "the blob is longer than 448 MiB";
  if (word(data, 0) != BLOB_MAGIC) return "the blob does not begin with EBM1";
  if (data[4] == BLOB_DRAFT_VERSION)
    return "the blob has version 1, a draft: make it again from its source with `gltf-meshlet "
           "compress`, or decompress it with the last commit of the draft, which CHANGELOG.md "
           "names";
  if (data[4] != BLOB_VERSION)
    return "the blob is of an unknown version; a newer release may read it";
  const uint32_t stream_count = data[kStreamCountByte];
  if (stream_count < 1 || stream_count > BLOB_MAX_STREAMS) return "the stream count is not 1 to 64";
  if (data[6] != 0 || data[7] != 0 || word(data, 28) != 0)
    return "a reserved field of the header is not 0";
  h.triangle_count = word(data, 4 * BLOB_WORD_TRIANGLES);
  h.vertex_count = word(data, 4 * BLOB_WORD_VERTICES);
  h.meshlet_count = word(data, 4 * BLOB_WORD_MESHLETS);
  h.data_offset = word(data, 4 * BLOB_WORD_DATA);
  if (word(data, 4 * BLOB_WORD_BYTES) != size) return "the header's byte length is not the blob's";
  if (h.meshlet_count < 1) return "the blob has no meshlets";
  if (h.meshlet_count > size) return "the blob is too short for its meshlet count";
  if (h.data_offset != data_offset(stream_count, h.meshlet_count))
    return "the data offset does not follow the tables";
  if (h.data_offset + BLOB_PADDING_BYTES > size) return "the blob is too short for its tables";
  if (word(data, size - 8) != 0 || word(data, size - 4) != 0)
    return "the blob does not end in 8 zero bytes";
  return nullptr;
}

}  // namespace

uint32_t data_offset(uint32_t streams, uint32_t meshlets) {
  return BLOB_HEADER_BYTES + BLOB_STREAM_BYTES * streams + BLOB_GROUP_BYTES * group_count(meshlets);
}

Problem stream_problem(const Stream& s) {
  if (s.kind >= KINDS) return {"unknown stream kind #", s.kind};
  if (s.elements < 1 || s.elements > STREAM_MAX_ELEMENTS)
    return {"a stream has # elements, not 1 to 4", s.elements};
  if (s.bits < 1 || s.bits > STREAM_MAX_BITS) return {"a stream has # bits, not 1 to 32", s.bits};
  if (s.predictor >= PREDICTORS) return {"unknown predictor #", s.predictor};
  if (s.bits > PREDICT_MAX_BITS && s.predictor != kCopy)
    return {"a stream of more than 24 bits must use the COPY predictor"};
  if (s.chain_base > CODE_MAX_PARAMETER || s.interior_base > CODE_MAX_PARAMETER ||
      s.anchor_base > CODE_MAX_PARAMETER)
    return {"a base of code parameters is above 31"};
  if (s.kind == kGrid && s.bits > GRID_MAX_BITS) return {"a GRID stream has more than 24 bits"};
  if (s.kind == kOct && (s.elements != 2 || s.bits < OCT_MIN_BITS || s.bits > OCT_MAX_BITS))
    return {"an OCT stream must have 2 elements of 2 to 16 bits"};
  if (s.kind == kFloat32 && s.bits != 32) return {"a FLOAT32 stream must have 32 bits"};
  if (s.kind == kSign && (s.bits != 1 || s.elements != 1))
    return {"a SIGN stream must have 1 element of 1 bit"};
  if (s.predictor == kGeo && s.kind != kOct) return {"the GEO predictor needs an OCT stream"};
  if (s.predictor == kAffine && (s.kind == kOct || s.kind == kSign))
    return {"an OCT or SIGN stream cannot use the AFFINE predictor"};
  if (!std::isfinite(s.step)) return {"a stream's step is not finite"};
  for (float o : s.offset)
    if (!std::isfinite(o)) return {"a stream's offset is not finite"};
  return {};
}

Problem streams_problem(const Stream* streams, size_t count) {
  bool from_positions = false;
  for (size_t s = 0; s < count; s++) {
    if (const Problem problem = stream_problem(streams[s])) return problem;
    from_positions = from_positions || streams[s].predictor >= kGeo;
  }
  const Stream& first = streams[0];
  if (first.predictor >= kGeo) return {"stream 0 cannot be predicted from positions"};
  if (from_positions && (first.kind != kGrid || first.elements != 3))
    return {"prediction from positions needs a GRID stream of 3 elements as stream 0"};
  return {};
}

Stream read_stream(const uint8_t* data, uint32_t s) {
  return parse_stream(data + BLOB_HEADER_BYTES + BLOB_STREAM_BYTES * s);
}

Problem read_blob_header(const uint8_t* data, size_t size, BlobHeader& h) {
  StreamTable streams;
  const Problem problem = read_blob_header(data, size, h, streams);
  h.streams.assign(streams.begin(), streams.end());
  return problem;
}

Problem read_blob_header(const uint8_t* data, size_t size, BlobCounts& h, StreamTable& streams) {
  streams.count = 0;
  if (const char* problem = read_counts(data, size, h)) return {problem};
  for (uint32_t s = 0; s < data[kStreamCountByte]; s++) {
    if (data[BLOB_HEADER_BYTES + BLOB_STREAM_BYTES * s + 7] != 0)
      return {"a reserved field of the stream table is not 0"};
    streams.rows[streams.count++] = read_stream(data, s);
  }
  if (const Problem problem = streams_problem(streams.rows, streams.count)) return problem;
  if (const char* problem = groups_problem(data, size, h)) return {problem};
  if (h.vertex_count < 3 || h.vertex_count > 3ull * h.triangle_count ||
      h.vertex_count > uint64_t(MESHLET_VERTICES) * h.meshlet_count)
    return {"the vertex count is impossible for the triangle count"};
  return {};
}

uint64_t decoded_bytes(const BlobCounts& counts, const StreamTable& streams) {
  uint64_t numbers = 3ull * counts.triangle_count;
  for (const Stream& s : streams) numbers += uint64_t(counts.vertex_count) * value_count(s);
  return sizeof(uint32_t) * numbers;
}

std::vector<uint32_t> meshlet_triangle_counts(const uint8_t* data, const BlobHeader& header) {
  std::vector<uint32_t> numbers(header.meshlet_count + size_t(1));
  list_triangle_begins(data, header.meshlet_count, 0, numbers.data());
  for (uint32_t m = 0; m < header.meshlet_count; m++) numbers[m] = numbers[m + 1] - numbers[m];
  numbers.pop_back();
  return numbers;
}

void list_triangle_begins(const uint8_t* data, uint32_t meshlet_count, uint32_t first,
                          uint32_t* begins) {
  *begins = first;
  for (uint32_t g = 0; g < group_count(meshlet_count); g++) {
    const Group group(data, meshlet_count, g);
    for (uint32_t i = 0; i < group.meshlets; i++, begins++)
      begins[1] = *begins + bits_at(data, 8ull * group.start(data, i), BLOB_TRIANGLE_BITS) + 1;
  }
}

void write_blob_header(const BlobHeader& h, std::vector<uint8_t>& blob) {
  auto put = [&](const void* p, size_t n) {
    blob.insert(blob.end(), static_cast<const uint8_t*>(p), static_cast<const uint8_t*>(p) + n);
  };
  auto put_word = [&](uint32_t w) { put(&w, 4); };
  put_word(BLOB_MAGIC);
  put_word(BLOB_VERSION | uint32_t(h.streams.size()) << 8);
  put_word(h.triangle_count);
  put_word(h.vertex_count);
  put_word(h.meshlet_count);
  put_word(0);
  put_word(h.data_offset);
  put_word(0);
  for (const Stream& s : h.streams) {
    const uint8_t shape[8] = {s.kind,       s.elements,      s.bits,        s.predictor,
                              s.chain_base, s.interior_base, s.anchor_base, 0};
    put(shape, 8);
    put(&s.step, 4);
    put(s.offset, 16);
  }
}

}  // namespace gltf_meshlet_codec

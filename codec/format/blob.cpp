#include "format/blob.h"

#include <cmath>
#include <cstring>

namespace meshlet {
namespace {

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

void require(bool ok, const char* problem) {
  if (!ok) throw Malformed(problem);
}

Stream read_stream(const uint8_t* p) {
  Stream s;
  s.kind = p[0];
  s.components = p[1];
  s.bits = p[2];
  s.predictor = p[3];
  s.chain_base = p[4];
  s.interior_base = p[5];
  require(p[6] == 0 && p[7] == 0, "a reserved field of the stream table is not 0");
  s.step = real(p, 8);
  for (int c = 0; c < 4; c++) s.offset[c] = real(p, 12 + 4 * c);
  std::string problem = stream_problem(s);
  if (!problem.empty()) throw Malformed(problem);
  return s;
}

// Directory: sum of triangles, starts in order and inside the data section.
void check_directory(const uint8_t* data, size_t size, const BlobHeader& h) {
  size_t groups = kHeaderBytes + kStreamBytes * h.streams.size();
  size_t group_count = (size_t(h.meshlet_count) + kGroupMeshlets - 1) / kGroupMeshlets;
  size_t directory = groups + kGroupBytes * group_count;
  uint64_t triangles = 0, previous_end = h.data_offset;
  for (uint32_t m = 0; m < h.meshlet_count; m++) {
    const uint8_t* group = data + groups + kGroupBytes * (m / kGroupMeshlets);
    if (m % kGroupMeshlets == 0)
      require(group[4] <= kMaxDeltaWidth && group[5] <= 6 && group[6] <= 8 && group[7] == 0,
              "a group table entry is out of range");
    uint32_t entry = word(data, directory + 4 * size_t(m));
    uint64_t begin = uint64_t(h.data_offset) + word(group, 0) +
                     (uint64_t(entry & ((1u << kOffsetBits) - 1)) << group[6]);
    uint32_t count = (entry >> kOffsetBits & 63) + 1;
    require(begin >= previous_end, "meshlets overlap or are out of order");
    previous_end = begin + (2 * count + 7) / 8;
    require(previous_end + 8 <= size, "a meshlet lies outside the blob");
    triangles += count;
  }
  require(triangles == h.triangle_count,
          "the directory's triangle counts do not sum to the header's");
}

}  // namespace

uint32_t data_offset_of(uint32_t streams, uint32_t meshlets) {
  return kHeaderBytes + kStreamBytes * streams +
         kGroupBytes * ((meshlets + kGroupMeshlets - 1) / kGroupMeshlets) + 4 * meshlets;
}

std::string stream_problem(const Stream& s) {
  if (s.kind >= kKinds) return "unknown stream kind " + std::to_string(s.kind);
  if (s.components < 1 || s.components > 4)
    return "a stream has " + std::to_string(s.components) + " components, not 1 to 4";
  if (s.bits < 1 || s.bits > 32)
    return "a stream has " + std::to_string(s.bits) + " bits, not 1 to 32";
  if (s.predictor >= kPredictors) return "unknown predictor " + std::to_string(s.predictor);
  if (s.bits > kMaxChordBits && s.predictor != kCopy)
    return "a stream of more than 24 bits must use the COPY predictor";
  if (s.chain_base > 31 || s.interior_base > 31) return "a Rice parameter base is above 31";
  if (s.kind == kGrid && s.bits > 24) return "a GRID stream has more than 24 bits";
  if (s.kind == kOct && (s.components != 2 || s.bits < 2 || s.bits > 16))
    return "an OCT stream must have 2 components of 2 to 16 bits";
  if (s.kind == kFloat32 && s.bits != 32) return "a FLOAT32 stream must have 32 bits";
  if (s.kind == kSign && (s.bits != 1 || s.components != 1))
    return "a SIGN stream must have 1 component of 1 bit";
  if (!std::isfinite(s.step)) return "a stream's step is not finite";
  for (float o : s.offset)
    if (!std::isfinite(o)) return "a stream's offset is not finite";
  return "";
}

BlobHeader read_blob_header(const uint8_t* data, size_t size) {
  require(size >= kHeaderBytes + 8, "the blob is too short for a header");
  require(size % 4 == 0, "the blob's length is not a multiple of 4");
  require(size < kMaxBlobBytes, "the blob is longer than 512 MiB");
  require(word(data, 0) == kMagic, "the blob does not begin with EBM1");
  require(data[4] == kVersion, "the blob is of an unknown version; a newer release may read it");
  uint32_t stream_count = data[5];
  require(stream_count >= 1 && stream_count <= 64, "the stream count is not 1 to 64");
  require(data[6] == 0 && data[7] == 0 && word(data, 28) == 0,
          "a reserved field of the header is not 0");
  BlobHeader h;
  h.triangle_count = word(data, 8);
  h.vertex_count = word(data, 12);
  h.meshlet_count = word(data, 16);
  h.data_offset = word(data, 24);
  require(word(data, 20) == size, "the header's byte length is not the blob's");
  require(h.meshlet_count >= 1, "the blob has no meshlets");
  require(h.meshlet_count <= size / 4, "the blob is too short for its meshlet count");
  require(h.data_offset == data_offset_of(stream_count, h.meshlet_count),
          "the data offset does not follow the tables");
  require(h.data_offset + 8 <= size, "the blob is too short for its tables");
  require(word(data, size - 8) == 0 && word(data, size - 4) == 0,
          "the blob does not end in 8 zero bytes");
  for (uint32_t s = 0; s < stream_count; s++)
    h.streams.push_back(read_stream(data + kHeaderBytes + kStreamBytes * s));
  check_directory(data, size, h);
  require(h.vertex_count >= 3 && h.vertex_count <= 3ull * h.triangle_count &&
              h.vertex_count <= 64ull * h.meshlet_count,
          "the vertex count is impossible for the triangle count");
  return h;
}

void write_blob_header(const BlobHeader& h, std::vector<uint8_t>& blob) {
  auto put = [&](const void* p, size_t n) {
    blob.insert(blob.end(), static_cast<const uint8_t*>(p), static_cast<const uint8_t*>(p) + n);
  };
  auto put_word = [&](uint32_t w) { put(&w, 4); };
  put_word(kMagic);
  put_word(kVersion | uint32_t(h.streams.size()) << 8);
  put_word(h.triangle_count);
  put_word(h.vertex_count);
  put_word(h.meshlet_count);
  put_word(0);
  put_word(h.data_offset);
  put_word(0);
  for (const Stream& s : h.streams) {
    const uint8_t shape[8] = {s.kind,       s.components,    s.bits, s.predictor,
                              s.chain_base, s.interior_base, 0,      0};
    put(shape, 8);
    put(&s.step, 4);
    put(s.offset, 16);
  }
}

}  // namespace meshlet

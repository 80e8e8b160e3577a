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
  s.elements = p[1];
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

uint32_t group_count(uint32_t meshlets) {
  return (meshlets + BLOB_GROUP_MESHLETS - 1) / BLOB_GROUP_MESHLETS;
}

uint32_t triangle_count_of_entry(uint32_t entry) {
  return (entry >> BLOB_OFFSET_BITS & (MESHLET_TRIANGLES - 1)) + 1;
}

// The triangles sum to the header's count; meshlets lie in order and inside the data section.
void check_directory(const uint8_t* data, size_t size, const BlobHeader& h) {
  size_t groups = BLOB_HEADER_BYTES + BLOB_STREAM_BYTES * h.streams.size();
  size_t directory = directory_offset(uint32_t(h.streams.size()), h.meshlet_count);
  uint64_t triangles = 0, previous_end = h.data_offset;
  for (uint32_t m = 0; m < h.meshlet_count; m++) {
    const uint8_t* group = data + groups + BLOB_GROUP_BYTES * (m / BLOB_GROUP_MESHLETS);
    if (m % BLOB_GROUP_MESHLETS == 0)
      require(group[4] <= GROUP_MAX_DELTA_WIDTH && group[5] <= GROUP_MAX_SLOT_WIDTH &&
                  group[6] <= GROUP_MAX_SHIFT && group[7] == 0,
              "a group table entry is out of range");
    uint32_t entry = word(data, directory + 4 * size_t(m));
    uint64_t begin = uint64_t(h.data_offset) + word(group, 0) +
                     (uint64_t(entry & ((1u << BLOB_OFFSET_BITS) - 1)) << group[6]);
    uint32_t count = triangle_count_of_entry(entry);
    require(begin >= previous_end, "meshlets overlap or are out of order");
    previous_end = begin + (2 * count + 7) / 8;
    require(previous_end + BLOB_PADDING_BYTES <= size, "a meshlet lies outside the blob");
    triangles += count;
  }
  require(triangles == h.triangle_count,
          "the directory's triangle counts do not sum to the header's");
}

}  // namespace

uint32_t directory_offset(uint32_t streams, uint32_t meshlets) {
  return BLOB_HEADER_BYTES + BLOB_STREAM_BYTES * streams + BLOB_GROUP_BYTES * group_count(meshlets);
}

uint32_t data_offset(uint32_t streams, uint32_t meshlets) {
  return directory_offset(streams, meshlets) + 4 * meshlets;
}

std::string stream_problem(const Stream& s) {
  if (s.kind >= KINDS) return "unknown stream kind " + std::to_string(s.kind);
  if (s.elements < 1 || s.elements > STREAM_MAX_ELEMENTS)
    return "a stream has " + std::to_string(s.elements) + " elements, not 1 to 4";
  if (s.bits < 1 || s.bits > STREAM_MAX_BITS)
    return "a stream has " + std::to_string(s.bits) + " bits, not 1 to 32";
  if (s.predictor >= PREDICTORS) return "unknown predictor " + std::to_string(s.predictor);
  if (s.bits > PREDICT_MAX_BITS && s.predictor != kCopy)
    return "a stream of more than 24 bits must use the COPY predictor";
  if (s.chain_base > RICE_MAX || s.interior_base > RICE_MAX)
    return "a Rice parameter base is above 31";
  if (s.kind == kGrid && s.bits > GRID_MAX_BITS) return "a GRID stream has more than 24 bits";
  if (s.kind == kOct && (s.elements != 2 || s.bits < OCT_MIN_BITS || s.bits > OCT_MAX_BITS))
    return "an OCT stream must have 2 elements of 2 to 16 bits";
  if (s.kind == kFloat32 && s.bits != 32) return "a FLOAT32 stream must have 32 bits";
  if (s.kind == kSign && (s.bits != 1 || s.elements != 1))
    return "a SIGN stream must have 1 element of 1 bit";
  if (!std::isfinite(s.step)) return "a stream's step is not finite";
  for (float o : s.offset)
    if (!std::isfinite(o)) return "a stream's offset is not finite";
  return "";
}

BlobHeader read_blob_header(const uint8_t* data, size_t size) {
  require(size >= BLOB_HEADER_BYTES + BLOB_PADDING_BYTES, "the blob is too short for a header");
  require(size % 4 == 0, "the blob's length is not a multiple of 4");
  require(size < BLOB_MAX_BYTES, "the blob is longer than 512 MiB");
  require(word(data, 0) == BLOB_MAGIC, "the blob does not begin with EBM1");
  require(data[4] == BLOB_VERSION,
          "the blob is of an unknown version; a newer release may read it");
  uint32_t stream_count = data[5];
  require(stream_count >= 1 && stream_count <= BLOB_MAX_STREAMS, "the stream count is not 1 to 64");
  require(data[6] == 0 && data[7] == 0 && word(data, 28) == 0,
          "a reserved field of the header is not 0");
  BlobHeader h;
  h.triangle_count = word(data, 4 * BLOB_WORD_TRIANGLES);
  h.vertex_count = word(data, 4 * BLOB_WORD_VERTICES);
  h.meshlet_count = word(data, 4 * BLOB_WORD_MESHLETS);
  h.data_offset = word(data, 4 * BLOB_WORD_DATA);
  require(word(data, 4 * BLOB_WORD_BYTES) == size, "the header's byte length is not the blob's");
  require(h.meshlet_count >= 1, "the blob has no meshlets");
  require(h.meshlet_count <= size / 4, "the blob is too short for its meshlet count");
  require(h.data_offset == data_offset(stream_count, h.meshlet_count),
          "the data offset does not follow the tables");
  require(h.data_offset + BLOB_PADDING_BYTES <= size, "the blob is too short for its tables");
  require(word(data, size - 8) == 0 && word(data, size - 4) == 0,
          "the blob does not end in 8 zero bytes");
  for (uint32_t s = 0; s < stream_count; s++)
    h.streams.push_back(read_stream(data + BLOB_HEADER_BYTES + BLOB_STREAM_BYTES * s));
  check_directory(data, size, h);
  require(h.vertex_count >= 3 && h.vertex_count <= 3ull * h.triangle_count &&
              h.vertex_count <= uint64_t(MESHLET_VERTICES) * h.meshlet_count,
          "the vertex count is impossible for the triangle count");
  return h;
}

std::vector<uint32_t> meshlet_triangle_counts(const uint8_t* data, const BlobHeader& header) {
  size_t directory = directory_offset(uint32_t(header.streams.size()), header.meshlet_count);
  std::vector<uint32_t> counts(header.meshlet_count);
  for (size_t m = 0; m < counts.size(); m++)
    counts[m] = triangle_count_of_entry(word(data, directory + 4 * m));
  return counts;
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
    const uint8_t shape[8] = {s.kind,       s.elements,      s.bits, s.predictor,
                              s.chain_base, s.interior_base, 0,      0};
    put(shape, 8);
    put(&s.step, 4);
    put(s.offset, 16);
  }
}

}  // namespace meshlet

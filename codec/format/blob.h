// The blob of one primitive: header and tables (spec, appendices A.2 to A.4), for encoder and
// decoder.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "format/constants.h"

namespace gltf_meshlet_codec {

static_assert(BLOB_HEADER_BYTES == 4 * BLOB_HEADER_WORDS);
static_assert(BLOB_STREAM_BYTES == 4 * BLOB_STREAM_WORDS);
static_assert(BLOB_GROUP_BYTES == 4 * BLOB_GROUP_WORDS);
static_assert(MESHLET_TRIANGLES == 1u << BLOB_TRIANGLE_BITS);
static_assert(MESHLET_MAX_REFERENCES == (1u << BLOB_REFERENCE_BITS) - 1u);

enum StreamKind : uint8_t {
  kGrid = KIND_GRID,
  kOct = KIND_OCT,
  kInteger = KIND_INTEGER,
  kFloat32 = KIND_FLOAT32,
  kSign = KIND_SIGN,
};

enum Predictor : uint8_t {
  kParallelogram = PREDICT_PARALLELOGRAM,
  kMean = PREDICT_MEAN,
  kCopy = PREDICT_COPY,
  kDamped = PREDICT_DAMPED,
  kGeo = PREDICT_GEO,
  kAffine = PREDICT_AFFINE,
};

// A row of the stream table.
struct Stream {
  uint8_t kind = kGrid;
  uint8_t elements = 1;  // integers per vertex, 1 to 4
  uint8_t bits = 1;      // per element, 1 to 32
  uint8_t predictor = kParallelogram;
  uint8_t chain_base = 0;     // of the parameters of chains' codes
  uint8_t interior_base = 0;  // of the parameters of interiors' codes
  uint8_t anchor_base = 0;    // of the widths of further anchors
  float step = 1.0f;          // GRID: value = offset + integer * step
  float offset[4] = {0, 0, 0, 0};
};

// Numbers that a vertex of the stream decodes to; OCT decodes two elements to three floats.
inline uint32_t value_count(const Stream& s) { return s.kind == kOct ? 3u : s.elements; }

struct BlobCounts {
  uint32_t triangle_count = 0;
  uint32_t vertex_count = 0;
  uint32_t meshlet_count = 0;
  uint32_t data_offset = 0;
};

struct BlobHeader : BlobCounts {
  std::vector<Stream> streams;
};

// The streams of a blob, for readers that allocate nothing.
struct StreamTable {
  uint32_t count = 0;
  Stream rows[BLOB_MAX_STREAMS];

  uint32_t size() const { return count; }
  const Stream& operator[](size_t s) const { return rows[s]; }
  const Stream* begin() const { return rows; }
  const Stream* end() const { return rows + count; }
};

// Bytes of the arrays that a blob decodes to.
uint64_t decoded_bytes(const BlobCounts& counts, const StreamTable& streams);

// Are these too many bytes to allocate by the headers of `size` bytes alone? Headers prove nothing:
// validate the meshlets first. Models decode to 10 to 20 times their size.
inline bool needs_proof(uint64_t decoded, uint64_t size) {
  return decoded > (32ull << 20) + 32 * size;
}

// A checked blob. Borrows its bytes.
struct Blob {
  const uint8_t* data;
  size_t size;
  BlobHeader header;
};

constexpr uint32_t kNoBlob = ~0u;

// The text of a Problem that is none of the bytes.
inline constexpr char kNoMemory[] = "there is not enough memory";

// A broken rule of the format. Readers return it and throw nothing: engines are built without
// exceptions. No string is built before it is shown: that code would be a tenth of
// web/decoder.wasm.
struct [[nodiscard]] Problem {
  const char* text = nullptr;  // null: no rule is broken. # stands for `number`.
  uint32_t number = 0;
  uint32_t meshlet = NO_MESHLET;  // the malformed meshlet, if it is one
  uint32_t blob = kNoBlob;        // its number, if the view has several

  explicit operator bool() const { return text != nullptr; }
};

// A problem as one sentence; none is longer than kSentence.
std::string sentence(const Problem& problem);
constexpr size_t kSentence = 512;
void write_sentence(const Problem& problem, char* out, size_t room);

// Byte offset of the first byte after the tables.
uint32_t data_offset(uint32_t streams, uint32_t meshlets);

// Returns the rule that a stream breaks, if any.
Problem stream_problem(const Stream& stream);

// Returns the rule that the streams of a blob break, if any.
Problem streams_problem(const Stream* streams, size_t count);

// Reads and checks header and tables of an untrusted blob: the tables lie inside it, meshlets
// follow one another without overlap, their triangle counts sum to the header's, and the counts are
// small enough to allocate by. Returns the rule that the blob breaks, if any; `out` is then not
// valid.
Problem read_blob_header(const uint8_t* data, size_t size, BlobHeader& out);
Problem read_blob_header(const uint8_t* data, size_t size, BlobCounts& counts,
                         StreamTable& streams);

constexpr uint32_t kStreamCountByte = 5;  // in the header

// Row `s` of a checked blob's stream table.
Stream read_stream(const uint8_t* data, uint32_t s);

// Number of triangles of each meshlet of a checked blob.
std::vector<uint32_t> meshlet_triangle_counts(const uint8_t* data, const BlobHeader& header);
// Likewise, added up: writes meshlet_count + 1 numbers, of which the first is `first`.
void list_triangle_begins(const uint8_t* data, uint32_t meshlet_count, uint32_t first,
                          uint32_t* begins);

// Appends header and stream table; leaves the header's byte length 0.
void write_blob_header(const BlobHeader& header, std::vector<uint8_t>& blob);

}  // namespace gltf_meshlet_codec

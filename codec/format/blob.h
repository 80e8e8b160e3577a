// The blob of one primitive: header and tables (spec, appendices A.2 to A.4), shared by encoder and
// decoder.
#pragma once
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "format/constants.h"  // in shaders/

namespace meshlet {

constexpr uint32_t kMagic = BLOB_MAGIC;
constexpr uint32_t kVersion = BLOB_VERSION;
constexpr uint32_t kHeaderBytes = BLOB_HEADER_BYTES;
constexpr uint32_t kStreamBytes = BLOB_STREAM_BYTES;
constexpr uint32_t kGroupBytes = BLOB_GROUP_BYTES;
constexpr uint32_t kGroupMeshlets = BLOB_GROUP_MESHLETS;
constexpr uint32_t kMaxBlobBytes = BLOB_MAX_BYTES;
constexpr uint32_t kOffsetBits = BLOB_OFFSET_BITS;
constexpr uint32_t kMaxReferences = 63;
constexpr uint32_t kMaxDeltaWidth = 24;

enum Kind : uint8_t {
  kGrid = KIND_GRID,
  kOct = KIND_OCT,
  kInteger = KIND_INTEGER,
  kFloat32 = KIND_FLOAT32,
  kSign = KIND_SIGN,
  kKinds = 5
};
enum Predictor : uint8_t { kParallelogram = 0, kMean = 1, kCopy = 2, kDamped = 3, kPredictors = 4 };
constexpr uint32_t kMaxChordBits = 24;  // streams of more bits must use kCopy

struct Stream {
  uint8_t kind = kGrid;
  uint8_t components = 1;
  uint8_t bits = 1;
  uint8_t predictor = kParallelogram;
  uint8_t chain_base = 0;
  uint8_t interior_base = 0;
  float step = 1.0f;
  float offset[4] = {0, 0, 0, 0};
};

struct BlobHeader {
  uint32_t triangle_count = 0;
  uint32_t vertex_count = 0;
  uint32_t meshlet_count = 0;
  uint32_t data_offset = 0;
  std::vector<Stream> streams;
};

struct Malformed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

uint32_t data_offset_of(uint32_t streams, uint32_t meshlets);

// One clear sentence about a stream that the format does not allow, or an empty string.
std::string stream_problem(const Stream& stream);

// Checks header and tables of an untrusted blob: every table lies inside it, the directory's
// triangle counts sum to the header's, meshlets follow one another without overlap. Throws
// Malformed. Bounds what a caller may allocate.
BlobHeader read_blob_header(const uint8_t* data, size_t size);

void write_blob_header(const BlobHeader& header,
                       std::vector<uint8_t>& blob);  // header and stream table, byte_length left 0

}  // namespace meshlet

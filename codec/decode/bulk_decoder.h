// The bulk decoder: whole blobs. bulk_decoder.cpp is compiled for the baseline and, on x86-64,
// again for AVX2.
#pragma once
#include "format/blob.h"
#include "decode/serial_decoder.h"

namespace meshlet {

// A checked blob and its outputs; see DecoderContext::decode.
struct BlobJob {
  const uint8_t* data;
  uint32_t size;
  uint32_t vertex_count, meshlet_count;
  uint32_t stream_count;
  const Stream* streams;
  uint32_t* triangles;
  uint32_t* const* integers;
  void* const* values;
};

enum class BlobProblem {
  kNone,
  kMalformedMeshlet,
  kTooManyVertices,
  kTooFewVertices,
  kInconsistent,
  kOverlap
};

struct BlobResult {
  BlobProblem problem = BlobProblem::kNone;
  uint32_t meshlet = 0;  // with the problem
  uint32_t error = 0;    // ERROR_ of a malformed meshlet
};

inline namespace MESHLET_BUILD {

// decode_meshlet of a SerialDecoder of any build: all have the same members.
void decode_one(void* decoder, uint32_t meshlet);

// Fills the job's outputs.
BlobResult decode_blob(const BlobJob& job);

// Decodes each meshlet alone and compares it with the meshlets that it refers to.
BlobResult validate_blob(const BlobJob& job);

}  // namespace MESHLET_BUILD
}  // namespace meshlet

// What is compiled for the baseline and, on x86-64, again for AVX2: the bulk decoder of whole
// blobs, and a decoder of single meshlets.
#pragma once
#include "format/blob.h"
#include "decode/build.h"
#include "decode/meshlet_decoder.h"

namespace meshlet {

// A checked blob, the range of its meshlets to decode, and its outputs; see DecoderContext::decode.
struct BlobJob {
  const uint8_t* data;
  uint32_t size;
  uint32_t vertex_count, meshlet_count;
  uint32_t begin, end;
  uint32_t stream_count;
  const Stream* streams;
  uint32_t* triangles;
  uint32_t* const* integers;
  void* const* values;
};

// Where a range of meshlets lies in the decoded blob.
struct DecodedRange {
  uint32_t first_triangle, triangle_count;
  uint32_t first_vertex, vertex_count;
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
  DecodedRange range{};
};

inline namespace MESHLET_BUILD {

// The caller deletes it.
MeshletDecoder* new_meshlet_decoder();

// Fills the job's outputs.
BlobResult decode_blob(const BlobJob& job);

// Decodes each meshlet alone and compares it with the meshlets that it refers to.
BlobResult validate_blob(const BlobJob& job);

}  // namespace MESHLET_BUILD
}  // namespace meshlet

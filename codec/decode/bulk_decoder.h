// What is compiled for the baseline and, on x86-64, again for AVX2: the bulk decoder of whole
// blobs, and a decoder of single meshlets.
#pragma once
#include "format/blob.h"
#include "decode/build.h"
#include "decode/meshlet_decoder.h"

namespace meshlet {

// A checked blob.
struct BlobJob {
  const uint8_t* data;
  uint32_t size;
  uint32_t vertex_count, meshlet_count;
  uint32_t stream_count;
  const Stream* streams;
};

// A vertex of a meshlet before a decoded range: OUTER_REFERENCE * slot + i for vertex i of the
// owned reference in that slot, or OUTER_REFERENCE * slot + 64 for its last vertex.
struct OuterVertex {
  uint32_t meshlet, place;
};
constexpr uint32_t OUTER_REFERENCE = 65;
// Their numbers, in the order of Outputs::outer, from here downwards.
constexpr uint32_t OUTER_FIRST = 0xFFFFFFFEu;

// The arrays for decoded meshlets; see DecoderContext::decode and start. outer: null if no meshlet
// comes before the range.
struct Outputs {
  uint32_t* triangles;
  uint32_t* const* integers;
  void* const* values;
  OuterVertex* outer;
};

// What was written to them. kept: kept_count meshlets' vertex numbers, of meshlet m at m modulo
// kept_count, as struct Kept; all later references to the range lead there.
struct DecodedPart {
  uint32_t triangle_count, vertex_count, outer_count;
  const void* kept;
  uint32_t kept_count;
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
  DecodedPart part{};
};

// Decodes a range of a blob's meshlets, part after part. Each build (decode/build.h) has its own.
class RangeDecoder {
 public:
  virtual ~RangeDecoder();

  // Decodes the next meshlets, those before `end`.
  virtual BlobResult decode(uint32_t end, const Outputs& outputs) = 0;
};

inline namespace MESHLET_BUILD {

// The caller deletes them.
MeshletDecoder* new_meshlet_decoder();
RangeDecoder* new_range_decoder(const BlobJob& job, uint32_t begin, uint32_t first_number);

// Decodes each meshlet alone and compares it with the meshlets that it refers to.
BlobResult validate_blob(const BlobJob& job);

}  // namespace MESHLET_BUILD
}  // namespace meshlet

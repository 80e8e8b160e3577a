// Decodes whole blobs. bulk_decoder.cpp is compiled for the baseline and, on x86-64, again for
// AVX2.
#pragma once
#include "format/blob.h"
#include "decode/serial_decoder.h"

namespace meshlet {

// A checked blob and where its triangles and values go; see Decoder::decode.
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
  none,
  malformed_meshlet,
  too_many_vertices,
  too_few_vertices,
  inconsistent
};

struct BlobResult {
  BlobProblem problem = BlobProblem::none;
  uint32_t meshlet = 0;  // where it was found
  uint32_t error = 0;    // of a malformed meshlet
};

// decode_blob fills the job's outputs; validate_blob decodes each meshlet alone and compares it
// with those that it refers to.
inline namespace MESHLET_BUILD {
BlobResult decode_blob(const BlobJob& job);
BlobResult validate_blob(const BlobJob& job);
}  // namespace MESHLET_BUILD

}  // namespace meshlet

// Writes planned meshlets as a blob.
#pragma once
#include <cstdint>
#include <vector>

#include "decode/bit_statistics.h"
#include "encode/meshlet_writer.h"
#include "encode/plan.h"
#include "format/blob.h"

namespace gltf_meshlet_codec {

struct WrittenBlob {
  std::vector<uint8_t> bytes;
  uint32_t meshlets = 0;
  uint32_t vertices = 0;  // decoded
  BitStatistics bits;
};

// Writes all meshlets of a primitive: chunks of kChunkMeshlets, in order; the last may have fewer.
// Uses up their residuals. Throws std::length_error if the blob would exceed the format's limit.
WrittenBlob write_blob(std::vector<PlanChunk>& chunks, const std::vector<Stream>& streams,
                       const Boundaries& boundaries, int threads);

}  // namespace gltf_meshlet_codec

// Meshlets -> streams -> bytes.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "decode/statistics.h"
#include "format/blob.h"
#include "encode/boundaries.h"
#include "segment/segment.h"

namespace meshlet {

constexpr uint8_t kChoosePredictor = 255;

struct EncodeOptions : GenerationOptions {
  bool share_seams =
      true;  // off: what crosses a seam is stored twice, to measure what sharing gives
};

struct EncoderStats {
  uint32_t meshlets = 0;
  uint32_t vertices = 0;  // decoded
  uint32_t histogram[4] = {0, 0, 0, 0};
  int iterations = 0;
  Description description;  // equal to describe() of the blob, without decoding it
};

// Encodes one primitive. streams: kind, components, bits, step, offset, and predictor or
// kChoosePredictor; stream 0 is the position. values: per stream, vertex_count x components
// integers below 2^bits. The mesh's triangles repeat no index; at least one triangle. Same bytes
// for any thread count, compiler and optimisation level. Throws std::invalid_argument, and
// std::length_error where the blob would exceed 512 MiB.
std::vector<uint8_t> encode(const MeshView& mesh, std::vector<Stream> streams,
                            const VertexValues& values, const EncodeOptions& options,
                            EncoderStats& stats);

}  // namespace meshlet

// The encoder: a mesh's integers to a blob.
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "decode/bit_statistics.h"
#include "encode/boundaries.h"
#include "format/blob.h"
#include "segment/generate_meshlets.h"

namespace meshlet {

// In place of a stream's predictor: the encoder chooses.
constexpr uint8_t kChoosePredictor = 255;

struct EncodeOptions : GenerationOptions {
  // Off: data on both sides of a seam are stored twice. Only to measure the gain of sharing.
  bool share_seams = true;
};

struct EncoderStats {
  uint32_t meshlets = 0;
  uint32_t vertices = 0;                 // decoded
  uint32_t histogram[4] = {0, 0, 0, 0};  // as in Meshlets
  int iterations = 0;                    // rounds of region growing
  // (stage, seconds) in the order of the stages: grow, join, boundaries, predict, write.
  std::vector<std::pair<const char*, double>> stage_seconds;
  BitStatistics bits;  // equal to count_bits of the blob, without decoding it
};

// Encodes one primitive of at least one triangle. Triangles repeat no index. Stream 0 is the
// position; a stream's predictor may be kChoosePredictor. values: vertex_count x elements integers
// below 2^bits per stream. Returns the same bytes for any number of threads, compiler and
// optimisation level. Throws std::invalid_argument, or std::length_error if the blob would exceed
// the format's limit.
std::vector<uint8_t> encode(const MeshView& mesh, std::vector<Stream> streams,
                            const VertexValues& values, const EncodeOptions& options,
                            EncoderStats& stats);

// The first half of `encode`: makes the meshlets and notes in `stats` how. `share`: of the
// progress.
Meshlets generate_for_encoder(const MeshView& mesh, const EncodeOptions& options, float share,
                              EncoderStats& stats);

// Encodes given meshlets, in their order, as one blob. They must be as generate_meshlets makes
// them: check_meshlets (segment/check_meshlets.h) checks those of a caller. Otherwise as `encode`.
std::vector<uint8_t> encode_meshlets(const MeshView& mesh, const Meshlets& meshlets,
                                     std::vector<Stream> streams, const VertexValues& values,
                                     const EncodeOptions& options, EncoderStats& stats);

}  // namespace meshlet

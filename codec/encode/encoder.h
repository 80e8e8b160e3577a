// The encoder: a mesh's integers to a blob.
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "decode/bit_statistics.h"
#include "encode/local_meshlet.h"
#include "encode/stream_choices.h"
#include "format/blob.h"
#include "segment/generate_meshlets.h"

namespace gltf_meshlet_codec {

struct EncodeOptions : GenerationOptions {
  // Off: data on both sides of a seam are stored twice. Only for bench, to measure the gain.
  bool share_seams = true;
};

struct EncoderStats {
  uint32_t meshlets = 0;
  uint32_t vertices = 0;                 // decoded
  uint32_t histogram[4] = {0, 0, 0, 0};  // as in Meshlets
  int iterations = 0;                    // rounds of region growing
  BitStatistics bits;                    // equal to count_bits of the blob, without decoding it
};

// A mesh in the order in which it is encoded, and its meshlets.
struct SegmentedMesh {
  SpatialMesh mesh;
  HalfEdges half_edges;
  Meshlets meshlets;

  // The values of the vertices in the mesh's order. Borrows from this object.
  VertexValues sorted(VertexValues values) const {
    values.rows = mesh.source_vertex.data();
    return values;
  }
};

// Throws std::invalid_argument, or std::length_error beyond a limit of the format.
void check_input(const MeshView& mesh, const std::vector<Stream>& streams);

// Encodes one primitive of at least one triangle. Triangles repeat no index. Stream 0 is the
// position; a stream's predictor may be kChoosePredictor. values: vertex_count x elements integers
// below 2^bits per stream, one row for each vertex. Returns the same bytes for any number of
// threads, compiler and optimisation level. Throws std::invalid_argument, or std::length_error if
// the blob would exceed the format's limit.
std::vector<uint8_t> encode(const MeshView& mesh, const std::vector<Stream>& streams,
                            const VertexValues& values, const EncodeOptions& options,
                            EncoderStats& stats);

// The first half of `encode`: makes the meshlets and notes in `stats` how. `share`: of the
// progress.
SegmentedMesh segment_for_encoder(const MeshView& mesh, const EncodeOptions& options, float share,
                                  EncoderStats& stats);

// The second half: encodes given meshlets, in their order, as one blob. They must be as
// generate_meshlets makes them: segment/check_meshlets.h checks those of a caller.
std::vector<uint8_t> encode_meshlets(const EncoderInput& input, const std::vector<Stream>& streams,
                                     const EncodeOptions& options, EncoderStats& stats);

}  // namespace gltf_meshlet_codec

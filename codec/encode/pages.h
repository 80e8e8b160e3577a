// Pages: a primitive as several blobs, each decodable without the others.
#pragma once
#include <cstdint>
#include <vector>

#include "encode/encoder.h"

namespace gltf_meshlet_codec {

using Bytes = std::vector<uint8_t>;

// Encodes the mesh as pages: blobs of at most `page_bytes` that hold neighbouring meshlets. Each
// page but the last is at least 94 % full, or has no room for another meshlet of its mean size; a
// meshlet that is larger than a page has a page of its own. References never leave a page: vertices
// on borders between pages are stored in each of them, with equal integers. Otherwise as `encode`.
std::vector<Bytes> encode_pages(const MeshView& mesh, const std::vector<Stream>& streams,
                                const VertexValues& values, const EncodeOptions& options,
                                size_t page_bytes, EncoderStats& stats);

// Encodes given meshlets, in their order. Group g holds meshlets group_begin[g] ..
// group_begin[g + 1]; the first begin is 0, the last one the number of meshlets. Pages hold whole
// groups in their order, as many as fit `page_bytes`, at least one; if it is 0, each holds one
// group. Throws std::invalid_argument for meshlets that are not as `Meshlets` says, or begins that
// do not increase.
std::vector<Bytes> encode_given(const MeshView& mesh, const Meshlets& meshlets,
                                const std::vector<uint32_t>& group_begin,
                                const std::vector<Stream>& streams, const VertexValues& values,
                                const EncodeOptions& options, size_t page_bytes,
                                EncoderStats& stats);

}  // namespace gltf_meshlet_codec

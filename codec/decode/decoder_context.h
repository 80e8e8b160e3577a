// Decodes a blob: everything, or single meshlets.
#pragma once
#include <memory>

#include "format/blob.h"
#include "decode/bulk_decoder.h"
#include "decode/meshlet_decoder.h"

namespace meshlet {

// One blob, open for decoding. Borrows the bytes. Not thread-safe: use one per thread.
class DecoderContext {
 public:
  DecoderContext(const uint8_t* data, size_t size);  // throws Malformed

  const BlobHeader& header() const { return header_; }

  // Decodes meshlet m. Throws Malformed.
  DecodedMeshlet meshlet(uint32_t m);

  // Decodes everything into the caller's arrays. triangles: 3 * triangle_count vertex numbers. Per
  // stream, integers[s]: vertex_count x elements, or values[s]: vertex_count x value_count (float,
  // or uint32 for INTEGER); null entries are skipped. Throws Malformed, also if the blob's counts
  // differ from its header's.
  void decode(uint32_t* triangles, uint32_t* const* integers, void* const* values);

  // As decode, only meshlets begin <= m < end, begin < end: the arrays get their triangles and new
  // vertices. Both arrays need room for 64 of each meshlet, or for the blob's. Vertex numbers are
  // the blob's. If the blob is valid, the results are the same as with one call for all meshlets.
  DecodedRange decode_range(uint32_t begin, uint32_t end, uint32_t* triangles,
                            uint32_t* const* integers, void* const* values);

  // Throws Malformed unless the blob is valid. Decodes each meshlet alone, so it also finds corners
  // that take too many hops and shared vertices that differ between meshlets; decode may not.
  void validate();

 private:
  BlobJob job() const;  // without outputs

  const uint8_t* data_;
  size_t size_;
  BlobHeader header_;
  std::unique_ptr<MeshletDecoder> decoder_;
};

// One sentence for an ERROR_ constant.
const char* error_text(uint32_t error);

}  // namespace meshlet

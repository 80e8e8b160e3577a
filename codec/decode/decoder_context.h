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

  // Begins to decode the meshlets from `begin` on, part after part with decode_next. Their new
  // vertices are numbered from first_number on. Vertices of meshlets before `begin` are not
  // decoded: they have the numbers from OUTER_FIRST downwards, in the order of Outputs::outer.
  void start(uint32_t begin, uint32_t first_number);

  // Decodes the next meshlets, those before `end`, to the beginnings of the arrays, which need room
  // for 64 triangles, vertices and outer vertices of each. If the blob is valid, the results are
  // the same as with one call for all meshlets. Throws Malformed, the counts of too few or too many
  // vertices only if start began with the first meshlet.
  DecodedPart decode_next(uint32_t end, const Outputs& outputs);

  // Throws Malformed unless the blob is valid. Decodes each meshlet alone, so it also finds corners
  // that take too many hops and shared vertices that differ between meshlets; decode may not.
  void validate();

 private:
  BlobJob job() const;  // without outputs

  const uint8_t* data_;
  size_t size_;
  BlobHeader header_;
  std::unique_ptr<MeshletDecoder> decoder_;  // made when it is needed: it zeroes 140 kB
  std::unique_ptr<RangeDecoder> range_;
};

// One sentence for an ERROR_ constant.
const char* error_text(uint32_t error);

}  // namespace meshlet

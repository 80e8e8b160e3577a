// Decoding whole blobs and single meshlets on the CPU.
#pragma once
#include <memory>

#include "format/blob.h"
#include "decode/bulk_decoder.h"
#include "decode/serial_decoder.h"

namespace meshlet {

// What one decoded vertex costs in a value buffer: OCT gives three floats for its two components.
inline uint32_t value_elements(const Stream& s) { return s.kind == kOct ? 3u : s.components; }

// One blob, opened for reading. The bytes are borrowed. Not thread-safe: one Decoder per thread.
class Decoder {
 public:
  Decoder(const uint8_t* data, size_t size);  // throws Malformed

  const BlobHeader& header() const { return header_; }

  // Decodes meshlet m; its triangles and values lie in the returned decoder until the next call.
  // Throws Malformed.
  SerialDecoder& meshlet(uint32_t m);

  // Decodes everything. triangles: 3 * triangle_count vertex numbers. For each stream, one of:
  // integers[s]: vertex_count x components, or values[s]: vertex_count x value_elements (float,
  // or uint32 for INTEGER). Null entries are left out. Throws Malformed, also where the blob's
  // counts are not those of its header.
  void decode(uint32_t* triangles, uint32_t* const* integers, void* const* values);

  // Throws Malformed unless the blob is valid. Finds, beyond what decode does, corners that take
  // too many hops and shared vertices that differ between meshlets: each meshlet is decoded alone,
  // as decode_meshlet does, and compared with those it refers to.
  void validate();

 private:
  void check(uint32_t m) const;
  BlobJob job() const;  // without outputs

  BlobHeader header_;
  std::unique_ptr<SerialDecoder> lane_;
};

const char* error_text(uint32_t error);

}  // namespace meshlet

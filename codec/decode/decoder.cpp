#include "decode/decoder.h"

namespace gltf_meshlet_codec {

const char* error_text(uint32_t error) {
  switch (error) {
    case ERROR_OFFSET: return "a meshlet's data lie outside the blob";
    case ERROR_CLERS: return "a meshlet's CLERS symbols do not describe disks";
    case ERROR_VERTICES: return "a meshlet has more than 64 vertices";
    case ERROR_REFERENCES: return "a meshlet's references do not fit its boundary";
    case ERROR_OWNER: return "a reference leads to no owned boundary of an earlier meshlet";
    case ERROR_HOPS: return "a corner is more than 8 references away";
    case ERROR_CODE: return "a code's parameter is above 31, or an exp-Golomb value too long";
    case ERROR_UNARY: return "a meshlet's residuals run past the end of the blob";
    default: return "malformed";
  }
}

Decoder::~Decoder() = default;

void Decoder::open(const uint8_t* data, size_t size, const BlobCounts& counts) {
  data_ = data;
  size_ = uint32_t(size);
  vertex_count_ = counts.vertex_count;
  meshlet_count_ = counts.meshlet_count;
  stream_count_ = data[kStreamCountByte];
  for (uint32_t s = 0; s < stream_count_; s++) streams_[s] = read_stream(data, s);
  opened();
}

Problem Decoder::decode(const Outputs& out) {
  DecodedCounts counts;
  return decode(0, meshlet_count_, {}, out, counts);
}

Problem Decoder::meshlet(uint32_t m, DecodedMeshlet& out, StreamRange streams) {
  DecodedCounts counts;
  Outputs outputs;
  outputs.meshlet = &out;
  return decode(m, 1, streams, outputs, counts);
}

}  // namespace gltf_meshlet_codec

// Decodes single meshlets with the fastest build of the serial decoder that the processor runs.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>

#include "format/constants.h"

namespace meshlet {

// A decoded meshlet. Borrows from its decoder until the next call.
struct DecodedMeshlet {
  uint32_t error;  // an ERROR_; nothing else is valid unless it is ERROR_NONE
  uint32_t triangle_count, vertex_count;
  const uint32_t* triangles;  // packed as in serial_decoder.glsl
  const uint32_t* values;
  const uint16_t* stream_element;

  // The integers of stream s of vertex `id`.
  const uint32_t* vertex(uint32_t s, uint32_t id) const {
    return values + MESHLET_VERTICES * stream_element[s] + STREAM_MAX_ELEMENTS * id;
  }
};

// Each build (decode/build.h) has its own.
class MeshletDecoder {
 public:
  virtual ~MeshletDecoder();

  // Opens a blob that read_blob_header has checked. Borrows the bytes.
  virtual void open(const uint8_t* data, size_t size) = 0;

  // Decodes meshlet m of the open blob.
  virtual DecodedMeshlet decode(uint32_t m) = 0;
};

std::unique_ptr<MeshletDecoder> make_meshlet_decoder();

}  // namespace meshlet

// Decodes a blob: all of it, a range of its meshlets, or single ones.
#pragma once
#include <memory>

#include "decode/bounds.h"
#include "decode/memory.h"
#include "decode/vertex_formats.h"
#include "format/blob.h"

namespace gltf_meshlet_codec {

// The streams [first, end) of a blob, without those that it does not have.
struct StreamRange {
  uint32_t first = 0, end = BLOB_MAX_STREAMS;
};

// A meshlet with local vertex numbers. Borrows from its decoder until the next call.
struct DecodedMeshlet {
  uint32_t triangle_count, vertex_count;
  const uint32_t* triangles;  // packed as in serial_decoder.glsl
  const uint32_t* values;
  const uint16_t* stream_element;

  // The integers of stream s of vertex `id`, STREAM_MAX_ELEMENTS for each vertex.
  const uint32_t* vertex(uint32_t s, uint32_t id) const {
    return values + MESHLET_VERTICES * stream_element[s] + STREAM_MAX_ELEMENTS * id;
  }
};

// The arrays that decode writes. Lists have an array per stream; null arrays and lists are skipped.
struct Outputs {
  uint32_t* triangles = nullptr;        // 3 vertex numbers for each triangle
  uint32_t* const* integers = nullptr;  // vertices x elements
  void* const* values = nullptr;  // vertices x value_count floats, or uint32 for INTEGER streams
  uint32_t first_vertex = 0;      // is added to vertex numbers; later calls keep it
  // The numbers of the first triangle and of the first new vertex of each meshlet of the blob, and
  // of what follows the last one. With them, numbers and places are those of the whole view
  // whatever was decoded before, and first_vertex has no meaning. vertex_limit: of the whole view;
  // begins that lead to it or beyond are refused.
  const uint32_t *triangle_begins = nullptr, *vertex_begins = nullptr;
  uint32_t vertex_limit = 0;
  // By vertex number: itself, or an earlier vertex that has its position by a reference. To follow
  // them leads to the first vertex of all that share it.
  uint32_t* shared = nullptr;
  // Instead of the arrays of vertices and triangles: receives the last meshlet.
  DecodedMeshlet* meshlet = nullptr;
  uint16_t* narrow_triangles = nullptr;  // in place of `triangles`; numbers are below 2^16
  // Streams in the caller's layout. attribute_row: where the first vertex goes, or the vertex of
  // number 0 with begins.
  const VertexAttribute* attributes = nullptr;
  uint32_t attribute_count = 0;
  size_t attribute_row = 0;
  MeshletBounds* bounds = nullptr;  // of each decoded meshlet, in order
};

struct DecodedCounts {
  uint32_t triangles = 0, vertices = 0;
};

// Decodes one blob at a time. Not thread-safe: use one per thread. There is an implementation for
// each instruction set (processors.cpp), with two ways inside: whole ranges reuse the vertices of
// earlier meshlets; a single meshlet is decoded alone.
class Decoder : public Allocated {
 public:
  virtual ~Decoder();

  // Opens a checked blob and borrows its bytes.
  void open(const uint8_t* data, size_t size, const BlobCounts& counts);
  void open(const Blob& blob) { open(blob.data, blob.size, blob.header); }

  // Decodes the meshlets [first, first + count), which must exist, and writes the given streams.
  // Returns the rule that the blob breaks, if any; then arrays and counts are not valid.
  //
  // To arrays: vertices are numbered in the order of their first meshlets, and shared vertices are
  // written once. A call that begins where the last one ended continues its numbers, but writes to
  // the beginning of the arrays. Any other call begins anew at 0; its meshlets have copies of the
  // vertices that they share with meshlets before `first`. The arrays need room for 64 triangles
  // and vertices of each meshlet, or for those of the whole blob if it is decoded by one call.
  // With the last meshlet, calls since meshlet 0 must have written as many vertices as the header
  // says.
  //
  // To arrays of the whole view, with begins: each vertex and triangle once, at its number.
  //
  // To out.meshlet: each meshlet is decoded alone. Attributes and bounds are those of the last one.
  virtual Problem decode(uint32_t first, uint32_t count, StreamRange streams, const Outputs& out,
                         DecodedCounts& counts) = 0;

  // The next call to decode to arrays begins anew.
  virtual void restart() = 0;

  // Counts the new vertices of the meshlets [first, first + count), which must exist, into
  // vertices[0] .. vertices[count - 1]: those that no earlier meshlet has. Decodes no values, and
  // finds only the errors that hide these numbers.
  virtual Problem count_vertices(uint32_t first, uint32_t count, uint32_t* vertices) = 0;

  // Decodes the whole blob to arrays.
  Problem decode(const Outputs& out);

  // Decodes meshlet m alone.
  Problem meshlet(uint32_t m, DecodedMeshlet& out, StreamRange streams = {});

  // Bytes of this object, without those that it allocates to decode a range.
  virtual size_t bytes() const = 0;

  // Returns the rule that the blob breaks, if any. Decodes each meshlet alone, so it also finds
  // corners that take too many hops and shared vertices that differ between meshlets; decode may
  // not.
  virtual Problem validate() = 0;

 protected:
  virtual void opened() = 0;

  // The open blob.
  const uint8_t* data_ = nullptr;
  uint32_t size_ = 0, vertex_count_ = 0, meshlet_count_ = 0, stream_count_ = 0;
  Stream streams_[BLOB_MAX_STREAMS];
};

// A decoder with the fastest instructions that the processor has; null if there is no memory.
std::unique_ptr<Decoder> make_decoder();

// One sentence for an ERROR_ constant.
const char* error_text(uint32_t error);

}  // namespace gltf_meshlet_codec

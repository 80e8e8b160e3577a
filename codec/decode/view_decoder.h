// Decodes a buffer view: one blob, or several back to back (pages).
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "decode/decoder_context.h"

namespace meshlet {

// One blob of a view. Its vertices and triangles follow those of the blobs before it.
struct ViewBlob {
  const uint8_t* data;
  size_t size;
  BlobHeader header;
  uint64_t first_vertex, first_triangle, first_meshlet;
};

// A view, open for decoding. Borrows the bytes.
class ViewDecoder {
 public:
  // Reads all headers. Throws Malformed unless the blobs fill the view, have the same streams
  // (predictors and bases may differ), and sum to counts below 2^32.
  ViewDecoder(const uint8_t* data, size_t size);

  const std::vector<ViewBlob>& blobs() const { return blobs_; }
  const std::vector<Stream>& streams() const { return blobs_.front().header.streams; }
  uint64_t triangle_count() const { return triangle_count_; }
  uint64_t vertex_count() const { return vertex_count_; }
  uint64_t meshlet_count() const { return meshlet_count_; }

  // The number of the blob that holds meshlet m, which must exist.
  size_t blob_of_meshlet(uint64_t m) const;

  // As DecoderContext's, for one blob, into the whole view's arrays. Several threads may decode
  // different blobs.
  void decode(size_t blob, uint32_t* triangles, uint32_t* const* integers,
              void* const* values) const;
  void validate(size_t blob) const;

  // For an error in a blob: the blob's number if there are several, then the problem.
  std::string named(size_t blob, const char* problem) const;

 private:
  std::vector<ViewBlob> blobs_;
  uint64_t triangle_count_ = 0, vertex_count_ = 0, meshlet_count_ = 0;
};

// Decodes single meshlets of a view, which it borrows. Not thread-safe: use one per thread.
class ViewMeshlets {
 public:
  explicit ViewMeshlets(const ViewDecoder& view) : view_(view), decoder_(make_meshlet_decoder()) {}

  // As DecoderContext::meshlet. Numbers count on through the blobs; m must exist.
  DecodedMeshlet meshlet(uint64_t m);

 private:
  const ViewDecoder& view_;
  std::unique_ptr<MeshletDecoder> decoder_;
  size_t blob_ = SIZE_MAX;  // that the decoder is open on
};

}  // namespace meshlet

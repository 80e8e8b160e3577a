// A buffer view: one blob, or several back to back (pages).
#pragma once
#include <vector>

#include "decode/decoder.h"

namespace meshlet {

// The blobs of a view. Borrows the bytes. Vertices, triangles and meshlets are numbered on through
// the blobs.
struct View {
  std::vector<Blob> blobs;
  uint64_t triangle_count = 0, vertex_count = 0, meshlet_count = 0;

  // Reads all headers. Call once. Returns the rule that the view breaks, if any: the blobs fill it,
  // have the same streams (predictors and bases may differ), and sum to counts below 2^32.
  Problem open(const uint8_t* data, size_t size);

  const std::vector<Stream>& streams() const { return blobs.front().header.streams; }

  // The number of the blob that holds meshlet m, which must exist.
  size_t blob_of_meshlet(uint64_t m) const;

  // Decoder's decode of one blob into the arrays of the whole view. Several threads may decode
  // different blobs.
  Problem decode(size_t blob, const Outputs& out) const;

  // Returns the rule that the blob breaks, if any.
  Problem validate(size_t blob) const;

  // A blob's problem, which names the blob if there are several.
  Problem located(Problem problem, size_t blob) const {
    if (problem && blobs.size() > 1) problem.blob = uint32_t(blob);
    return problem;
  }
};

}  // namespace meshlet

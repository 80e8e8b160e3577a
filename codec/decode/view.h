// A buffer view: one blob, or several back to back (pages).
#pragma once
#include <string>
#include <vector>

#include "decode/decoder.h"

namespace meshlet {

// The blobs of a view. Borrows the bytes. Vertices, triangles and meshlets are numbered on through
// the blobs.
struct View {
  std::vector<Blob> blobs;
  uint64_t triangle_count = 0, vertex_count = 0, meshlet_count = 0;

  // Reads all headers. Throws Malformed unless the blobs fill the view, have the same streams
  // (predictors and bases may differ), and sum to counts below 2^32.
  View(const uint8_t* data, size_t size);

  const std::vector<Stream>& streams() const { return blobs.front().header.streams; }

  // The number of the blob that holds meshlet m, which must exist.
  size_t blob_of_meshlet(uint64_t m) const;

  // Decoder's decode of one blob into the arrays of the whole view. Several threads may decode
  // different blobs.
  void decode(size_t blob, const Outputs& out) const;

  // Throws Malformed unless the blob is valid.
  void validate(size_t blob) const;

  // Runs action(blob). A Malformed that it throws names the blob if there are several.
  template <class Action>
  void with_blob(size_t number, Action action) const {
    try {
      action(blobs[number]);
    } catch (const Malformed& error) {
      if (blobs.size() == 1) throw;
      throw Malformed("blob " + std::to_string(number) + ": " + error.what());
    }
  }
};

}  // namespace meshlet

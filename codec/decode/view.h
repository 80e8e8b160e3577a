// A buffer view: one blob, or several back to back (pages).
#pragma once
#include <algorithm>

#include "decode/decoder.h"

namespace gltf_meshlet_codec {

// A checked blob of a view, which has its streams.
struct ViewBlob : BlobCounts {
  const uint8_t* data;
  size_t size;
  uint64_t first_vertex, first_triangle, first_meshlet;  // in the view
};

struct Range;

// Do they differ in predictors and bases at most?
bool same_streams(const StreamTable& a, const StreamTable& b);

// The blobs of a view. Borrows the bytes. Vertices, triangles and meshlets are numbered on through
// the blobs. Does not change once it is open: threads share it. `threads` is one per processor if
// it is 0, and changes no result of valid bytes.
struct View {
  List<ViewBlob> blobs;
  StreamTable
      streams;  // of the first blob; others may differ in predictors, bases and signs of zeros
  uint64_t triangle_count = 0, vertex_count = 0, meshlet_count = 0;

  // Reads all headers. Call once. Returns the rule that the view breaks, if any: the blobs fill it,
  // have the same streams (predictors and bases may differ), and sum to counts below 2^32.
  Problem open(const uint8_t* data, size_t size);

  // The number of the blob that holds meshlet m, which must exist.
  size_t blob_of_meshlet(uint64_t m) const;

  void open_decoder(Decoder& decoder, size_t blob) const {
    const ViewBlob& b = blobs[blob];
    decoder.open(b.data, b.size, b);
  }

  // Decodes all of it to the arrays of the whole view. Threads share out the blobs, and ranges of
  // those that are large.
  Problem decode(int threads, const Outputs& out) const;

  // Decodes the meshlets [first, first + count) of one blob, on which the decoder is open, to the
  // arrays of the whole view. out.triangle_begins, vertex_begins: as list_begins writes them.
  Problem decode_range(Decoder& decoder, uint64_t first, uint64_t count, const Outputs& out,
                       DecodedCounts& counts) const;

  // Writes the numbers of the first triangle, and of the first vertex that no earlier meshlet has,
  // of each meshlet, and of what follows the last one. Null arrays are skipped.
  Problem list_begins(int threads, uint32_t* triangle_begins, uint32_t* vertex_begins) const;

  // Returns the rule that the view breaks, if any.
  Problem validate(int threads) const;

  // A blob's problem, which names the blob if there are several.
  Problem located(Problem problem, size_t blob) const {
    if (problem && blobs.size() > 1 && problem.text != kNoMemory) problem.blob = uint32_t(blob);
    return problem;
  }

 private:
  Problem decode_blob(Decoder& decoder, size_t blob, const Outputs& out) const;
  Problem decode_in_ranges(int threads, const List<Range>& ranges, const Outputs& out) const;
};

}  // namespace gltf_meshlet_codec

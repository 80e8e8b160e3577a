// EXT_meshlet_transport: packs the blobs of a view for download, and unpacks the identical bytes.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "decode/memory.h"
#include "format/blob.h"

namespace gltf_meshlet_codec {

// A packed view begins with a word: the number of its pages << 8 | kTransportVersion. Then two
// words for each page: its resident bytes; its packed bytes, 0 if it is stored as it is. Then the
// pages.
constexpr uint32_t kTransportVersion = 1;
// A page whose resident bytes are more than this many times its packed ones, and a little, is
// malformed: what a file can make a reader allocate is bounded by its own length.
constexpr uint64_t kMostExpansion = 256, kFreeBytes = 4096;

struct PackedPage {
  size_t packed_begin, packed_bytes;  // in the packed view
  size_t begin, bytes;                // in the view
  bool raw;                           // stored as it is
};

// Packs a view: a page for each of its blobs. Returns the rule that the view breaks, if any.
Problem pack_view(const uint8_t* data, size_t size, int threads, std::vector<uint8_t>& packed);

// Reads the table of a packed view. Returns the rule that it breaks, if any.
Problem read_page_table(const uint8_t* data, size_t size, List<PackedPage>& pages);
// Likewise, from the first bytes of a packed view of view_bytes.
Problem read_page_table(const uint8_t* head, size_t head_bytes, uint64_t view_bytes,
                        List<PackedPage>& pages);

// Unpacks pages one at a time. Not thread-safe: use one per thread.
class PageUnpacker : public Allocated {
 public:
  virtual ~PageUnpacker() = default;
  // Writes page.bytes to `out`. Returns the rule that the page breaks, if any. The resident bytes
  // are still to be validated like those of any file.
  virtual Problem unpack(const uint8_t* packed_view, const PackedPage& page, uint8_t* out) = 0;
};

// An unpacker with the fastest instructions that the processor has; null if there is no memory.
std::unique_ptr<PageUnpacker> make_page_unpacker();

}  // namespace gltf_meshlet_codec

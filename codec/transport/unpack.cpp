#include "transport/transport.h"

#include <cstdint>
#include <cstring>

namespace gltf_meshlet_codec {

Problem read_page_table(const uint8_t* data, size_t size, List<PackedPage>& pages) {
  return read_page_table(data, size, size, pages);
}

Problem read_page_table(const uint8_t* data, size_t head_bytes, uint64_t size,
                        List<PackedPage>& pages) {
  const auto word = [&](size_t at) {
    uint32_t x;
    std::memcpy(&x, data + at, 4);
    return x;
  };
  pages.clear();
  if (head_bytes > size) head_bytes = size_t(size);
  if (head_bytes < 4 || size > SIZE_MAX) return {"the packed view is too short"};
  if ((word(0) & 255) != kTransportVersion)
    return {"the packed view is of version #; a newer release may read it", word(0) & 255};
  const size_t count = word(0) >> 8;
  if (count < 1 || count > (head_bytes - 4) / 8)
    return {"the packed view is shorter than its page table"};
  size_t from = 4 + 8 * count, to = 0;
  for (size_t i = 0; i < count; i++) {
    const size_t bytes = word(4 + 8 * i), packed = word(8 + 8 * i);
    const PackedPage page = {from, packed ? packed : bytes, to, bytes, packed == 0};
    if (page.packed_bytes > size - from)
      return {"page # lies outside the packed view", uint32_t(i)};
    if (bytes == 0 || bytes > BLOB_MAX_BYTES || packed > BLOB_MAX_BYTES || packed == bytes ||
        bytes > kFreeBytes + kMostExpansion * uint64_t(page.packed_bytes))
      return {"page # has an impossible length", uint32_t(i)};
    if (bytes > SIZE_MAX - to) return {"the unpacked view is longer than memory"};
    if (!pages.push(page)) return {kNoMemory};
    from += page.packed_bytes;
    to += bytes;
  }
  if (from != size) return {"the packed view is longer than its pages"};
  return {};
}

}  // namespace gltf_meshlet_codec

#include "common/weld.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "common/hash_map.h"

namespace gltf_meshlet_codec {
namespace {

uint64_t mix(uint64_t hash, uint64_t word) {
  hash = (hash ^ word) * 0x9E3779B97F4A7C15u;
  return hash ^ (hash >> 29);
}

uint64_t hash_row(const uint8_t* row, size_t stride) {
  uint64_t hash = stride;
  size_t i = 0;
  for (; i + 8 <= stride; i += 8) {
    uint64_t word;
    std::memcpy(&word, row + i, 8);
    hash = mix(hash, word);
  }
  uint64_t rest = 0;
  for (int shift = 0; i < stride; ++i, shift += 8) rest |= uint64_t(row[i]) << shift;
  return mix(mix(hash, rest), 0);
}

// A slot of the hash table: the first row with these bytes.
struct Slot {
  uint32_t hash;
  uint32_t row;
};
constexpr uint32_t kEmpty = ~0u;

}  // namespace

uint32_t weld_rows(const uint8_t* rows, size_t count, size_t stride, uint32_t* remap) {
  std::vector<Slot> table(slots_for(count), Slot{0, kEmpty});
  // Hash a whole batch before looking its rows up: the cache misses then overlap.
  constexpr size_t kBatch = 32;
  uint64_t hashes[kBatch];
  uint32_t unique = 0;
  for (size_t first = 0; first < count; first += kBatch) {
    const size_t size = std::min(kBatch, count - first);
    for (size_t i = 0; i < size; i++) {
      hashes[i] = hash_row(rows + (first + i) * stride, stride);
      __builtin_prefetch(&table[hashes[i] & (table.size() - 1)]);
    }
    for (size_t i = 0; i < size; i++) {
      const uint32_t row = uint32_t(first + i), hash = uint32_t(hashes[i] >> 32);
      const size_t at = find_slot(hashes[i], table.size(), [&](size_t slot) {
        const Slot& first = table[slot];
        return first.row == kEmpty ||
               (first.hash == hash &&
                std::memcmp(rows + first.row * stride, rows + row * stride, stride) == 0);
      });
      if (table[at].row == kEmpty) {
        table[at] = {hash, row};
        remap[row] = unique++;
      } else {
        remap[row] = remap[table[at].row];
      }
    }
  }
  return unique;
}

}  // namespace gltf_meshlet_codec

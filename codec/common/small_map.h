// A hash map for the few triangles or vertices of one meshlet.
#pragma once

#include <cstdint>
#include <cstring>
#include <utility>

namespace meshlet {

// Open addressing, 2^kBits slots: must hold fewer keys than slots. No key is ~0.
template <uint32_t kBits>
class SmallMap {
 public:
  SmallMap() { std::memset(keys_, 0xFF, sizeof keys_); }

  // Inserts (key, value) unless the key is there. Returns its value, and whether it is new.
  std::pair<uint8_t, bool> insert(uint32_t key, uint8_t value) {
    const uint32_t slot = slot_of(key);
    const bool is_new = keys_[slot] == kNoKey;
    if (is_new) {
      keys_[slot] = key;
      values_[slot] = value;
    }
    return {values_[slot], is_new};
  }

  // The value of the key, or null.
  const uint8_t* find(uint32_t key) const {
    const uint32_t slot = slot_of(key);
    return keys_[slot] == key ? &values_[slot] : nullptr;
  }

 private:
  static constexpr uint32_t kNoKey = ~0u;

  // The key's slot, or the free one to put it in.
  uint32_t slot_of(uint32_t key) const {
    uint32_t slot = key * 0x9E3779B1u >> (32 - kBits);
    while (keys_[slot] != kNoKey && keys_[slot] != key) slot = (slot + 1) % (1u << kBits);
    return slot;
  }

  uint32_t keys_[1u << kBits];
  uint8_t values_[1u << kBits];
};

}  // namespace meshlet

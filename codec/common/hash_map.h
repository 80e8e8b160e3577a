// Hash maps with open addressing. Nothing depends on the order of their slots.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace gltf_meshlet_codec {

// Slots of a table for at most `count` keys: a power of two, at most half of it in use.
inline size_t slots_for(size_t count) {
  size_t slots = 16;
  while (slots < 2 * count) slots *= 2;
  return slots;
}

// Returns the first slot from `slot` on, cyclically, that ends the search for a key: it holds the
// key or is free. slots: a power of two.
template <class Ends>
size_t find_slot(size_t slot, size_t slots, Ends&& ends) {
  for (slot &= slots - 1; !ends(slot); slot = (slot + 1) & (slots - 1));
  return slot;
}

// Maps integers, none of them ~0, to small values. kBits: with 2^kBits slots inside the object, for
// fewer keys than slots; 0: with as many slots as the constructor is told to.
template <class Key, class Value, uint32_t kBits = 0>
class HashMap {
 public:
  HashMap() { keys_.fill(kFree); }
  // For at most `count` keys.
  explicit HashMap(size_t count) : keys_(slots_for(count), kFree), values_(keys_.size()) {}

  // Inserts (key, value) unless the key is there. Returns its value, and whether it is new.
  std::pair<Value, bool> insert(Key key, Value value) {
    const size_t slot = slot_of(key);
    const bool is_new = keys_[slot] == kFree;
    if (is_new) {
      keys_[slot] = key;
      values_[slot] = value;
    }
    return {values_[slot], is_new};
  }

  // The value of the key, or null.
  const Value* find(Key key) const {
    const size_t slot = slot_of(key);
    return keys_[slot] == key ? &values_[slot] : nullptr;
  }

 private:
  static constexpr Key kFree = Key(~Key(0));
  template <class T>
  using Slots = std::conditional_t<kBits != 0, std::array<T, size_t(1) << kBits>, std::vector<T>>;

  // The key's slot, or the free one to put it in.
  size_t slot_of(Key key) const {
    const size_t hash = kBits != 0 ? uint32_t(key) * 0x9E3779B1u >> (32 - kBits) % 32
                                   : size_t(key * 0x9E3779B97F4A7C15u >> 32);
    return find_slot(hash, keys_.size(),
                     [&](size_t slot) { return keys_[slot] == key || keys_[slot] == kFree; });
  }

  Slots<Key> keys_;
  Slots<Value> values_;
};

// Gives each of the numbers that it is asked for a local one, from 0 in order of first occurrence.
class LocalNumbers {
 public:
  // For at most `count` numbers.
  explicit LocalNumbers(size_t count) : local_(count) {}

  uint32_t of(uint32_t number) {
    const auto [local, is_new] = local_.insert(number, uint32_t(numbers_.size()));
    if (is_new) numbers_.push_back(number);
    return local;
  }
  const std::vector<uint32_t>& numbers() const { return numbers_; }

 private:
  HashMap<uint32_t, uint32_t> local_;
  std::vector<uint32_t> numbers_;
};

}  // namespace gltf_meshlet_codec

// Local numbers for some of many items.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace meshlet {

// Gives each of the numbers that it is asked for a local one, from 0 in order of first occurrence.
// Open addressing. No number is ~0.
class LocalNumbers {
 public:
  // For at most `count` numbers.
  explicit LocalNumbers(size_t count) {
    size_t capacity = 16;
    while (capacity < 2 * count) capacity *= 2;
    slots_.assign(capacity, {kEmpty, 0});
  }

  uint32_t of(uint32_t number) {
    size_t at = number * size_t(0x9E3779B1u) & (slots_.size() - 1);
    while (slots_[at].number != number && slots_[at].number != kEmpty)
      at = (at + 1) & (slots_.size() - 1);
    if (slots_[at].number == kEmpty) {
      slots_[at] = {number, uint32_t(numbers_.size())};
      numbers_.push_back(number);
    }
    return slots_[at].local;
  }
  const std::vector<uint32_t>& numbers() const { return numbers_; }

 private:
  static constexpr uint32_t kEmpty = ~0u;
  struct Slot {
    uint32_t number, local;
  };
  std::vector<Slot> slots_;
  std::vector<uint32_t> numbers_;
};

}  // namespace meshlet

// Writes bits, the lowest first, into bytes.
#pragma once
#include <cstdint>
#include <vector>

namespace meshlet {

class BitWriter {
 public:
  // bits <= 32, the lowest of `value`.
  void put(uint32_t value, uint32_t bits) {
    for (uint32_t done = 0; done < bits;) {
      uint32_t room = 8 - (count_ & 7);
      if (room == 8) bytes_.push_back(0);
      uint32_t n = bits - done < room ? bits - done : room;
      bytes_.back() = uint8_t(bytes_.back() | (value >> done & ((1u << n) - 1u)) << (count_ & 7));
      count_ += n;
      done += n;
    }
  }

  // `quotient` zeros, then a one.
  void put_unary(uint32_t quotient) {
    for (; quotient >= 32; quotient -= 32) put(0, 32);
    put(0, quotient);
    put(1, 1);
  }

  // Fills with zeros up to a multiple of `bytes` bytes.
  void align(uint32_t bytes) {
    while (count_ & 7) put(0, 8 - (count_ & 7));
    while (bytes_.size() % bytes) put(0, 8);
  }

  const std::vector<uint8_t>& bytes() const { return bytes_; }
  uint64_t bit_count() const { return count_; }

 private:
  std::vector<uint8_t> bytes_;
  uint64_t count_ = 0;  // bits
};

}  // namespace meshlet

// Writes bits, the lowest first, into bytes.
#pragma once
#include <cstdint>
#include <cstring>
#include <vector>

namespace gltf_meshlet_codec {

// Appends strings of bits that each begin at a byte.
class BitWriter {
 public:
  // bits <= 32, the lowest of `value`.
  void put(uint32_t value, uint32_t bits) {
    word_ |= (value & ((1ull << bits) - 1)) << filled_;
    filled_ += bits;
    if (filled_ >= 32) flush_half();
  }

  // `quotient` zeros, then a one.
  void put_unary(uint32_t quotient) {
    for (; quotient >= 32; quotient -= 32) put(0, 32);
    put(0, quotient);
    put(1, 1);
  }

  // Fills the last byte with zeros.
  void align() {
    while (filled_ > 0) {
      bytes_.push_back(uint8_t(word_));
      word_ >>= 8;
      filled_ -= filled_ < 8 ? filled_ : 8;
    }
  }

  // All bytes, after align().
  const std::vector<uint8_t>& bytes() const { return bytes_; }
  uint64_t bit_count() const { return 8 * uint64_t(bytes_.size()) + filled_; }

 private:
  // Little-endian machines only, as the decoder.
  void flush_half() {
    const size_t size = bytes_.size();
    bytes_.resize(size + 4);
    std::memcpy(&bytes_[size], &word_, 4);
    word_ >>= 32;
    filled_ -= 32;
  }

  std::vector<uint8_t> bytes_;
  uint64_t word_ = 0;
  uint32_t filled_ = 0;  // bits of word_, below 32
};

}  // namespace gltf_meshlet_codec

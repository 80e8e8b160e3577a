// Residual codes: Rice with separated planes, or fixed widths (spec, appendix A.5, section C), and
// the bits they are written to.
#pragma once
#include <cstdint>
#include <vector>

namespace meshlet {

inline uint32_t zigzag(uint32_t difference) { return difference << 1 ^ (0u - (difference >> 31)); }
inline uint32_t bit_length(uint32_t u) { return u ? 32u - uint32_t(__builtin_clz(u)) : 0u; }

constexpr uint32_t kFixedCode = 7;  // 0..6 are Rice parameters above the base
constexpr uint32_t kRiceCodes = 7;
constexpr uint32_t kMaxQuotient = 16383;

// Bits of the residuals under Rice parameter k, codes only; or a huge number where a quotient
// exceeds the format's limit.
inline uint64_t rice_bits(const std::vector<uint32_t>& residuals, uint32_t k) {
  uint64_t bits = residuals.size() * uint64_t(k + 1);
  uint32_t largest = 0;
  for (uint32_t u : residuals) {
    bits += u >> k;
    largest |= u >> k;
  }
  return largest > kMaxQuotient ? ~0ull >> 8 : bits;
}

// The Rice parameter that takes least bits.
inline uint32_t best_rice(const std::vector<uint32_t>& residuals) {
  uint64_t sum = 0;
  for (uint32_t u : residuals) sum += u;
  uint32_t k = residuals.empty() ? 0 : bit_length(uint32_t(sum / residuals.size()));
  uint32_t best = k > 1 ? k - 2 : 0;
  for (uint32_t i = best + 1; i <= k + 1 && i < 32; i++)
    if (rice_bits(residuals, i) < rice_bits(residuals, best)) best = i;
  return best;
}

class BitWriter {
 public:
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
  void put_mask(uint64_t mask, uint32_t bits) {
    put(uint32_t(mask), bits < 32 ? bits : 32);
    if (bits > 32) put(uint32_t(mask >> 32), bits - 32);
  }
  void put_unary(uint32_t quotient) {
    for (; quotient >= 32; quotient -= 32) put(0, 32);
    put(0, quotient);
    put(1, 1);
  }
  void align(uint32_t bytes) {
    while (count_ & 7) put(0, 8 - (count_ & 7));
    while (bytes_.size() % bytes) put(0, 8);
  }
  uint64_t bit_count() const { return count_; }
  const std::vector<uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<uint8_t> bytes_;
  uint64_t count_ = 0;
};

}  // namespace meshlet

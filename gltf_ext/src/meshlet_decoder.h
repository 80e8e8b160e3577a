// The shared single-lane decoder (shaders/meshlet_decoder.glsl) as a C++ struct: this file supplies the primitives it asks for.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace meshlet {

constexpr uint32_t kMaxStreams = 64;
constexpr uint32_t kMaxLanes = 4 * kMaxStreams;
constexpr uint32_t kPaddingBytes = 8;      // zero bytes at a blob's end, so that an unaligned 64-bit read stays inside

struct MeshletDecoder {
  using uint = uint32_t;
  using small_uint = uint16_t;             // not uint8_t, whose stores may alias everything
  using mask64 = uint64_t;

#define MAX_STREAMS 64u
#define MAX_LANES 256u
#include "meshlet_decoder.glsl"
  static_assert(MAX_STREAMS == kMaxStreams && MAX_LANES == kMaxLanes);

  static mask64 mask_none() { return 0; }
  static mask64 mask_bit(uint i) { return 1ull << (i & 63u); }
  static mask64 mask_below(uint n) { return n >= 64u ? ~0ull : (1ull << n) - 1u; }
  static bool mask_test(mask64 m, uint i) { return (m >> (i & 63u)) & 1u; }
  static bool mask_any(mask64 m) { return m != 0; }
  static uint mask_count(mask64 m) { return uint(__builtin_popcountll(m)); }
  static uint mask_lsb(mask64 m) { return m ? uint(__builtin_ctzll(m)) : 64u; }
  static uint mask_msb(mask64 m) { return m ? 63u - uint(__builtin_clzll(m)) : 64u; }
  static mask64 mask_shl1(mask64 m) { return m << 1; }

  static uint max(uint a, uint b) { return a > b ? a : b; }

  const uint8_t* data = nullptr;
  uint size = 0;                           // bytes, a multiple of 4, below 2^29 so that bit positions fit 32 bits

  uint64_t load64(uint byte) const {       // little-endian machines only; checked at build time
    uint64_t w;
    std::memcpy(&w, data + byte, 8);
    return w;
  }
  uint load_word(uint i) const { return i < size / 4u ? uint(load64(4u * i > size - 8u ? size - 8u : 4u * i) >> (4u * i > size - 8u ? 32 : 0)) : 0u; }
  uint load_bits(uint p, uint n) const {
    uint byte = p >> 3;
    return byte + 8u > size ? 0u : uint((load64(byte) >> (p & 7u)) & ((1ull << n) - 1u));
  }
  mask64 load_mask(uint p, uint n) const {
    return n <= 32u ? load_bits(p, n) : load_bits(p, 32u) | mask64(load_bits(p + 32u, n - 32u)) << 32;
  }

  // Unary reader: `window` holds the next `available` bits, lowest first, zeros above; `next_bit` is the first bit not loaded.
  mask64 window = 0;
  uint available = 0;
  uint next_bit = 0;

  void seek_unary(uint p) {
    window = 0;
    available = 0;
    next_bit = p;
  }
  uint unary_position() const { return next_bit - available; }
  bool refill() {
    uint byte = next_bit >> 3;
    if (byte + 8u > size) {
      return false;
    }
    window = load64(byte) >> (next_bit & 7u);
    available = 64u - (next_bit & 7u);
    next_bit += available;
    return true;
  }
  void drop(uint n) {                      // n <= available
    window = n >= 64u ? 0u : window >> n;
    available -= n;
  }
  uint next_quotient() {
    uint q = 0;
    while (window == 0) {
      q += available;
      if (q > MAX_QUOTIENT || !refill()) {
        error = ERROR_UNARY;
        return 0;
      }
    }
    uint zeros = mask_lsb(window);
    drop(zeros + 1u);
    if (q + zeros > MAX_QUOTIENT) error = ERROR_UNARY;
    return q + zeros;
  }
  void skip_unary(uint n) {
    uint idle = 0;                         // zeros in a row, whole windows only
    while (n > 0) {
      uint ones = mask_count(window);
      idle = ones ? 0 : idle + available;
      if (ones < n) {
        n -= ones;
        if (idle > MAX_QUOTIENT || !refill()) {
          error = ERROR_UNARY;
          return;
        }
        continue;
      }
      for (; n > 1; n--) drop(mask_lsb(window) + 1u);
      drop(mask_lsb(window) + 1u);
      n = 0;
    }
  }
};

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the codec reads little-endian words in place");

}  // namespace meshlet

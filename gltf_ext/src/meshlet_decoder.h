// The shared single-lane decoder (shaders/meshlet_decoder.glsl) as a C++ struct: this file supplies the primitives it asks for.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#ifdef __BMI2__
#include <immintrin.h>
#endif

namespace meshlet {

constexpr uint32_t kMaxStreams = 64;
constexpr uint32_t kMaxLanes = 4 * kMaxStreams;
constexpr uint32_t kPaddingBytes = 8;      // zero bytes at a blob's end, so that an unaligned 64-bit read stays inside

struct MeshletDecoder {
  using uint = uint32_t;
  using small_uint = uint16_t;             // not uint8_t, whose stores may alias everything
  using mask64 = uint64_t;

  // The ones of `window` that were not read yet; its bit 0 is the blob's bit `base`. `cursor`: the bit after the last one read.
  // Clearing ones, rather than shifting them out, keeps the chain from code to code one instruction long.
  struct UnaryReader {
    mask64 window = 0;
    uint base = 0;
    uint cursor = 0;
  };

  // Lengths of owned references of the meshlets behind, at [(meshlet & ring_mask) * 64 + slot], 0: none; null: read them from the blob.
  const uint8_t* chain_lengths = nullptr;
  uint ring_mask = 0;

#define HEADER_IN const Header&
#define FOREIGN_LENGTH known_length
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
  static mask64 mask_scatter(mask64 bits, mask64 m) {
#ifdef __BMI2__
    return _pdep_u64(bits, m);
#else
    mask64 out = 0;
    for (; m; m &= m - 1u, bits >>= 1)
      if (bits & 1u) out |= m & (0u - m);
    return out;
#endif
  }

  uint known_length(uint owner, uint slot) {
    if (!chain_lengths || owner == opened.meshlet) return read_foreign_length(owner, slot);
    uint length = chain_lengths[(owner & ring_mask) * 64u + slot];
    if (length > 0) return length;
    error = ERROR_OWNER;
    return 1u;
  }

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
    return byte + 8u > size ? 0u : load_inside(p, n);
  }
  uint load_inside(uint p, uint n) const { return uint((load64(p >> 3) >> (p & 7u)) & ((1ull << n) - 1u)); }
  mask64 load_mask(uint p, uint n) const {
    return n <= 32u ? load_bits(p, n) : load_bits(p, 32u) | mask64(load_bits(p + 32u, n - 32u)) << 32;
  }

  UnaryReader seek_unary(uint p) const {
    return {(p >> 3) + 8u > size ? 0 : load64(p >> 3) & ~mask_below(p & 7u), p & ~7u, p};
  }
  // Moves the window to the next one that holds a one.
  __attribute__((noinline)) bool refill(UnaryReader& r) {
    while (r.window == 0) {
      r.base += 64u;
      if ((r.base >> 3) + 8u > size || r.base - r.cursor > MAX_QUOTIENT + 64u) {
        error = ERROR_UNARY;
        return false;
      }
      r.window = load64(r.base >> 3);
    }
    return true;
  }
  uint next_quotient(UnaryReader& r) {
    if (r.window == 0) {
      UnaryReader far = r;                 // r itself shall not need an address
      bool more = refill(far);
      r = far;
      if (!more) return 0;
    }
    uint one = r.base + uint(__builtin_ctzll(r.window));
    uint quotient = one - r.cursor;
    r.window &= r.window - 1u;
    r.cursor = one + 1u;
    if (quotient > MAX_QUOTIENT) error = ERROR_UNARY;
    return quotient;
  }
  void skip_unary(UnaryReader& r, uint n) {
    while (n > 0) {
      uint ones = mask_count(r.window);
      if (ones >= n) {
        for (; n > 1u; n--) r.window &= r.window - 1u;
        r.cursor = r.base + uint(__builtin_ctzll(r.window)) + 1u;
        r.window &= r.window - 1u;
        return;
      }
      if (ones > 0) r.cursor = r.base + 64u;   // not exact, but all that matters is the distance to the next one
      n -= ones;
      r.window = 0;
      if (!refill(r)) return;
    }
  }
};

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the codec reads little-endian words in place");

}  // namespace meshlet

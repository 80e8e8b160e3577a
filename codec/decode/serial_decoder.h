// The serial decoder (serial_decoder.glsl) as a C++ struct. This file supplies the primitives that
// the GLSL asks for.
#ifndef DECODE_SERIAL_DECODER_H
#define DECODE_SERIAL_DECODER_H
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#ifdef __wasm_simd128__
#include <wasm_simd128.h>
#endif

#include "decode/build.h"
#include "decode/vertex.h"
#include "format/constants.h"

namespace gltf_meshlet_codec {

namespace MESHLET_BUILD {
struct SerialDecoder {
  using uint = uint32_t;
  using small_uint = uint16_t;  // not uint8_t, whose stores may alias everything
  using index_uint = size_t;
  using mask64 = uint64_t;

  // A place in the unary plane that the decoder sought last: the number of ones before it, and the
  // bit after the last one of them.
  struct UnaryReader {
    uint index = 0;
    uint cursor = 0;
  };

  // Lengths of owned references of earlier meshlets, at [(meshlet & ring_mask) * 64 + slot]; 0 if
  // there is no such reference. Null, and for meshlets before first_listed: read lengths from the
  // blob.
  const uint8_t* chain_lengths = nullptr;
  uint ring_mask = 0;
  uint first_listed = 0;

#define HEADER_IN const Header&
#define INLINE __attribute__((always_inline)) inline
#define FOREIGN_LENGTH known_length
#define MAX_STREAMS BLOB_MAX_STREAMS
#define MAX_ELEMENTS (STREAM_MAX_ELEMENTS * BLOB_MAX_STREAMS)
#define OWN_VALUES
// All elements of a vertex lie together, in 16 bytes.
#define ALIGNED alignas(32)
#define VERTEX_STEP 4u
#define ELEMENT_STEP 1u
#define STREAM_ROOM(elements) 4u
#include "decode/serial_decoder.glsl"

  // Stream s of vertex `id`: 4 elements.
  const uint* vertex(uint s, uint id) const { return values + 64u * stream_element[s] + 4u * id; }
  uint* vertex(uint s, uint id) { return values + 64u * stream_element[s] + 4u * id; }

  static mask64 mask_none() { return 0; }
  static mask64 mask_bit(uint i) { return 1ull << (i & 63u); }
#if MESHLET_AVX2
  static mask64 mask_below(uint n) { return _bzhi_u64(~0ull, n); }
  static uint mask_lsb(mask64 m) { return uint(_tzcnt_u64(m)); }
#else
  static mask64 mask_below(uint n) { return n >= 64u ? ~0ull : (1ull << n) - 1u; }
  static uint mask_lsb(mask64 m) { return m ? uint(__builtin_ctzll(m)) : 64u; }
#endif
#if MESHLET_AVX2
  static uint mask_msb(mask64 m) { return uint(_lzcnt_u64(m)) ^ 63u; }
#else
  static uint mask_msb(mask64 m) { return 63u ^ (m ? uint(__builtin_clzll(m)) : 64u); }
#endif
  static uint bit_length(uint x) { return x ? 32u - uint(__builtin_clz(x)) : 0u; }
  static bool mask_test(mask64 m, uint i) { return (m >> (i & 63u)) & 1u; }
  static bool mask_any(mask64 m) { return m != 0; }
  static uint mask_count(mask64 m) { return uint(__builtin_popcountll(m)); }
  static mask64 mask_clear_lsb(mask64 m) { return m & (m - 1u); }
  static mask64 mask_shl1(mask64 m) { return m << 1; }
  static mask64 mask_scatter(mask64 bits, mask64 m) {
#if MESHLET_AVX2
    return _pdep_u64(bits, m);
#else
    mask64 out = 0;
    for (; m; m &= m - 1u, bits >>= 1) out |= m & (0u - m) & (0u - (bits & 1u));
    return out;
#endif
  }

  uint known_length(uint owner, uint slot) {
    if (owner == opened.meshlet) {
      const uint r = slot_reference(opened, slot);
      return error == ERROR_NONE ? stored_length(opened, r) : 1u;
    }
    if (!chain_lengths || owner < first_listed) return read_foreign_length(owner, slot);
    uint length = chain_lengths[(owner & ring_mask) * 64u + slot];
    if (length > 0) return length;
    error = ERROR_OWNER;
    return 1u;
  }

  // Compilers turn ?: into a branch, at some 20 cycles per misprediction.
  template <class T>
  static T choose(bool condition, T a, T b) {
#ifdef __x86_64__
    __asm__("test %1, %1\n\tcmovne %2, %0" : "+r"(b) : "r"(uint(condition)), "r"(a) : "cc");
    return b;
#elif defined(__wasm__)
    return condition ? a : b;  // the instruction `select`
#else
    T all = T(0) - T(condition);
    return (a & all) | (b & ~all);
#endif
  }

  // x / n = x * ceil(2^37 / n) >> 37. The reciprocal is too large by less than 1 / 2^37, so the
  // product is too large by less than x / 2^37 < 1 / n.
  struct Reciprocals {
    uint64_t of[65] = {};
    constexpr Reciprocals() {
      for (uint64_t n = 1; n <= 64; n++) of[n] = ((1ull << 37) + n - 1u) / n;
    }
  };
  static uint divide(uint x, uint n) {
#ifdef __wasm__
    return x / n;  // half a kilobyte less than the table
#else
    static constexpr Reciprocals reciprocals;
    return uint(x * reciprocals.of[n] >> 37);
#endif
  }

  static bool ends_after(uint p, uint n, uint end) { return uint64_t(p) + n > end; }
  static uint max(uint a, uint b) { return a > b ? a : b; }
  static uint min(uint a, uint b) { return a < b ? a : b; }

  const uint8_t* data = nullptr;
  uint size = 0;  // bytes: a multiple of 4, at most BLOB_MAX_BYTES

  // Bit positions fit 32 bits in all decoders, those on a GPU included. A malformed meshlet's reach
  // behind the blob before they are tested, by its numbers at most: anchors; low bits of chains, of
  // references that fit no boundary; and low bits of interiors, with exp-Golomb codes as many as
  // there are zeros in the unary parts. The rest is less than the spare bits.
  static constexpr uint64_t kMostAnchorBits =
                                64 * MAX_ELEMENTS * (STREAM_MAX_BITS + ANCHOR_WIDTH_BITS),
                            kMostChainBits =
                                MESHLET_MAX_REFERENCES * 64 * MAX_ELEMENTS * STREAM_MAX_BITS,
                            kMostInteriorBits =
                                64 * MAX_ELEMENTS * (STREAM_MAX_BITS + MAX_QUOTIENT + 1),
                            kSpareBits = 1 << 20;
  static_assert(8ull * BLOB_MAX_BYTES + kMostAnchorBits + kMostChainBits + kMostInteriorBits +
                    kSpareBits <
                1ull << 32);

  uint64_t load64(uint byte) const {  // little-endian only; checked below
    uint64_t w;
    std::memcpy(&w, data + byte, 8);
    return w;
  }
  uint load_word(uint i) const {
    return i < size / 4u ? uint(load64(4u * i > size - 8u ? size - 8u : 4u * i) >>
                                (4u * i > size - 8u ? 32 : 0))
                         : 0u;
  }
  uint load_bits(uint p, uint n) const {
    uint byte = p >> 3;
    return byte + 8u > size ? 0u : load_inside(p, n);
  }
  uint load_inside(uint p, uint n) const {
    return uint((load64(p >> 3) >> (p & 7u)) & ((1ull << n) - 1u));
  }
  mask64 load_mask(uint p, uint n) const {
    return n <= 32u ? load_bits(p, n)
                    : load_bits(p, 32u) | mask64(load_bits(p + 32u, n - 32u)) << 32;
  }

  // --- unary planes ---

  // The ones of the plane at bit ends_begin: ends[i] is the position of the i-th, from 1, and
  // ends[0] the bit before the plane. Listed as far as needed: read_ends continues from `window`,
  // whose bit 0 is the blob's bit window_base and whose ones are not listed yet.
  static constexpr uint kMaxEnds = 64 * MAX_ELEMENTS;  // of all chains, or of interiors
  uint ends_begin = 0, ends_count = 0;
  uint window_base = 0;
  mask64 window = 0;
  uint ends[1 + kMaxEnds + 64 + 8];  // room for a window and a store; the same size in all builds

  UnaryReader seek_unary(uint p) {
    if (p != ends_begin || p == 0) {
      ends_begin = p;
      ends_count = 0;
      ends[0] = p - 1u;
      window_base = p & ~7u;
      window = (p >> 3) + 8u > size ? 0 : load64(p >> 3) & ~mask_below(p & 7u);
    }
    return {0, p};
  }

  // Moves the window to the next one.
  __attribute__((noinline)) bool refill() {
    while (window == 0) {
      window_base += 64u;
      if ((window_base >> 3) + 8u > size || window_base - ends[ends_count] > MAX_QUOTIENT + 65u) {
        error = ERROR_UNARY;
        return false;
      }
      window = load64(window_base >> 3);
    }
    return true;
  }

  // Lists the first n ones, and maybe more.
  void read_ends(uint n) {
    if (n > kMaxEnds) {
      error = ERROR_REFERENCES;
      return;
    }
    while (ends_count < n) {
      if (window == 0 && !refill()) return;
      const uint found = ends_count;
      list_window(n);
      if (ends[found + 1] - ends[found] > MAX_QUOTIENT + 1u) error = ERROR_UNARY;
    }
  }

#if MESHLET_AVX2
  // The positions of each byte's ones, in order.
  struct OnesOfBytes {
    uint8_t of[256][8] = {};
    constexpr OnesOfBytes() {
      for (uint byte = 0; byte < 256; byte++)
        for (uint bit = 0, count = 0; bit < 8; bit++)
          if (byte >> bit & 1u) of[byte][count++] = uint8_t(bit);
    }
  };

  // Lists all ones of the window, also those past the n-th: an unpredictable loop end costs more.
  void list_window(uint) {
    static constexpr OnesOfBytes ones;
    uint* to = ends + 1 + ends_count;
    for (uint i = 0; i < 64; i += 8) {
      const uint byte = uint(window >> i) & 255u;
      const __m128i bits = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(ones.of[byte]));
      const __m256i base = _mm256_set1_epi32(int(window_base + i));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                          _mm256_add_epi32(_mm256_cvtepu8_epi32(bits), base));
      to += mask_count(byte);
    }
    ends_count += mask_count(window);
    window = 0;
  }
#elif defined(__wasm_simd128__)
  // As above, four at a time. Behind the last one it lists others, which nobody reads.
  void list_window(uint) {
    uint* to = ends + 1 + ends_count;
    ends_count += mask_count(window);
    const uint* const end = ends + 1 + ends_count;
    const uint base = window_base;
    const auto list_next = [&] {
      *to++ = base + mask_lsb(window);
      window = mask_clear_lsb(window);
    };
    while (to < end) {
      list_next();  // not a loop, which -Os would leave one
      list_next();
      list_next();
      list_next();
    }
    window = 0;
  }
#else
  // Lists the window's ones up to the n-th.
  void list_window(uint n) {
    for (; window != 0 && ends_count < n; window = mask_clear_lsb(window))
      ends[++ends_count] = window_base + mask_lsb(window);
  }
#endif

  void skip_unary(uint n) {
    read_ends(unary.index + n);
    if (error != ERROR_NONE) return;
    unary.index += n;
    unary.cursor = ends[unary.index] + 1u;
  }

  // --- residuals ---

  static uint unzigzagged(uint u) { return (u >> 1) ^ (0u - (u & 1u)); }

  void read_codes(uint n, uint code) {
    const uint k = code & CODE_MAX_PARAMETER, low = low_cursor, before = unary.cursor;
    const uint* list = ends + unary.index;
    skip_unary(n);
    if (error != ERROR_NONE) return;
    const uint zeros = unary.cursor - before - n;
    const bool exponential = (code & CODE_EXPONENTIAL) != 0;
    if (!take_low_bits(n * k + (exponential ? zeros : 0u))) return;
    if (exponential)
      read_exponential(n, k, low, list);
    else
      read_rice(n, k, low, list);
  }

  void read_rice(uint n, uint k, uint low, const uint* list) {
    uint i = 0;
#if MESHLET_AVX2
    for (; k <= 7u && i < n; i += 8, low += 8 * k) {
      mask64 bytes = _pdep_u64(load64(low >> 3) >> (low & 7u),
                               0x0101010101010101ull * ((1u << (k & 7u)) - 1u));
      store_rice(i, list + i, k, _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(int64_t(bytes))));
    }
#elif defined(__wasm_simd128__)
    if (k <= 8u) return read_rice_fours(n, k, low, list);
#endif
    for (; i < n; i++, low += k)
      residuals[i] = unzigzagged((list[i + 1] - list[i] - 1u) << k | load_inside(low, k));
  }

  void read_exponential(uint n, uint k, uint low, const uint* list) {
#if MESHLET_AVX2
    if (read_exponential_eights(n, k, low, list)) return;
#endif
    for (uint i = 0; i < n; i++) {
      const uint zeros = list[i + 1] - list[i] - 1u;
      if (zeros > EXPONENTIAL_MAX_QUOTIENT || k + zeros > EXPONENTIAL_MAX_BITS) {
        error = ERROR_CODE;
        return;
      }
      residuals[i] = unzigzagged((((1u << zeros) - 1u) << k) + load_inside(low, k + zeros));
      low += k + zeros;
    }
  }
#if MESHLET_AVX2
  // Eight at a time; returns false, and may have written some, if low bits exceed a 32-bit load.
  bool read_exponential_eights(uint n, uint k, uint low, const uint* list) {
    const __m256i one = _mm256_set1_epi32(1), parameter = _mm256_set1_epi32(int(k)),
                  limit = _mm256_set1_epi32(int(8u * (byte_length - BLOB_PADDING_BYTES)));
    __m256i index = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), widest = _mm256_setzero_si256();
    const __m256i last = _mm256_set1_epi32(int(n));
    // Item i's low bits begin k i + (zeros before i) after the first: list[i] counts both.
    const __m256i start = _mm256_set1_epi32(int(low - list[0] - 1u));
    for (uint i = 0; i < n; i += 8) {
      const __m256i* from = reinterpret_cast<const __m256i*>(list + i);
      const __m256i before = _mm256_add_epi32(_mm256_loadu_si256(from), one),
                    end = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(list + i + 1));
      const __m256i width = _mm256_add_epi32(_mm256_sub_epi32(end, before), parameter);
      const __m256i is_item = _mm256_cmpgt_epi32(last, index);
      widest = _mm256_max_epu32(widest, _mm256_and_si256(width, is_item));
      __m256i at = _mm256_add_epi32(_mm256_sub_epi32(before, index), start);
      at = _mm256_add_epi32(at, _mm256_mullo_epi32(index, parameter));
      at = _mm256_min_epu32(at, limit);
      __m256i word =
          _mm256_i32gather_epi32(reinterpret_cast<const int*>(data), _mm256_srli_epi32(at, 3), 1);
      word = _mm256_srlv_epi32(word, _mm256_and_si256(at, _mm256_set1_epi32(7)));
      const __m256i power = _mm256_sllv_epi32(one, width);
      const __m256i bits = _mm256_and_si256(word, _mm256_sub_epi32(power, one));
      const __m256i u =
          _mm256_add_epi32(bits, _mm256_sub_epi32(power, _mm256_sllv_epi32(one, parameter)));
      store_unzigzagged(i, u);
      index = _mm256_add_epi32(index, _mm256_set1_epi32(8));
    }
    const __m256i wide = _mm256_cmpgt_epi32(widest, _mm256_set1_epi32(25));
    return _mm256_testz_si256(wide, wide);
  }

  void store_unzigzagged(uint i, __m256i u) {
    const __m256i odd = _mm256_srai_epi32(_mm256_slli_epi32(u, 31), 31);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(residuals + i),
                        _mm256_xor_si256(_mm256_srli_epi32(u, 1), odd));
  }
#endif
#if MESHLET_AVX2
  // Residuals i .. i + 7 from the ends of their quotients and their low bits.
  void store_rice(uint i, const uint* list, uint k, __m256i low) {
    const __m256i* from = reinterpret_cast<const __m256i*>(list);
    __m256i ones = _mm256_cmpeq_epi32(low, low);
    __m256i before = _mm256_loadu_si256(from),
            end = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(list + 1));
    __m256i quotient = _mm256_add_epi32(_mm256_sub_epi32(end, before), ones);
    __m256i u = _mm256_or_si256(_mm256_sll_epi32(quotient, _mm_cvtsi32_si128(int(k))), low);
    store_unzigzagged(i, u);
  }
#endif

#if MESHLET_AVX2
#include "decode/avx2_values.h"
#endif
#include "decode/vertex_values.h"
};

}  // namespace MESHLET_BUILD

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "the codec reads little-endian words in place");

}  // namespace gltf_meshlet_codec

#endif

// Adaptive models of 16 symbols, coded by rANS; plain bits stand beside them
// (spec/EXT_meshlet_transport.md, "Entropy coding"). The encoder and the decoder have the same
// functions, so that one template codes both ways: c.symbol(model, x) codes x and returns it.
#ifndef TRANSPORT_ADAPTIVE_CODER_H
#define TRANSPORT_ADAPTIVE_CODER_H
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#ifdef __wasm_simd128__
#include <wasm_simd128.h>
#endif

#include "common/bits.h"
#include "decode/build.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

constexpr uint32_t kSymbols = 16, kProbabilityBits = 15, kWhole = 1u << kProbabilityBits;
constexpr uint64_t kStateEnd = 1ull << 31;  // the last state; states below take a word
constexpr uint32_t kPageHeaderWords = 5;    // triangles, meshlets, words of rANS, state

using Cumulative = uint16_t __attribute__((vector_size(2 * kSymbols)));
using SignedCumulative = int16_t __attribute__((vector_size(2 * kSymbols)));

// The pace of an adaptation falls from kFast to kSlow, itself at that pace. Its length gives the
// shift of the adaptation: 2 at first, 6 in the end.
constexpr uint16_t kFast = kWhole - 1, kSlow = 1024;
inline uint32_t shift_of(uint16_t pace) { return uint32_t(__builtin_clz(pace)) - 15; }

// Where the numbers of a model go with a symbol.
struct Targets {
  alignas(32) uint16_t numbers[kSymbols][kSymbols] = {};

  constexpr Targets() {
    for (uint32_t symbol = 0; symbol < kSymbols; symbol++)
      for (uint32_t i = 0; i < kSymbols; i++)
        numbers[symbol][i] = uint16_t(i ? i + (i > symbol ? kWhole - kSymbols : 0) : kSlow);
  }
};
constexpr Targets kTargets;

// Frequencies of 16 symbols: each symbol's is the difference to the next number, the last one's to
// kWhole. They grow strictly: no symbol has the frequency 0. The first number is always 0.
struct Model {
  // Inside the loops of arrays of models it would take 2 kB of web/unpacker.wasm.
  __attribute__((noinline)) Model() {
    numbers_[0] = kFast;
    for (uint32_t i = 1; i < kSymbols; i++) numbers_[i] = uint16_t(i * kWhole / kSymbols);
  }
  void update(uint32_t symbol) {
    Cumulative target;
    std::memcpy(&target, kTargets.numbers[symbol], sizeof target);
    const SignedCumulative way = SignedCumulative(target - numbers_);
    numbers_ += Cumulative(way >> int16_t(shift_of(numbers_[0])));
  }
  Cumulative cumulative() const { return numbers_ & kAllButFirst; }
  static Cumulative mean(const Model& a, const Model& b) {
    return ((a.numbers_ + b.numbers_) >> 1) & kAllButFirst;
  }

 private:
  static constexpr uint16_t kAll = 0xFFFF;
  static constexpr Cumulative kAllButFirst = {0,    kAll, kAll, kAll, kAll, kAll, kAll, kAll,
                                              kAll, kAll, kAll, kAll, kAll, kAll, kAll, kAll};

  Cumulative numbers_;  // in place of the first one, the pace
};

// The probability of a one, of kWhole.
struct Flag {
  uint16_t one = kWhole / 2, pace = kFast;

  void update(bool bit) {
    const uint32_t shift = shift_of(pace);
    pace = uint16_t(pace + ((kSlow - pace) >> shift));
    one = uint16_t(bit ? one + ((kWhole - 1 - one) >> shift) : one - ((one - 1) >> shift));
  }
};

// The symbol whose range holds `slot`.
inline uint32_t find_symbol(const Cumulative& c, uint32_t slot) {
#if MESHLET_AVX2
  const __m256i above = _mm256_cmpgt_epi16(__m256i(c), _mm256_set1_epi16(int16_t(slot)));
  return _tzcnt_u32(uint32_t(_mm256_movemask_epi8(above))) / 2 - 1;
#elif defined(__wasm_simd128__)
  v128_t half[2];
  std::memcpy(half, &c, sizeof half);
  const v128_t limit = wasm_i16x8_splat(int16_t(slot));
  const v128_t above =
      wasm_i8x16_narrow_i16x8(wasm_i16x8_gt(half[0], limit), wasm_i16x8_gt(half[1], limit));
  return uint32_t(__builtin_ctz(wasm_i8x16_bitmask(above) | 0x10000u)) - 1;
#else
  uint32_t k = kSymbols - 1;
  while (c[k] > slot) k--;
  return k;
#endif
}

// Reads a page. What it reads beyond the end means nothing; finished() says whether the page ended
// where its data did.
class Decoder {
 public:
  static constexpr bool kDecodes = true;
  static constexpr uint32_t kPadding = 8;  // readable bytes after a page

  // Returns false if the page is shorter than its header says. header: kPageHeaderWords words.
  bool open(const uint8_t* page, size_t size, uint32_t* header) {
    if (size < 4 * kPageHeaderWords) return false;
    std::memcpy(header, page, 4 * kPageHeaderWords);
    word_end_ = header[2];
    if (word_end_ > (size - 4 * kPageHeaderWords) / 4) return false;
    state_ = uint64_t(header[4]) << 32 | header[3];
    words_ = page + 4 * kPageHeaderWords;
    bytes_ = words_ + 4 * size_t(word_end_);
    byte_end_ = uint64_t(page + size - bytes_);
    word_ = 0;
    bit_ = 0;
    ranges_[kSymbols] = kWhole;
    return true;
  }
  // Unused bits of the last byte are zeros.
  bool finished() {
    const uint64_t left = 8 * byte_end_ - bit_;  // huge beyond the end
    return state_ == kStateEnd && word_ == word_end_ && left < 8 && bits(0, uint32_t(left)) == 0;
  }

  uint32_t symbol(Model& a, Model& b, uint32_t = 0) {
    const uint32_t k = decode(Model::mean(a, b));
    a.update(k);
    b.update(k);
    return k;
  }
  uint32_t symbol(Model& a, uint32_t = 0) {
    const uint32_t k = decode(a.cumulative());
    a.update(k);
    return k;
  }
  bool flag(Flag& f, bool = false) {
    const uint32_t zero = kWhole - f.one;
    const bool bit = slot() >= zero;
    if (bit)
      advance(zero, f.one);
    else
      advance(0, zero);
    f.update(bit);
    return bit;
  }
  // n <= 32.
  uint32_t bits(uint32_t, uint32_t n) {
    const uint64_t at = bit_ >> 3;
    uint64_t word;
    std::memcpy(&word, bytes_ + (at < byte_end_ ? at : byte_end_), 8);
    word >>= bit_ & 7;
    bit_ += n;
    return uint32_t(word) & uint32_t((1ull << n) - 1);
  }

 private:
  uint32_t slot() const { return uint32_t(state_) & (kWhole - 1); }
  uint32_t decode(const Cumulative& c) {
    std::memcpy(ranges_, &c, sizeof c);
    const uint32_t k = find_symbol(c, slot());
    advance(ranges_[k], uint32_t(ranges_[k + 1]) - ranges_[k]);
    return k;
  }
  void advance(uint32_t start, uint32_t frequency) {
    state_ = frequency * (state_ >> kProbabilityBits) + slot() - start;
    if (state_ >= kStateEnd) return;
    uint32_t word;
    std::memcpy(&word, words_ + 4 * size_t(std::min<uint32_t>(word_, word_end_)), 4);
    state_ = state_ << 32 | word;
    word_++;
  }

  alignas(32) uint16_t ranges_[kSymbols + 1] = {};
  uint64_t state_;
  const uint8_t *words_, *bytes_;
  uint32_t word_, word_end_;
  uint64_t bit_, byte_end_;  // in bytes_
};

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif

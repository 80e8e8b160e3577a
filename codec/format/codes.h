// Choices that encoder and unpacker make alike, so that they write the same bytes: codes of
// residuals, widths of anchors, entries of a group's table (spec, appendix A, and "Canonical form"
// of EXT_meshlet_transport).
#pragma once
#include <algorithm>
#include <cstdint>

#include "common/bits.h"
#include "format/constants.h"

namespace gltf_meshlet_codec {

// How one list of residuals is written.
struct Code {
  enum Kind : uint8_t { kRice, kExponential, kFixed };
  Kind kind = kRice;
  uint32_t k = 0;                     // parameter of kRice and kExponential
  uint32_t widths[4] = {0, 0, 0, 0};  // kFixed: per element

  // The unary part of a residual, of kRice and kExponential.
  uint32_t quotient(uint32_t u) const {
    return kind == kRice ? u >> k : bit_length(uint32_t((uint64_t(u) >> k) + 1)) - 1;
  }
};

// The lists that have a code.
enum class CodedList { kChain, kInterior };

// Field 0 to 6 of a stream with base `base`; the parameter may be too large.
inline Code code_of_field(CodedList list, uint32_t field, uint32_t base) {
  if (list == CodedList::kChain || field < CODE_FIRST_EXPONENTIAL)
    return {Code::kRice, base + field, {}};
  return {Code::kExponential, std::max(base, 1u) - 1 + field - CODE_FIRST_EXPONENTIAL, {}};
}

// The fixed width for numbers of `length` bits.
inline uint32_t fixed_width(uint32_t length) { return length >= WIDTH_ESCAPE ? 32 : length; }

// The width field that holds numbers of `length` bits, of further anchors of a stream with `bits`
// and anchor base `base`.
inline uint32_t anchor_field(uint32_t length, uint32_t bits, uint32_t base) {
  const uint32_t field = length > base ? length - base : 0;
  return std::min(base + field, bits) < length || field > ANCHOR_WIDTH_FULL ? ANCHOR_WIDTH_FULL
                                                                            : field;
}

inline uint32_t anchor_width(uint32_t field, uint32_t bits, uint32_t base) {
  return field == ANCHOR_WIDTH_FULL ? bits : std::min(base + field, bits);
}

// The starts of a group's meshlets: meshlet i starts stride * i - bias + entry i bytes after the
// entries, which have `width` bits each.
struct GroupEntries {
  uint32_t stride, bias, width;

  uint32_t entry(uint32_t i, uint32_t start) const { return start + bias - stride * i; }
};

// starts: of the group's meshlets, from its first on; length: of all.
inline GroupEntries entries_of(const uint32_t* starts, uint32_t count, uint32_t length) {
  constexpr int64_t kLargest = 0xFFFF;  // stride and bias
  int64_t stride = std::min<int64_t>(length / count, kLargest), lowest, highest;
  for (;; stride /= 2) {
    lowest = highest = 0;
    for (uint32_t i = 0; i < count; i++) {
      const int64_t deviation = int64_t(starts[i]) - stride * int64_t(i);
      lowest = std::min(lowest, deviation);
      highest = std::max(highest, deviation);
    }
    if (-lowest <= kLargest) break;
  }
  return {uint32_t(stride), uint32_t(-lowest), bit_length(uint32_t(highest - lowest))};
}

}  // namespace gltf_meshlet_codec

// Codes of residuals and their sizes: Rice, exp-Golomb, or fixed widths (spec, appendix A.5).
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "encode/bit_writer.h"
#include "format/constants.h"

namespace meshlet {

constexpr uint64_t kImpossible = ~0ull >> 8;  // bits of a code that cannot hold the residuals

// The zigzag number of a difference of integers of `bits` bits, which counts modulo 2^bits.
inline uint32_t zigzag(uint32_t difference, uint32_t bits) {
  const uint32_t unused = 32 - bits;
  difference = uint32_t(int32_t(difference << unused) >> unused);
  return difference << 1 ^ (0u - (difference >> 31));
}
inline uint32_t bit_length(uint32_t u) { return u ? 32u - uint32_t(__builtin_clz(u)) : 0u; }

// How one list of residuals is written.
struct Code {
  enum Kind { kRice, kExponential, kFixed };
  Kind kind = kRice;
  uint32_t k = 0;                     // parameter of kRice and kExponential
  uint32_t widths[4] = {0, 0, 0, 0};  // kFixed: per element
};

// The lists that have a code.
enum class CodedList { kChain, kInterior };

// Field 0 to 6 of a stream with base `base`; the parameter may be too large.
inline Code code_of_field(CodedList list, uint32_t field, uint32_t base) {
  if (list == CodedList::kChain || field < CODE_FIRST_EXPONENTIAL)
    return {Code::kRice, base + field, {}};
  return {Code::kExponential, std::max(base, 1u) - 1 + field - CODE_FIRST_EXPONENTIAL, {}};
}

inline Code fixed_code(const std::vector<uint32_t>& residuals, uint32_t elements) {
  Code code{Code::kFixed, 0, {}};
  for (size_t i = 0; i < residuals.size(); i++)
    code.widths[i % elements] = std::max(code.widths[i % elements], bit_length(residuals[i]));
  for (uint32_t& w : code.widths)
    if (w >= WIDTH_ESCAPE) w = 32;
  return code;
}

// Bits of the residuals under Rice parameter k.
inline uint64_t rice_bits(const std::vector<uint32_t>& residuals, uint32_t k) {
  uint64_t bits = residuals.size() * uint64_t(k + 1);
  uint32_t largest = 0;
  for (uint32_t u : residuals) {
    bits += u >> k;
    largest |= u >> k;
  }
  return largest > MAX_QUOTIENT ? kImpossible : bits;
}

// Bits of the residuals under exp-Golomb parameter k.
inline uint64_t exponential_bits(const std::vector<uint32_t>& residuals, uint32_t k) {
  uint64_t bits = 0;
  for (uint32_t u : residuals) {
    if (k == 0 && u == 0xFFFFFFFFu) return kImpossible;  // a quotient of 32
    bits += 2 * bit_length((u >> k) + 1) - 1 + k;
  }
  return bits;
}

// The Rice parameter with the fewest bits, searched for around the mean's bit length.
inline uint32_t best_rice(const std::vector<uint32_t>& residuals) {
  uint64_t sum = 0;
  for (uint32_t u : residuals) sum += u;
  uint32_t k = residuals.empty() ? 0 : bit_length(uint32_t(sum / residuals.size()));
  uint32_t best = k > 1 ? k - 2 : 0;
  for (uint32_t i = best + 1; i <= k + 1 && i <= CODE_MAX_PARAMETER; i++)
    if (rice_bits(residuals, i) < rice_bits(residuals, best)) best = i;
  return best;
}

// Bits of a list under every code.
struct CodeSizes {
  uint64_t rice[CODE_MAX_PARAMETER + 1], exponential[CODE_MAX_PARAMETER + 1];
  uint64_t fixed;  // with its widths

  CodeSizes(const std::vector<uint32_t>& residuals, uint32_t elements) {
    uint32_t all = 0;
    for (uint32_t u : residuals) all |= u;
    const uint32_t length = bit_length(all);
    for (uint32_t k = 0; k <= CODE_MAX_PARAMETER; k++) {
      const bool small = k > length && length < 31;  // all quotients are 0
      const uint64_t plain = residuals.size() * uint64_t(k + 1);
      rice[k] = small ? plain : rice_bits(residuals, k);
      exponential[k] = small ? plain : exponential_bits(residuals, k);
    }
    fixed = WIDTH_BITS * elements;
    const Code code = fixed_code(residuals, elements);
    for (uint32_t c = 0; c < elements; c++) fixed += code.widths[c] * (residuals.size() / elements);
  }

  uint64_t of_field(CodedList list, uint32_t field, uint32_t base) const {
    if (field == CODE_ESCAPE) return fixed;
    const Code code = code_of_field(list, field, base);
    if (code.k > CODE_MAX_PARAMETER) return kImpossible;
    return (code.kind == Code::kRice ? rice : exponential)[code.k];
  }

  // The field with the fewest bits.
  uint32_t best_field(CodedList list, uint32_t base) const {
    uint32_t best = 0;
    for (uint32_t field = 1; field <= CODE_ESCAPE; field++)
      if (of_field(list, field, base) < of_field(list, best, base)) best = field;
    return best;
  }

  // The fewest bits under any code.
  uint64_t least() const {
    const uint64_t* end = rice + CODE_MAX_PARAMETER + 1;
    const uint64_t* exponential_end = exponential + CODE_MAX_PARAMETER + 1;
    return std::min(
        {*std::min_element(rice, end), *std::min_element(exponential, exponential_end), fixed});
  }
};

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

inline void write_unary(BitWriter& out, const std::vector<uint32_t>& residuals, const Code& code) {
  if (code.kind == Code::kFixed) return;
  for (uint32_t u : residuals)
    out.put_unary(code.kind == Code::kRice ? u >> code.k : bit_length((u >> code.k) + 1) - 1);
}

inline void write_low(BitWriter& out, const std::vector<uint32_t>& residuals, const Code& code,
                      uint32_t elements) {
  for (size_t i = 0; i < residuals.size(); i++) {
    const uint32_t u = residuals[i];
    if (code.kind == Code::kRice)
      out.put(u, code.k);
    else if (code.kind == Code::kFixed)
      out.put(u, code.widths[i % elements]);
    else
      out.put(u + (1u << code.k), bit_length((u >> code.k) + 1) - 1 + code.k);
  }
}

}  // namespace meshlet

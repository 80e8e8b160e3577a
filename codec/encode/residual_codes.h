// Codes of residuals and their sizes: Rice, exp-Golomb, or fixed widths (spec, appendix A.5).
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "common/array.h"
#include "encode/bit_writer.h"
#include "format/codes.h"

namespace gltf_meshlet_codec {

constexpr uint64_t kImpossible = ~0ull >> 8;  // bits of a code that cannot hold the residuals

// Some residuals, vertex by vertex.
struct Residuals : Span<uint32_t> {
  uint32_t bits_used() const {  // the largest bit length
    uint32_t all = 0;
    for (uint32_t u : *this) all |= u;
    return bit_length(all);
  }
};

inline Code fixed_code(Residuals residuals, uint32_t elements) {
  Code code{Code::kFixed, 0, {}};
  uint32_t all[STREAM_MAX_ELEMENTS] = {};
  for (size_t i = 0; i < residuals.count; i += elements)
    for (uint32_t c = 0; c < elements; c++) all[c] |= residuals.data[i + c];
  for (uint32_t c = 0; c < elements; c++) {
    code.widths[c] = fixed_width(bit_length(all[c]));
  }
  return code;
}

// With its widths.
inline uint64_t fixed_bits(Residuals residuals, uint32_t elements) {
  const Code code = fixed_code(residuals, elements);
  uint64_t bits = WIDTH_BITS * elements;
  for (uint32_t c = 0; c < elements; c++) bits += code.widths[c] * (residuals.count / elements);
  return bits;
}

// Bits of the residuals under Rice parameter k. length: residuals.bits_used().
inline uint64_t rice_bits(Residuals residuals, uint32_t length, uint32_t k) {
  const uint64_t plain = residuals.count * uint64_t(k + 1);
  if (length <= k) return plain;
  if (length > k + bit_length(MAX_QUOTIENT)) return kImpossible;
  static_assert((MAX_QUOTIENT & (MAX_QUOTIENT + 1)) == 0);
  uint32_t quotients = 0;  // of one meshlet: fits
  for (uint32_t u : residuals) quotients += u >> k;
  return plain + quotients;
}

// Bits of the residuals under exp-Golomb parameter k. length: residuals.bits_used().
inline uint64_t exponential_bits(Residuals residuals, uint32_t length, uint32_t k) {
  const uint64_t plain = residuals.count * uint64_t(k + 1);
  if (length < k) return plain;  // all quotients are 0
  uint64_t quotients = 0;
  if (length < 24) {
    // A float's exponent is its bit length, and these are exact.
    uint32_t sum = 0;
    for (uint32_t u : residuals) {
      const float value = float(int32_t(u + (1u << k)));
      uint32_t bits;
      std::memcpy(&bits, &value, 4);
      sum += (bits >> 23) - (127 + k);
    }
    quotients = sum;
  } else {
    for (uint32_t u : residuals) {
      if (k == 0 && u == 0xFFFFFFFFu) return kImpossible;  // a quotient of 32
      quotients += bit_length((u >> k) + 1) - 1;
    }
  }
  return plain + 2 * quotients;
}

// Bits under the Rice parameter with the fewest, of four around the mean's bit length.
inline uint64_t best_rice_bits(Residuals residuals) {
  uint64_t sum = 0;
  uint32_t all = 0;
  for (uint32_t u : residuals) {
    sum += u;
    all |= u;
  }
  const uint32_t length = bit_length(all);
  const uint32_t k = residuals.count ? bit_length(uint32_t(sum / residuals.count)) : 0;
  uint64_t least = kImpossible;
  for (uint32_t i = k > 1 ? k - 2 : 0; i <= k + 1 && i <= CODE_MAX_PARAMETER; i++)
    least = std::min(least, rice_bits(residuals, length, i));
  return least;
}

// Bits of a list under every code.
struct CodeSizes {
  uint64_t rice[CODE_MAX_PARAMETER + 1], exponential[CODE_MAX_PARAMETER + 1];
  uint64_t fixed;

  CodeSizes(Residuals residuals, uint32_t elements) : fixed(fixed_bits(residuals, elements)) {
    const uint32_t length = residuals.bits_used();
    for (uint32_t k = 0; k <= CODE_MAX_PARAMETER; k++) {
      rice[k] = rice_bits(residuals, length, k);
      exponential[k] = exponential_bits(residuals, length, k);
    }
  }

  // The bits of the field with the fewest, of a stream with base `base`.
  uint64_t best(CodedList list, uint32_t base) const {
    uint64_t least = fixed;
    for (uint32_t field = 0; field < CODE_ESCAPE; field++) {
      const Code code = code_of_field(list, field, base);
      if (code.k > CODE_MAX_PARAMETER) continue;
      least = std::min(least, (code.kind == Code::kRice ? rice : exponential)[code.k]);
    }
    return least;
  }

  // The fewest bits under any code.
  uint64_t least() const {
    const uint64_t* end = rice + CODE_MAX_PARAMETER + 1;
    const uint64_t* exponential_end = exponential + CODE_MAX_PARAMETER + 1;
    return std::min(
        {*std::min_element(rice, end), *std::min_element(exponential, exponential_end), fixed});
  }
};

// The field with the fewest bits, of a stream with base `base`.
inline uint32_t best_field(Residuals residuals, uint32_t elements, CodedList list, uint32_t base) {
  const uint32_t length = residuals.bits_used();
  uint32_t best = 0;
  uint64_t least = ~0ull;
  for (uint32_t field = 0; field <= CODE_ESCAPE; field++) {
    const Code code = code_of_field(list, field, base);
    uint64_t bits = kImpossible;
    if (field == CODE_ESCAPE)
      bits = fixed_bits(residuals, elements);
    else if (code.k <= CODE_MAX_PARAMETER)
      bits = code.kind == Code::kRice ? rice_bits(residuals, length, code.k)
                                      : exponential_bits(residuals, length, code.k);
    if (bits < least) {
      least = bits;
      best = field;
    }
  }
  return best;
}

inline void write_unary(BitWriter& out, Residuals residuals, const Code& code) {
  if (code.kind == Code::kFixed) return;
  for (uint32_t u : residuals) out.put_unary(code.quotient(u));
}

inline void write_low(BitWriter& out, Residuals residuals, const Code& code, uint32_t elements) {
  for (size_t i = 0; i < residuals.count; i++) {
    const uint32_t u = residuals.data[i];
    if (code.kind == Code::kRice)
      out.put(u, code.k);
    else if (code.kind == Code::kFixed)
      out.put(u, code.widths[i % elements]);
    else
      out.put(u + (1u << code.k), bit_length((u >> code.k) + 1) - 1 + code.k);
  }
}

}  // namespace gltf_meshlet_codec

// Where a blob's bits go.
#pragma once
#include <cstdint>
#include <vector>

#include "decode/decoder_context.h"

namespace meshlet {

struct Description {
  uint64_t connectivity = 0;              // section A, bits
  uint64_t references = 0;                // header, tables, sections B and C, padding
  std::vector<uint64_t> streams;          // sections D to H
  uint64_t symbols[5] = {0, 0, 0, 0, 0};  // C, L, E, R, S
  uint64_t components = 0;
  std::vector<uint64_t> kinds;  // references: owned, private, foreign
};

// The parts sum to the blob's size in bits. Throws Malformed.
Description describe(const uint8_t* data, size_t size);

}  // namespace meshlet

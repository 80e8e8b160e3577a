// Where a blob's bits go.
#pragma once
#include <cstdint>
#include <vector>

#include "decode/decoder_context.h"

namespace meshlet {

struct BitStatistics {
  uint64_t connectivity = 0;              // symbols, bits
  uint64_t references = 0;                // header, tables, references, codes, padding, bits
  std::vector<uint64_t> streams;          // anchors and residuals, bits
  uint64_t symbols[5] = {0, 0, 0, 0, 0};  // number of C, L, E, R, S
  uint64_t disks = 0;
  uint64_t owned_references = 0, private_references = 0, foreign_references = 0;

  void add(const BitStatistics& other);
};

// Decodes every meshlet. The bits sum to the blob's size. Throws Malformed.
BitStatistics count_bits(const uint8_t* data, size_t size);

}  // namespace meshlet

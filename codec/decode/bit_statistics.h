// Counts the bits of a blob's sections.
#pragma once
#include <cstdint>

#include "format/blob.h"

namespace gltf_meshlet_codec {

struct BitStatistics {
  uint64_t connectivity = 0;                // symbols, bits
  uint64_t references = 0;                  // header, tables, references, codes, padding, bits
  uint64_t streams[BLOB_MAX_STREAMS] = {};  // anchors and residuals, bits
  uint64_t symbols[5] = {0, 0, 0, 0, 0};    // number of C, L, E, R, S
  uint64_t disks = 0;
  uint64_t owned_references = 0, private_references = 0, foreign_references = 0;

  void add(const BitStatistics& other) {
    connectivity += other.connectivity;
    references += other.references;
    for (size_t s = 0; s < BLOB_MAX_STREAMS; s++) streams[s] += other.streams[s];
    for (int i = 0; i < 5; i++) symbols[i] += other.symbols[i];
    disks += other.disks;
    owned_references += other.owned_references;
    private_references += other.private_references;
    foreign_references += other.foreign_references;
  }
};

// Decodes every meshlet of a checked blob. The bits sum to its size. Returns the rule that it
// breaks, if any.
Problem count_bits(const uint8_t* data, size_t size, BitStatistics& out);

}  // namespace gltf_meshlet_codec

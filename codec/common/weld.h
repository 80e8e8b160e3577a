// Gives identical rows of bytes one number.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gltf_meshlet_codec {

// rows: `count` rows of `stride` bytes; count < 2^32 - 1. Writes remap[i]: equal for equal rows,
// numbered from 0 in order of first occurrence. Returns the number of different rows.
uint32_t weld_rows(const uint8_t* rows, size_t count, size_t stride, uint32_t* remap);

}  // namespace gltf_meshlet_codec

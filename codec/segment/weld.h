// Identical rows of bytes get one number.
#pragma once

#include <cstddef>
#include <cstdint>

namespace meshlet {

// rows: count rows of `stride` bytes each. Writes remap[i], equal for rows i of equal bytes,
// numbered from 0 in order of first occurrence; returns how many different rows there are. count is
// below 2^32 - 1.
uint32_t weld_rows(const uint8_t* rows, size_t count, size_t stride, uint32_t* remap);

}  // namespace meshlet

// Bit statistics as the C interface has them.
#pragma once
#include "c/gltf_meshlet_internal.h"
#include "decode/bit_statistics.h"

namespace gltf_meshlet_codec {

void copy_statistics(const BitStatistics& from, gltf_meshlet_statistics& to);

}  // namespace gltf_meshlet_codec

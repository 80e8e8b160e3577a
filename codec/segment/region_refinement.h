// Not in the paper: moves region borders triangle by triangle. Full regions pass triangles on to
// regions with room instead of being halved, and borders become shorter.
#pragma once

#include "segment/patches.h"

namespace gltf_meshlet_codec {

struct RefinementOptions {
  int max_size;      // triangles per region
  int sweeps;        // over all triangles, to shorten borders
  int max_failures;  // failed searches for room per full region
};

// Changes patch.region. Regions stay edge-connected; most come within max_size, not necessarily
// all.
void refine_regions(Patch& patch, const RefinementOptions& options);

}  // namespace gltf_meshlet_codec

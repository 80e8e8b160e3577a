// Beyond the paper: region borders are moved triangle by triangle, so that full regions hand
// triangles on to those with room instead of being halved, and borders become short.
#pragma once

#include "segment/patch.h"

namespace meshlet {

struct RefinementOptions {
  int max_size;  // triangles per region
  int sweeps;    // over all triangles, to shorten borders
};

// Changes patch.region. Regions stay edge-connected; those that can be are brought within max_size.
void refine_regions(Patch& patch, const RefinementOptions& options);

}  // namespace meshlet

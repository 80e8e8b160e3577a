// Regions by the paper's rounds of attaching triangles to centres and moving the centres.
#pragma once

#include <cstdint>

#include "segment/segment.h"
#include "segment/patch.h"

namespace meshlet {

struct GrowthOptions {
  float mean_size;  // F_a: triangles per region that the number of centres aims at
  int max_size;     // N_max
  float lambda;
  Weight weight;
  int iterations;
};

// Fills patch.region and patch.region_count: every region is edge-connected. Returns the rounds it
// took until the centres stayed where they were, at most options.iterations (and at least 1).
int grow_regions(Patch& patch, const GrowthOptions& options);

}  // namespace meshlet

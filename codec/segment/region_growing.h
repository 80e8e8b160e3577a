// Grows regions as in the paper: rounds of attaching triangles to centres and moving the centres.
#pragma once

#include <cstdint>

#include "segment/generate_meshlets.h"
#include "segment/patch.h"

namespace meshlet {

struct GrowthOptions {
  float mean_size;  // F_a: mean triangles per region; sets the number of centres
  int max_size;     // N_max
  float lambda;
  Weight weight;
  int iterations;
};

// Fills patch.region and patch.region_count with edge-connected regions. Returns the number of
// rounds until the centres stopped moving: 1 to options.iterations.
int grow_regions(Patch& patch, const GrowthOptions& options);

}  // namespace meshlet

// Grows regions around centres that move.
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
  Effort effort;
  int iterations;  // kHigh and above: most rounds
};

// Fills patch.region and patch.region_count. Returns the number of rounds in which centres moved.
//
// kHigh and above: as in the paper, rounds of attaching triangles to centres and moving the
// centres, until these stop. Regions are edge-connected.
// kNormal: most rounds only shift the borders of regions; the regions are edge-connected.
// kFast: regions start as runs of triangles along the curve, then borders shift; a region may fall
// apart.
int grow_regions(Patch& patch, const GrowthOptions& options);

}  // namespace meshlet

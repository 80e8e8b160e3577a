// Grows regions around centres that move.
#pragma once

#include <cstdint>

#include "segment/patches.h"

namespace gltf_meshlet_codec {

// The weight that orders the attachment of triangles to regions: equation (1) of the paper, with
// its penalty C(F) for full regions, or without, as in Choe et al.
enum class Weight { kPaper, kChoe };

struct GrowthOptions {
  float mean_size;  // F_a: mean triangles per region; sets the number of centres
  int max_size;     // N_max
  float lambda;
  Weight weight;
  int rounds;  // at most
  // Above 0: the number of cycles, which replace the rounds. A cycle has `sweeps` that shift
  // borders, then one growth.
  int cycles;
  int sweeps;
  // Cycles mend the regions that fell apart instead of growing all anew.
  bool mends;
};

// Fills patch.region and patch.region_count with edge-connected regions. Returns the number of
// times that centres moved.
//
// In rounds, as in the paper: triangles are attached to centres and the centres moved, until these
// stop, at most options.rounds times. In cycles: regions start as ranges of triangles along
// the curve, and most steps only shift borders.
int grow_regions(Patch& patch, const GrowthOptions& options);

}  // namespace gltf_meshlet_codec

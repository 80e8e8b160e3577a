// Shared by the ray-tracing shaders: specialisation constants, numbers of meshlets.
#ifndef RT_COMMON_GLSL
#define RT_COMMON_GLSL

#include "raytrace/rt_constants.h"
#include "decoders/slots.glsl"

// Ids 0 and 1 are the decoder's MAX_STREAMS and MAX_ELEMENTS.
layout(constant_id = 2) const uint BOX_TRIANGLES = 64u;  // triangles per box
// The slots hold one part of the model at a time: paths sweep over it, see rt_paths.glsl.
layout(constant_id = 9) const bool SWEEPS = false;

#define BOXES (MESHLET_TRIANGLES / BOX_TRIANGLES)  // boxes of a meshlet

// Meshlets have numbers across primitives. A part of the model is a range of numbers, and so is a
// piece: the meshlets of a part that belong to one primitive. Placed: a piece in an instance.
struct Placed {
  uint instance;
  uint primitive;
  uint first;  // number of the piece's first meshlet
  uint key;    // smallest key of the instance's hits, see hit_key
};
struct Source {
  uint primitive;
  uint meshlet;  // in its primitive
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer PlacedPieces {
  Placed at[];
};
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Sources {
  Source at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Counts { uint at[]; };

#endif

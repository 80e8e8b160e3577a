// A team whose triangles always come from the parallel connectivity: what team_meshlet.glsl needs.
//
// needs: WORKGROUP
#ifndef PARALLEL_TRIANGLES_GLSL
#define PARALLEL_TRIANGLES_GLSL

#include "decoders/team_connectivity.glsl"

uint packed_triangle(uint t) { return parallel_triangle(t); }
uvec2 connectivity_starts() { return parallel_starts(); }
uvec2 connectivity_boundary() { return parallel_boundary(); }

#endif

// Path `visibility`, first: no surface anywhere, and no pieces. A thread takes a pixel, and others
// a whole dispatch further on: a large picture has more pixels than a dispatch may have threads.
//
// Outputs: the visibility buffer; the number of pieces; with a pool, the counters of the frame.
// variants: visibility_clear.comp=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "visibility/counters.glsl"
layout(local_size_x = CLEAR_THREADS) in;

void main() {
  uint first = gl_GlobalInvocationID.x;
  if (first == 0u) begin_frame();
  uint pixels = the_frame().width * the_frame().height;
  for (uint i = first; i < pixels; i += gl_NumWorkGroups.x * CLEAR_THREADS)
    Pixels(push.pixels).at[i] = pack64(uvec2(0u, floatBitsToUint(1.0)));
}

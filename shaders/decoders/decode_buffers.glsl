// What connect.comp leaves behind for the passes after it.
#ifndef DECODE_BUFFERS_GLSL
#define DECODE_BUFFERS_GLSL

layout(buffer_reference, std430, buffer_reference_align = 4) buffer Integers { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Pairs { uvec2 at[]; };
// triangles | vertices << 8 | error << 16; no triangles and vertices where connect.comp finds a
// meshlet malformed, or leaves it out. What several invocations of a pass find wrong is or'ed, so
// that an error is not always one of ERROR_.
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Summaries { uint of[]; };

struct Connected {
  uvec2 boundary;  // mask of the boundary vertices
  uvec2 starts;    // mask of the triangles that begin a component
  uvec2
      references;  // mask of the ranks along the boundary at which references begin (lengths.comp)
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Connectivity {
  Connected of[];
};

#endif

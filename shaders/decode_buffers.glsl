// What connect.comp leaves behind for the passes after it.
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Integers { uint at[]; };
// triangles | vertices << 8 | error << 16; no triangles and vertices where connect.comp finds a meshlet malformed, or leaves it out
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Summaries { uint of[]; };

struct Connected {
  uvec2 boundary;        // mask of the boundary vertices
  uvec2 starts;          // mask of the triangles that begin a component
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Connectivity { Connected of[]; };

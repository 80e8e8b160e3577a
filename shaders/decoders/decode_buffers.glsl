// Buffers that connect.comp and lengths.comp fill for the passes after them.
#ifndef DECODE_BUFFERS_GLSL
#define DECODE_BUFFERS_GLSL

layout(buffer_reference, std430, buffer_reference_align = 4) buffer Integers { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Pairs { uvec2 at[]; };
// triangles | vertices << 8 | error << 16. Both counts are 0 if the meshlet is malformed or not
// wanted. Threads combine errors by OR: the result need not be one of the ERROR_ constants.
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Summaries { uint of[]; };

struct Connected {
  uvec2 boundary;  // mask of the boundary vertices
  uvec2 starts;    // mask of the triangles that begin a disk
  uvec2 closing;   // masks of the symbols C, E and S
  uvec2 ends;
  uvec2 splits;
  // Mask of the ranks along the boundary at which references begin; written by lengths.comp.
  uvec2 references;
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Connectivity {
  Connected of[];
};

// Where the sections of a meshlet lie: bit positions, written by lengths.comp. NO_PLACE if what
// comes before is malformed.
struct Places {
  uint codes;
  uint anchors;
  uint chains;     // low bits of chains,
  uint quotients;  //   and their unary parts
  uint interior;
  uint flags;
  uvec2 waiting;  // mask of the boundary vertices that get their values in the traversal
};
#define NO_PLACE 0xFFFFFFFFu
#define PLACES_CHAINS 1u  // the meshlet has chains: codes are stored for them
#define PLACES_SEAMS 2u   // it has seams
layout(buffer_reference, std430, buffer_reference_align = 8) buffer PlacesOfMeshlets {
  Places of[];
};

#endif

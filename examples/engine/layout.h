// Where the decoded meshlets lie, for C++ and GLSL: in 32-bit words, from the begin of each.
#define MESHLET_COUNT 0u    // its triangles; 0 while it is not decoded
#define MESHLET_CORNERS 1u  // 64 triangles: three local vertices of 8 bits
#define MESHLET_POINTS 65u  // 64 vertices: position and normal, three floats each
#define POINT_WORDS 6u
#define MESHLET_WORDS 449u

// Hit attributes (from the intersection shader) and the ray payload (back to the ray's sender).

#include "raytrace/rt_constants.h"

struct HitAttributes {
  vec2 barycentrics;  // weights of the second and the third vertex
  uint triangle;      // in its meshlet
};

// What a path needs of a hit to go on. Packed by rt_packing.glsl.
struct Hit {
  float t;      // distance
  uint number;  // of the meshlet, and UNLIT
  uint normal;  // shading normal: world space, either side
  uint flat_normal;  // the triangle's own
  uint albedo;
  uint emission;
};
#define UNLIT 0x80000000u

struct Surface {
  Hit hit;  // t is negative for a miss, or BLOCKED; then the number is of the missing meshlet
  uint instance;
  uint id;  // meshlet * 64 + triangle
  vec2 barycentrics;
};

// PARTIAL: a ray that enters a meshlet without a slot reports a hit of this kind there, so that
// traversal goes on only in front of it.
#define KIND_BLOCKED 1u
#define BLOCKED -2.0

// PARTIAL: marks rays that may end at any hit. Borrows a flag that has no effect on boxes, because
// TerminateOnFirstHit would also end them where they are blocked.
#define RAY_TO_LIGHT gl_RayFlagsCullBackFacingTrianglesEXT

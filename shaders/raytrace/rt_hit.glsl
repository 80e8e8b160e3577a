// Hit attributes (from the intersection shader) and the ray payload (back to the ray's sender).

#include "raytrace/rt_constants.h"

struct HitAttributes {
  vec2 barycentrics;  // weights of the second and the third vertex
  uint triangle;      // in its meshlet
};

struct Surface {
  float t;  // distance; negative: a miss, or BLOCKED
  uint instance;
  uint id;            // meshlet * 64 + triangle; if BLOCKED, the number of the missing meshlet
  vec2 barycentrics;  // if BLOCKED, x is a distance up to which the ray hits nothing
  vec3 normal;        // shading normal: world space, unit length, either side
  vec3 flat_normal;   // the triangle's own
  vec3 albedo;
  uvec2 emission;  // red, green, blue as 16-bit floats
};

// DEFERRED: a ray that enters a meshlet without a slot reports a hit of this kind there, so that
// traversal goes on only in front of it.
#define KIND_BLOCKED 1u
#define BLOCKED -2.0

// DEFERRED: marks rays that may end at any hit. Borrows a flag that has no effect on boxes, because
// TerminateOnFirstHit would also end them where they are blocked.
#define RAY_TO_LIGHT gl_RayFlagsCullBackFacingTrianglesEXT

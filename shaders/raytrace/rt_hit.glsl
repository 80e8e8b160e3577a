// What an intersection shader tells the shaders that follow it, and what they answer the ray's
// sender.

struct HitAttributes {
  vec2 barycentrics;  // weights of the second and the third vertex
  uint triangle;      // in its meshlet
};

struct Surface {
  float t;  // negative: nothing was hit, or BLOCKED
  uint instance;
  uint id;            // meshlet * 64 + triangle; BLOCKED: the number of the meshlet that it needs
  vec2 barycentrics;  // BLOCKED: first, up to where there is certainly nothing
  vec3 normal;  // for shading, in world space, of unit length; not yet turned towards the viewer
  vec3 flat_normal;  // the triangle's own
  vec3 albedo;
  uvec2 emission;  // red, green, blue in 16-bit floats
};

// What lies beyond the entrance to a meshlet that has no slot (DEFERRED) is not known. The ray is
// told that it has hit something there, of this kind, so that it goes no further than what may be
// in front of that.
#define KIND_BLOCKED 1u
#define BLOCKED -2.0

// The flag of rays (DEFERRED) that ask whether there is anything on their way, and so may end at
// any hit. What the flag is for does not concern boxes; TerminateOnFirstHit would have them end
// where they are blocked, too.
#define RAY_TO_LIGHT gl_RayFlagsCullBackFacingTrianglesEXT

// The custom index of an instance is its primitive's number, and a bit that tells that parts of it
// may be transparent.
#define PRIMITIVE_INDEX 0x7FFFFFu
#define INSTANCE_MASKED 0x800000u

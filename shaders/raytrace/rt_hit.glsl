// Hit attributes (from the intersection shader) and the ray payload (back to the ray's sender).
#ifndef RT_HIT_GLSL
#define RT_HIT_GLSL

struct HitAttributes {
  vec2 barycentrics;  // weights of the second and the third vertex
  uint triangle;      // in its meshlet
};

// What a path needs of a hit to go on, packed by rt_packing.glsl.
struct Hit {
  float t;           // distance
  uint normal;       // shading normal: world space, either side
  uint flat_normal;  // the triangle's own
  uint albedo;
  uint emission;  // or UNLIT: the albedo is all that is seen
};
#define UNLIT 0xFFFFFFFFu

struct Surface {
  Hit hit;  // t is negative for a miss
  uint instance;
  uint id;  // meshlet * 64 + triangle
  vec2 barycentrics;
};

#endif

// Paths, and how they sweep. A path goes from level to level: a level is the shadow ray of the last
// surface and the ray to the next one, which both start there.
//
// SWEEPS: all paths of a strip of the picture are at the same level. A pass traces its rays in one
// part of the model, whose meshlets are decoded before, and keeps the nearest hit in the pixel's
// record. After the last part the paths go to the next level.
#ifndef RT_PATHS_GLSL
#define RT_PATHS_GLSL

#include "raytrace/rt_common.glsl"
#include "raytrace/rt_hit.glsl"

// What a path knows of a level besides the hit. All paths round to it, whether they sweep or not.
struct Level {
  vec3 origin;      // of both rays
  uint direction;   // of the ray to the next surface: packed_unit
  uint throughput;  // packed_light
  float facing;     // cosine between the light and the last surface
};
struct Found {
  Hit hit;    // the nearest one in the parts so far; t is FAR if there is none
  uint rays;  // those of the level that are on their way: LIGHT, NEXT; 0 after the sample's end
  uvec2 sum;  // radiance over all samples so far: packed_sum
};
#define LIGHT 1u  // the shadow ray: nothing has stopped it yet
#define NEXT 2u   // the ray to the next surface; there is none after the last bounce
#define FAR 1e30
#define LEVEL_BOUNCE 0xFFu  // bits of RaysPush.level

// A record per pixel of a launch, then a second one for paths that have a second level.
layout(buffer_reference, std430, buffer_reference_align = 16) buffer FoundRecords { Found at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) buffer LevelRecords { Level at[]; };

#endif

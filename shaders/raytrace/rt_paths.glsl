// Paths, and how they sweep. A path goes from level to level: a level is the shadow ray of the last
// surface and the ray to the next one, which both start there.
//
// SWEEPS: all paths of a strip of the picture are at the same level. A pass traces its rays in one
// part of the model, whose meshlets are decoded before, and keeps the nearest hit in the pixel's
// record. After the last part the paths go to the next level.
// Include after rt_common.glsl and rt_hit.glsl.

struct Path {
  vec3 origin;            // of both rays
  vec3 direction;         // of the ray to the next surface
  uint packed_direction;  // packing it again might round again
  float nearest;          // that ray hits nothing before this distance
  vec3 throughput;
  float facing;  // cosine between the light and the last surface
  vec3 sum;      // radiance, over all samples so far
  uint pixel;
  uint number;    // of the sample
  uint bounce;    // number of the ray to the next surface; there is none after the last bounce
  bool to_light;  // whether there is a shadow ray, which nothing has stopped yet
};

// The records of a pixel.
struct Found {
  Hit hit;  // the nearest one in the parts so far; t is FAR if there is none
  uint to_light;
  uint ended;  // the sample has no more rays
  uint unused;
};
struct Level {
  vec3 origin;
  uint direction;
  uint throughput;
  float facing;
  uvec2 sum;
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer FoundRecords { Found at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) buffer LevelRecords { Level at[]; };

// The rectangle of the picture in which the scene is. Strips of `rows` rows take turns, as there
// are records for one.
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer View {
  uvec2 found;   // a record per pixel of a strip: Found
  uvec2 levels;  // a record per pixel of a strip: Level; 0 if paths have one ray
  uint left;
  uint top;
  uint width;
  uint height;
  uint rows;
  uint launches[];  // size of the launch of each strip
};

#define FAR 1e30
#define LEVEL_BOUNCE 0xFFu  // bits of RaysPush.level

// The pixel of the picture that this invocation works at.
uint launched_pixel() {
  uvec2 place = gl_LaunchIDEXT.xy;
  uint width = gl_LaunchSizeEXT.x;
  if (SWEEPS && (push.part & BACKGROUND) == 0u) {
    View view = View(push.view);
    place += uvec2(view.left, view.top + push.strip * view.rows);
    width = Frame(push.frame).width;
  }
  return place.y * width + place.x;
}

// Paths, and the records of those that wait. A path goes from level to level: a level is the shadow
// ray of the last surface and the ray to the next one, which both start there. Paths that wait
// trace the rays of their level again, from the start or (SWEEP) in one part of the model after
// the other. Include after rt_common.glsl, rt_hit.glsl and rt_cache.glsl.

struct Path {
  vec3 origin;     // of both rays
  vec3 direction;  // of the ray to the next surface
  uint packed_direction;  // packing it again might round again
  float nearest;   // that ray hits nothing before this distance
  vec3 throughput;
  float facing;   // cosine between the light and the last surface
  vec3 sum;       // radiance, over all samples so far
  uint pixel;
  uint number;    // of the sample
  uint bounce;    // number of the ray to the next surface; there is none after the last bounce
  bool to_light;  // whether there is a shadow ray, which nothing has stopped yet
};

// The records of a waiting path.
struct Found {
  uint pixel;
  uint progress;  // packed_progress, or DONE
  Hit hit;        // the nearest one in the parts so far; t is FAR if there is none
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

#define FAR 1e30
#define DONE 0xFFFFFFFFu

// 16 bits of sample, 8 of bounce, 1 for the shadow ray.
uint packed_progress(Path path) {
  return path.number << (BOUNCE_BITS + 1) | path.bounce << 1 | (path.to_light ? 1u : 0u);
}

// The record that this invocation works at.
uint launched_record() {
  return gl_LaunchIDEXT.x / spread_of(CacheState(push.state).records[push.turn]);
}

// The pixel of the picture that this invocation works at.
uint launched_pixel() {
  if (PARTIAL && push.kind != FIRST_RAYS)
    return FoundRecords(CacheState(push.state).found).at[launched_record()].pixel;
  return gl_LaunchIDEXT.y * gl_LaunchSizeEXT.x + gl_LaunchIDEXT.x;
}

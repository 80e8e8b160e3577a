// A path that waits for a meshlet goes on in the next round where it was, if there is a record for it; else it starts again.
// To be included after rt_common.glsl and rt_cache.glsl.

struct Path {
  vec3 origin;                             // of the ray that is on its way,
  float nearest;                           //   before which distance it meets nothing
  vec3 direction;                          // of that ray, or if that goes to the light of the one after it
  float facing;                            // cosine between the light and the surface that the ray to it comes from
  vec3 throughput;
  uint pixel;
  vec3 sum;                                // of light, over all samples so far
  uint progress;                           // packed_progress
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Paths { Path at[]; };

#define PATH_WORDS 16u
#define BOUNCE_BITS 11                     // of progress; above them 20 of the sample

uint packed_progress(uint samples, uint bounce, bool to_light) { return samples << (BOUNCE_BITS + 1) | bounce << 1 | (to_light ? 1u : 0u); }
uint samples_of(uint progress) { return progress >> (BOUNCE_BITS + 1); }
uint bounce_of(uint progress) { return (progress >> 1) & ((1u << BOUNCE_BITS) - 1u); }
bool is_to_light(uint progress) { return (progress & 1u) != 0u; }

// The records of the paths that go on in a round. Two rounds after one another have different ones.
Paths paths_of(uint round) {
  CacheState state = CacheState(push.state);
  return Paths(byte_offset(state.paths, PATH_WORDS, (round & 1u) * state.path_limit));
}

// The number in the picture of the pixel that the invocation works at.
uint launched_pixel() {
  if (RESUMES && push.resumed != 0u) return paths_of(push.round).at[gl_LaunchIDEXT.x].pixel;
  return (gl_LaunchIDEXT.y + push.first_row) * gl_LaunchSizeEXT.x + gl_LaunchIDEXT.x;
}

// Paths that wait for a meshlet: in the next round they resume from a record, or start again if
// none was free. Include after rt_common.glsl and rt_cache.glsl.

struct Path {
  vec3 origin;     // of the current ray
  float nearest;   // the current ray hits nothing before this distance
  vec3 direction;  // of the current ray; if that is a shadow ray, of the next one
  float facing;    // cosine between the light and the surface that the shadow ray leaves
  vec3 throughput;
  uint pixel;
  vec3 sum;       // radiance, over all samples so far
  uint progress;  // packed_progress
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Paths { Path at[]; };

// 20 bits of sample, 11 of bounce, 1 for shadow rays.
uint packed_progress(uint samples, uint bounce, bool to_light) {
  return samples << (BOUNCE_BITS + 1) | bounce << 1 | (to_light ? 1u : 0u);
}
uint samples_of(uint progress) { return progress >> (BOUNCE_BITS + 1); }
uint bounce_of(uint progress) { return (progress >> 1) & ((1u << BOUNCE_BITS) - 1u); }
bool is_to_light(uint progress) { return (progress & 1u) != 0u; }

// The records of a round. Successive rounds use different halves of the buffer.
Paths paths_of(uint round) {
  CacheState state = CacheState(push.state);
  return Paths(byte_offset(state.paths, PATH_WORDS, (round & 1u) * state.path_limit));
}

// Launches of later rounds have one dimension: first SPREAD invocations for each of the first
// SPREAD_PATHS records, only one of which works, because unrelated paths in one warp slow each
// other down; then one invocation for each other record; then the strip's pixels.
uint first_invocation(uint path) {
  return path < SPREAD_PATHS ? path * SPREAD : SPREAD_PATHS * (SPREAD - 1u) + path;
}

#define NO_PATH 0xFFFFFFFFu

// The work of an invocation: a record; or NO_PATH and a pixel of the picture; or NO_PATH twice.
struct Work {
  uint path;
  uint pixel;
};

// Whether this invocation prefetches: rows after the strip's in the first launch trace rays from
// the camera's predicted position, to learn which meshlets they will need.
bool looks_ahead() { return push.round == 0u && gl_LaunchIDEXT.y >= push.strip_rows; }

Work launched_work(uint width) {
  uint i = gl_LaunchIDEXT.x;
  if (push.round == 0u)
    return Work(
        NO_PATH,
        (gl_LaunchIDEXT.y + (looks_ahead() ? 0u - push.strip_rows : push.first_row)) * width + i);
  CacheState state = CacheState(push.state);
  uint paths = min(state.rounds[push.record].waiting, state.path_limit);
  uint spread = first_invocation(paths);
  if (!RESUMES || i >= spread) return Work(NO_PATH, push.first_row * width + i - spread);
  if (i >= SPREAD_PATHS * SPREAD) return Work(i - SPREAD_PATHS * (SPREAD - 1u), NO_PATH);
  return Work(i % SPREAD == 0u ? i / SPREAD : NO_PATH, NO_PATH);
}

// The pixel of the picture that this invocation works at.
uint launched_pixel() {
  Work work = launched_work(Frame(push.frame).width);
  return work.path == NO_PATH ? work.pixel : paths_of(push.round).at[work.path].pixel;
}

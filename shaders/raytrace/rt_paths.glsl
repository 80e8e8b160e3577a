// A path that waits for a meshlet goes on in the next round where it was, if there is a record for
// it; else it starts again. To be included after rt_common.glsl and rt_cache.glsl.

struct Path {
  vec3 origin;     // of the ray that is on its way,
  float nearest;   //   before which distance it meets nothing
  vec3 direction;  // of that ray, or if that goes to the light of the one after it
  float facing;    // cosine between the light and the surface that the ray to it comes from
  vec3 throughput;
  uint pixel;
  vec3 sum;       // of light, over all samples so far
  uint progress;  // packed_progress
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Paths { Path at[]; };

#define PATH_WORDS 16u
#define BOUNCE_BITS 11  // of progress; above them 20 of the sample

uint packed_progress(uint samples, uint bounce, bool to_light) {
  return samples << (BOUNCE_BITS + 1) | bounce << 1 | (to_light ? 1u : 0u);
}
uint samples_of(uint progress) { return progress >> (BOUNCE_BITS + 1); }
uint bounce_of(uint progress) { return (progress >> 1) & ((1u << BOUNCE_BITS) - 1u); }
bool is_to_light(uint progress) { return (progress & 1u) != 0u; }

// The records of the paths that go on in a round. Two rounds after one another have different ones.
Paths paths_of(uint round) {
  CacheState state = CacheState(push.state);
  return Paths(byte_offset(state.paths, PATH_WORDS, (round & 1u) * state.path_limit));
}

// Later rounds are launches of one dimension: the first paths with a record have SPREAD invocations
// each, of which one works, since paths that have nothing in common hold one another up where they
// run in lockstep; then come the other records, and then the strip's pixels.
#define SPREAD 32u
#define SPREAD_PATHS 4096u
uint first_invocation(uint path) {
  return path < SPREAD_PATHS ? path * SPREAD : SPREAD_PATHS * (SPREAD - 1u) + path;
}

#define NO_PATH 0xFFFFFFFFu

// What an invocation works at in a later round: a path's number, or NO_PATH and a pixel's number in
// the picture, or twice NO_PATH.
struct Work {
  uint path;
  uint pixel;
};

// The first launch has rows after the strip's, whose rays look ahead: from where the camera may
// soon be, to learn what they will need there.
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

// The number in the picture of the pixel that the invocation works at.
uint launched_pixel() {
  Work work = launched_work(Frame(push.frame).width);
  return work.path == NO_PATH ? work.pixel : paths_of(push.round).at[work.path].pixel;
}

// The counters of a frame, of its passes and of their phases. One thread sets them.
#ifndef COUNTERS_GLSL
#define COUNTERS_GLSL

#include "visibility/visibility.glsl"

#define STAMPS 0x3FFFFFFFu  // UNDECODED | stamp is no other value

// Drawing starts with no clusters to decode and to draw.
void begin_phase() {
  Jobs jobs = Jobs(push.jobs);
  jobs.cut.decoded_total += jobs.cut.fresh_total;
  jobs.cut.fresh_total = 0u;
  jobs.cut.connect = jobs.cut.values = uvec4(0u, 0u, 1u, 0u);
  jobs.cut.small.z = jobs.cut.pieces.z = jobs.cut.resolve.z = 0u;
  Pieces(push.pieces).at[0] = uvec2(0u);
}

// A pass may take all slots.
void begin_pass() {
  Jobs jobs = Jobs(push.jobs);
  uint taken = min(jobs.cut.cursor - jobs.cut.first_cursor, jobs.cut.slots);
  jobs.cut.cursor = jobs.cut.first_cursor = (jobs.cut.first_cursor + taken) % jobs.cut.slots;
  jobs.cut.stamp = (jobs.cut.stamp + 1u) & STAMPS;
}

void begin_frame() {
  Pieces(push.pieces).at[0] = uvec2(0u);
  if (!has_pool()) return;
  Jobs jobs = Jobs(push.jobs);
  jobs.cut.frame++;
  jobs.cut.fresh_total = 0u;
  begin_phase();
  begin_pass();
  jobs.cut.used = jobs.cut.decoded_total = jobs.cut.hidden = jobs.cut.triangles = 0u;
  jobs.cut.resolve.xy = (uvec2(picture_size()) + RESOLVE_SIDE - 1u) / RESOLVE_SIDE;
}

#endif

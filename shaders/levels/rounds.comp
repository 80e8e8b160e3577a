// Levels of detail, after cut.comp and with path `visibility` touch.comp: if there are more
// clusters than jobs or slots, it allows a larger error and has cut.comp choose again; in the last
// round, only top groups are left, which always fit. One thread.
//
// Inputs: numbers of clusters. Outputs: arguments of cut.comp, visibility_small.comp and mesh.task.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "levels/levels.glsl"
layout(local_size_x = 1) in;

#define GROWTH 4.0  // of the allowed error

void main() {
  Jobs jobs = Jobs(push.jobs);
  if (jobs.cut.dispatch.x == 0u) return;
  bool fits = jobs.cut.clusters <= jobs.cut.capacity && jobs.cut.used <= jobs.cut.slots;
  if (!fits && jobs.cut.rounds < push.last_round) {
    jobs.cut.rounds++;
    bool last = jobs.cut.rounds == push.last_round;
    jobs.cut.max_pixels = last ? uintBitsToFloat(INFINITE_BITS) : GROWTH * jobs.cut.max_pixels;
    jobs.cut.clusters = 0u;
    jobs.cut.used = 0u;
    jobs.cut.stamp++;
    return;
  }
  jobs.cut.dispatch.x = 0u;
  uint clusters = min(jobs.cut.clusters, jobs.cut.capacity);
  jobs.cut.small.x = min(clusters, CUT_COLUMNS);
  jobs.cut.small.y = (clusters + CUT_COLUMNS - 1u) / CUT_COLUMNS;
  uint per_task = max(jobs.cut.per_task, 1u);
  uint tasks = (clusters + per_task - 1u) / per_task;
  jobs.cut.tasks = uvec4(min(tasks, CUT_COLUMNS), (tasks + CUT_COLUMNS - 1u) / CUT_COLUMNS, 1u, 0u);
}

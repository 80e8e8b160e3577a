// Paths `mesh` and `mesh-paper`: push constants, and the meshlets that task and mesh workgroups
// work on. An item is a meshlet of an instance, those of push.instance and after it that are
// alike, or, with JOBS, a cluster in the list of the frame's cut.
#ifndef TASKS_GLSL
#define TASKS_GLSL

#include "scene/scene.glsl"
#include "levels/jobs.glsl"

layout(constant_id = 25) const bool JOBS = false;         // levels of detail
layout(constant_id = 26) const uint TASK_MESHLETS = 32u;  // of a task workgroup, one per thread
layout(constant_id = 27) const uint PAYLOAD_WORDS = 1u;   // of a meshlet: task_payload.glsl
layout(constant_id = 28) const uint MESH_THREADS = 32u;   // of a mesh workgroup
const bool PAPER = PAYLOAD_WORDS > 1u;                    // path `mesh-paper`

struct TaskCounters {
  uint tested;
  uint launched;   // given to mesh workgroups
  uint hidden;     // in view, but behind others
  uint triangles;  // drawn; counted with JOBS only
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Counters {
  TaskCounters of_frame;
};
// A bit per meshlet.
layout(buffer_reference, std430, buffer_reference_align = 4) buffer MeshletBits { uint at[]; };

layout(push_constant) uniform TaskPush {
  uvec2 frame;
  uint instance;     // without JOBS, that of the first row of workgroups
  uint first;        // item of the draw's first thread
  uint first_place;  // of that item among those of all instances; a multiple of TASK_MESHLETS
  uint sides;        // with JOBS: SIDES_ of the instances that are drawn; others are left out
  uint phase;        // PHASE_
  uint hint_mask;    // number of hints - 1
  uvec2 counters;
  uvec2 hints;   // which meshlets were visible when they were tested last
  uvec2 drawn;   // by place: which were launched in the first phase
  uvec2 pixels;  // depths, then their pyramid
  uvec2 jobs;    // or 0
}
push;

// The current item.
uint task_instance;
uint task_primitive;
uint task_meshlet;
uint task_number;  // of the meshlet in the primitive, for ids
#define INSTANCE task_instance
#define PRIMITIVE task_primitive
#include "raster/raster.glsl"

uint item_total() {
  if (JOBS) return min(Jobs(push.jobs).cut.clusters, Jobs(push.jobs).cut.capacity);
  uint primitive = Instances(the_frame().instances).at[push.instance].primitive;
  return Primitives(the_frame().primitives).at[primitive].meshlets;
}

// Makes an item the current one. row: of its task workgroup.
void open_item(uint item, uint row) {
  if (JOBS) {
    Job job = Jobs(push.jobs).at[item];
    task_instance = job.instance;
    task_primitive = job.row;
    task_meshlet = job.meshlet;
    task_number = job.number;
  } else {
    task_instance = push.instance + row;
    task_primitive = Instances(the_frame().instances).at[push.instance].primitive;
    task_meshlet = task_number = item;
  }
}

#endif

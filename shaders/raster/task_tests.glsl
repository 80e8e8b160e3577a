// Paths `mesh` and `mesh-paper`: a task workgroup tests TASK_MESHLETS meshlets, one per thread.
//
// With occlusion a frame has two phases. PHASE_FIRST draws what was visible when it was tested
// last. PHASE_SECOND tests all in view against the depths of the first phase, notes what is visible
// for the next frame, and draws what of that is not drawn yet. Without occlusion PHASE_VISIBLE
// draws all in view, without culling PHASE_ALL draws all.
//
// The threads agree through shared memory and not by subgroup operations: subgroups may be smaller
// than the workgroup (8 threads in Mesa's software renderer).
#ifndef TASK_TESTS_GLSL
#define TASK_TESTS_GLSL

#include "raster/tasks.glsl"
#include "visibility/occlusion.glsl"

// A bit per meshlet.
shared uint workgroup_tested;
shared uint workgroup_launched;
shared uint workgroup_hidden;

// Sides of an instance's triangles that are visible, which the draw decides.
uint visible_sides() {
  Instance instance = the_instance();
  uint flags = Materials(the_frame().materials).at[instance.material].flags;
  if ((flags & MATERIAL_DOUBLE_SIDED) != 0u) return SIDES_BOTH;
  return (instance.flags & INSTANCE_MIRRORED) != 0u ? SIDES_MIRRORED : SIDES_FRONT;
}

// Meshlets may share a hint: then one of them is drawn first, or tested, without need.
uint hint_of(uint place) {
  return (JOBS ? task_number + task_instance * 0x9E3779B1u : place) & push.hint_mask;
}

bool was_visible(uint hint) {
  return (MeshletBits(push.hints).at[hint >> 5] >> (hint & 31u) & 1u) != 0u;
}

// Atomic operations only where something changes: that is rare from frame to frame.
void note_visible(uint hint, bool visible) {
  if (visible == was_visible(hint)) return;
  uint bit = 1u << (hint & 31u);
  if (visible)
    atomicOr(MeshletBits(push.hints).at[hint >> 5], bit);
  else
    atomicAnd(MeshletBits(push.hints).at[hint >> 5], ~bit);
}

// Whether the current item, at a place of the workgroup with this number, is to be drawn now.
bool item_wanted(uint workgroup, uint bit) {
  bool visible = push.phase == PHASE_ALL || meshlet_visible(task_meshlet);
  if (push.phase >= PHASE_VISIBLE) return visible;
  uint hint = hint_of(workgroup * TASK_MESHLETS + gl_LocalInvocationIndex);
  if (push.phase == PHASE_FIRST) return visible && was_visible(hint);
  bool shown = visible && !meshlet_hidden(task_meshlet);
  note_visible(hint, shown);
  bool drawn = (MeshletBits(push.drawn).at[workgroup] & bit) != 0u;
  if (visible && !shown && !drawn) atomicOr(workgroup_hidden, bit);
  return shown && !drawn;
}

// One thread; three atomic operations of 32 meshlets.
void count_workgroup(uint workgroup) {
  Counters counters = Counters(push.counters);
  // Surplus workgroups of an indirect draw have no word. Draws of other sides set other bits.
  if (push.phase == PHASE_FIRST && workgroup_launched != 0u)
    atomicOr(MeshletBits(push.drawn).at[workgroup], workgroup_launched);
  if (push.phase != PHASE_SECOND) atomicAdd(counters.of_frame.tested, bitCount(workgroup_tested));
  atomicAdd(counters.of_frame.launched, bitCount(workgroup_launched));
  atomicAdd(counters.of_frame.hidden, bitCount(workgroup_hidden));
}

// Tests the workgroup's meshlets. Returns the thread's place among those to launch, in order, or
// TASK_MESHLETS. item: the thread's; it is the current one if it is to be launched.
uint tested_place(out uint item) {
  uint thread = gl_LocalInvocationIndex, bit = 1u << thread;
  // Rows of workgroups are instances; with JOBS they go on in the list.
  uint columns = JOBS ? CUT_COLUMNS : gl_NumWorkGroups.x;
  uint number = gl_WorkGroupID.y * columns + gl_WorkGroupID.x;
  uint workgroup = push.first_place / TASK_MESHLETS + number;
  item = push.first + (JOBS ? number : gl_WorkGroupID.x) * TASK_MESHLETS + thread;
  if (thread == 0u) workgroup_tested = workgroup_launched = workgroup_hidden = 0u;
  barrier();
  if (item < item_total()) {
    open_item(item, gl_WorkGroupID.y);
    if (!JOBS || visible_sides() == push.sides) {
      atomicOr(workgroup_tested, bit);
      if (item_wanted(workgroup, bit)) atomicOr(workgroup_launched, bit);
    }
  }
  barrier();
  if (thread == 0u) count_workgroup(workgroup);
  if ((workgroup_launched & bit) == 0u) return TASK_MESHLETS;
  return bitCount(workgroup_launched & (bit - 1u));
}

#endif

// Path `visibility` with a pool, a thread per job, in steps:
// touch: culls the cluster against the view. If it was visible in the last frame, it is drawn
// first, otherwise later. place: gives a slot to each cluster that waits and is not decoded, once
// for all instances, and lists it to be decoded. test: after the first are drawn, hides clusters
// behind them and lets the later ones wait. Notes which are visible. next: begins a pass for the
// clusters that found no slot in the last one.
//
// Inputs: jobs; the depth pyramid. Outputs: states of jobs; slots; clusters to decode.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "visibility/counters.glsl"
#include "visibility/occlusion.glsl"
layout(local_size_x = CUT_THREADS) in;

layout(constant_id = 23) const uint STEP = STEP_TOUCH;
layout(constant_id = 24) const bool OCCLUSION = true;

// Where the frame in which the cluster was visible last is noted. Clusters may share a place: then
// one of them is drawn first without need.
uint hint_place(Cut cut) { return (job_number + job_instance * 0x9E3779B1u) & cut.hint_mask; }

void touch(Jobs jobs, uint i) {
  Cut cut = jobs.cut;
  SlotNumbers states = SlotNumbers(cut.states);
  if (!meshlet_visible(job_meshlet)) {
    states.at[i] = JOB_HIDDEN;
    return;
  }
  bool first = !OCCLUSION || SlotNumbers(cut.hints).at[hint_place(cut)] == cut.frame - 1u;
  states.at[i] = first ? JOB_WAITING : JOB_LATER;
  SlotNumbers decoded = SlotNumbers(cut.decoded);
  uint place = decoded_place(), s = decoded.at[place], mark = UNDECODED | cut.stamp;
  bool is_new = s < cut.slots
                    ? atomicExchange(SlotNumbers(cut.stamps).at[s], cut.stamp) != cut.stamp
                    : atomicExchange(decoded.at[place], mark) != mark;
  if (is_new) atomicAdd(jobs.cut.used, 1u);
}

// Takes a slot away from a cluster that this pass does not use. Returns UNDECODED if there is none:
// the cursor passes each slot once.
uint taken_slot(Jobs jobs, Cut cut) {
  SlotNumbers stamps = SlotNumbers(cut.stamps);
  while (true) {
    uint n = atomicAdd(jobs.cut.cursor, 1u);
    if (n - cut.first_cursor >= cut.slots) return UNDECODED;
    uint s = n % cut.slots, old = stamps.at[s];
    if (old != cut.stamp && atomicCompSwap(stamps.at[s], old, cut.stamp) == old) return s;
  }
}

void start_drawing(Jobs jobs) {
  jobs.cut.small.z = 1u;
  jobs.cut.pieces.z = 1u;
  jobs.cut.resolve.z = 1u;
}

// Lets arguments have a workgroup with this number.
#define REQUIRE_WORKGROUP(arguments, number)               \
  atomicMax(arguments.x, min((number) + 1u, CUT_COLUMNS)); \
  atomicMax(arguments.y, (number) / CUT_COLUMNS + 1u)

void place(Jobs jobs, Job job) {
  Cut cut = jobs.cut;
  uint place = decoded_place();
  SlotNumbers decoded = SlotNumbers(cut.decoded), owners = SlotNumbers(cut.owners);
  uint old = decoded.at[place];
  if (old < cut.slots) start_drawing(jobs);
  if (old < cut.slots || old == DECODING) return;
  if (atomicCompSwap(decoded.at[place], old, DECODING) != old) return;
  uint s = taken_slot(jobs, cut);
  if (s == UNDECODED) {
    atomicExchange(decoded.at[place], old);
    return;
  }
  // The page that had the owner's place may be gone, so that another slot may have it.
  uint owner = owners.at[s];
  if (owner != UNDECODED) atomicCompSwap(decoded.at[owner], s, UNDECODED);
  owners.at[s] = place;
  atomicExchange(decoded.at[place], s);
  uint item = atomicAdd(jobs.cut.fresh_total, 1u);
  FreshClusters(cut.fresh).at[item] = Fresh(job.row, job.meshlet, place, s);
  REQUIRE_WORKGROUP(jobs.cut.connect, item / cut.per_connect);
  REQUIRE_WORKGROUP(jobs.cut.values, item);
  start_drawing(jobs);
}

void test(Jobs jobs, uint i) {
  Cut cut = jobs.cut;
  SlotNumbers states = SlotNumbers(cut.states);
  uint state = states.at[i];
  bool visible = !meshlet_hidden(job_meshlet);
  if (visible) SlotNumbers(cut.hints).at[hint_place(cut)] = cut.frame;
  if (state == JOB_WAITING || state == JOB_LATER) {
    states.at[i] = visible ? JOB_WAITING : JOB_HIDDEN;
    if (!visible) atomicAdd(jobs.cut.hidden, 1u);
  }
}

void main() {
  Jobs jobs = Jobs(push.jobs);
  uint i = job_workgroup() * CUT_THREADS + gl_LocalInvocationIndex;
  if (i == 0u && STEP >= STEP_TEST) begin_phase();
  if (i == 0u && STEP == STEP_NEXT) begin_pass();
  uint clusters = jobs.cut.clusters;
  if (STEP == STEP_NEXT || clusters > jobs.cut.capacity || i >= clusters) return;
  if (STEP == STEP_TOUCH && jobs.cut.dispatch.x == 0u) return;  // it fitted in an earlier round
  uint state = STEP == STEP_TOUCH ? JOB_WAITING : SlotNumbers(jobs.cut.states).at[i];
  if (state == JOB_HIDDEN || (STEP == STEP_PLACE && state != JOB_WAITING)) return;
  open_drawn(i);
  if (STEP == STEP_TOUCH)
    touch(jobs, i);
  else if (STEP == STEP_PLACE)
    place(jobs, jobs.at[i]);
  else
    test(jobs, i);
}

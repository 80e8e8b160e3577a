// The cache's state, within a frame and between frames. vk_backend/raytrace_layout.py mirrors it.
//
// A frame is a fixed series of passes: rt_fill.comp decodes, then rays are launched. Turn by turn:
// the first rays of all pixels; some passes of kind RESUME; then sweeps, as many as a path has rays
// one after the other, each with a pass per part of the model. Where no path waits the launch is
// empty.

struct Pass {
  uint launch[3];  // size of the launch, written by the pass's rt_fill.comp
  uint waiting;    // whether paths wait for this pass
  uint requested;  // RESUME: meshlets that they wait for; FIRST_RAYS: meshlets to decode before
  uint begin;      // number of the first victim that is not used yet
  uint backward;   // whether the sweep begins with the last part
  uint resident;   // the part that the slots hold, or NO_PART: see the slot table
};
#define TOO_MANY 0x80000000u  // Pass.requested: more than victims

layout(buffer_reference, std430, buffer_reference_align = 16) buffer CacheState {
  uvec2 bounds;      // per meshlet: the box around it, 6 floats
  uvec2 structures;  // per part: address of its top-level acceleration structure
  uvec2 victims;     // meshlets that may lose their slot: idle ones from the front, recently needed
                     // ones from the back
  uvec2 missing;     // meshlets that get a slot in this pass
  uvec2 found;       // records: Found
  uvec2 levels;      // records: Level; or 0 if paths have no more than their first ray
  uint slots;
  uint meshlets;
  uint parts;
  uint room;  // for records
  uint frame;  // number
  uint free;   // victims that this frame may use
  uint backward;  // as in the last pass
  uint resident;  // as in the last pass
  uint retry;     // before this frame paths sweep at once
  // Cleared when a frame begins, from here on.
  uint idle;  // length of each list
  uint recent;
  uint lacking;   // meshlets that were needed and have no slot
  uint finished;  // workgroups of rt_cache.comp that are done
  uint records[TURNS];  // paths that asked for a record
  Pass passes[];
};

// Number of the first meshlet in the slots while they hold a part. The last part may be smaller
// than the cache: then the end of the one before it is there, too.
uint window_of(CacheState state, uint part) {
  return min(part * state.slots, state.meshlets - state.slots);
}

// The part that a pass of a sweep meets.
uint part_of(CacheState state, uint backward, uint step) {
  return backward != 0u ? state.parts - 1u - step : step;
}

// The invocations that a launch has for each path: unrelated paths in one warp slow each other
// down. Only the first of them works.
uint spread_of(uint records) { return records <= SPREAD_PATHS ? SPREAD : 1u; }

#ifdef OWN_PUSH
layout(push_constant) uniform CachePush {
  uvec2 frame;
  uvec2 sources;
  uvec2 slot_table;
  uvec2 cache;
  uvec2 counters;
  uvec2 state;
  uint kind;  // of the pass
  uint pass;      // index in CacheState.passes
  uint turn;
  uint step;      // of the sweep: one for each part
  uint meshlets;  // LOADING: how many
}
push;
#else

// Remembers that rays of this frame needed the meshlet.
void mark(uint number) {
  uint frame = CacheState(push.state).frame;
  if (Counts(push.counters).at[number] != frame) Counts(push.counters).at[number] = frame;
}

// Requests a meshlet for the next pass.
void request(uint number) {
  CacheState state = CacheState(push.state);
  uint next = push.pass + 1u;
  mark(number);
  if (state.free == 0u) state.passes[next].requested = TOO_MANY;
  // Most are requested already, and a read is cheaper than an atomic.
  if (state.passes[next].requested > state.free ||
      Counts(push.slot_table).at[number] != NO_SLOT ||
      atomicCompSwap(Counts(push.slot_table).at[number], NO_SLOT, REQUESTED) != NO_SLOT)
    return;
  uint place = atomicAdd(state.passes[next].requested, 1u);
  if (place < state.slots) Counts(state.missing).at[place] = number;
}

#endif

// Compute stage, at the start of a frame: chooses the meshlets that the slots hold, from the
// rays of the last frame, without the host. One thread per meshlet.
//
// Inputs: counters, slot table.
// Outputs: slot table, lists, CacheState.
//
// Slots, and meshlets without a slot, are listed by class (rt_cache.glsl). Meshlets evict those
// of lower classes. Meshlets that rays needed in the last frame are decoded before the first
// launch, all others during it; if only a few are missing, so are those that few rays needed.
// All other slots keep their meshlets. During the frame, the slots that rays did not need (or
// `rotating`, if that is more) are reused for requests, the lowest class first.
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "raytrace/rt_common.glsl"
#include "raytrace/rt_cache.glsl"

// If no more than FEW_MISSING needed meshlets lack a slot, decode only those of class NEEDED_OFTEN
// and above before the first launch: decoding the rest would take longer than the few rays that
// wait for it. If rays cannot wait, decode all.
#define FEW_MISSING 128u
#define NEEDED_OFTEN (NEEDED + 3u)
#define GROUP CHOOSE_THREADS
layout(local_size_x = GROUP) in;

shared uint counts[LISTS];  // items that the workgroup adds to each list
shared uint begins[LISTS];  // offset of these items in the list
shared bool last_group;
uint frame;  // number of the frame that begins

#define LISTED(list) counts[list]
#include "raytrace/rt_order.glsl"

// Words that other workgroups write in this dispatch.
layout(buffer_reference, std430, buffer_reference_align = 4) coherent buffer SharedCounts {
  uint at[];
};

// Nearness of a meshlet: ITSELF if rays needed it, one less for each step away (then it is the
// meshlet's class), 0 if it is not near.
#define ITSELF (NEAR + 3u)
#define STAMPED_FRAMES 0x20000000u  // a stamp has 29 bits for the frame, then starts again
uint stamp(uint number, uint nearness) { return number * 8u + nearness; }
uint nearness_of(uint stamped) { return stamped >= stamp(frame - 1u, 0u) ? stamped & 7u : 0u; }

// Spreads nearness by one step per frame to the meshlets that share a boundary, and returns the
// meshlet's own. It is a hint: reading a neighbour's stamp of this frame or of the last is fine.
uint spread_nearness(CacheState state, uint m, bool needed) {
  Counts stamps = Counts(state.stamps);
  if (frame % STAMPED_FRAMES == 0u) {
    stamps.at[m] = 0u;
    return IDLE;
  }
  uint before = nearness_of(stamps.at[m]);
  uint own = needed ? ITSELF : min(before, ITSELF - 1u);
  uint next = needed ? stamp(frame, ITSELF) : 0u;
  // Issue all loads of owners, then all of stamps: dependent loads took longer than all the rest.
  uint owners[NEIGHBOURS];
  uint stamped[NEIGHBOURS];
  for (uint i = 0u; i < NEIGHBOURS; i++) owners[i] = Counts(state.owners).at[NEIGHBOURS * m + i];
  for (uint i = 0u; i < NEIGHBOURS; i++)
    stamped[i] = stamps.at[owners[i] == NO_SLOT ? m : owners[i]];
  for (uint i = 0u; i < NEIGHBOURS; i++) {
    if (owners[i] == NO_SLOT) break;
    uint other = nearness_of(stamped[i]);
    if (own > 1u && stamped[i] < stamp(frame, own - 1u))
      atomicMax(stamps.at[owners[i]], stamp(frame, own - 1u));
    if (other > 1u) next = max(next, stamp(frame, other - 1u));
  }
  if (next != 0u) atomicMax(stamps.at[m], next);
  return own;
}

// The class by the time since rays needed the meshlet; IDLE after 32 frames.
uint recency(CacheState state, uint m, uint needed) {
  Counts seen = Counts(state.seen);
  if (needed != 0u) {
    seen.at[m] = frame;
    return min(NEEDED + uint(findMSB(needed)) / 2u, CLASSES - 1u);
  }
  uint age = frame - seen.at[m];
  return age < 3u ? RECENT + 2u : age < 8u ? RECENT + 1u : age < 32u ? RECENT : IDLE;
}

// Whether all other workgroups of the dispatch are done. Then their writes are visible.
bool is_last_group(CacheState state) {
  memoryBarrierBuffer();
  barrier();
  if (gl_LocalInvocationIndex == 0u)
    last_group = atomicAdd(state.finished, 1u) == gl_NumWorkGroups.x - 1u;
  barrier();
  memoryBarrierBuffer();
  return last_group;
}

// Clears the rounds and the next frame's lists. Leaves the lengths of this frame's lists in
// `counts`.
void prepare(CacheState state) {
  uint local = gl_LocalInvocationIndex;
  for (uint i = local; i <= state.coming_round; i += GROUP)
    state.rounds[i] = Round(uint[](0u, 1u, 1u), 0u, uint[](0u, 1u, 1u), 0u, 0u, 0u);
  if (local >= LISTS) return;
  counts[local] = min(atomicAdd(state.listed[listed_at(frame, local)], 0u), slot_count(state));
  state.listed[listed_at(frame + 1u, local)] = 0u;
}

// Decides how many meshlets to decode before and during the first launch, and which slots to reuse
// later: those that follow, one after the other.
void plan(CacheState state) {
  uint missing = 0u;
  for (uint c = NEEDED; c < CLASSES; c++) missing += counts[CLASSES + c];
  uint pressing = missing > FEW_MISSING || state.waits == 0u ? NEEDED : NEEDED_OFTEN;
  uint lower = slot_count(state);  // slots of lower classes
  uint idle = 0u;
  uint used = 0u;
  uint kept = 0u;
  for (uint c = CLASSES - 1u; c > IDLE; c--) {
    lower -= counts[c];
    used += min(counts[CLASSES + c], lower - min(used, lower));
    if (c == pressing) kept = used;
    if (c == NEEDED) idle = lower;
  }
  kept = min(kept, state.stable);
  uint ring = max(state.rotating, idle - min(kept, idle));
  // Half of the ring stays free for requests.
  uint coming = min(used - kept, min(MOST_COMING, ring / 2u));
  state.frame = frame;
  state.kept = kept;
  state.ring = ring;
  state.cursor = coming;
  state.finished = 0u;
  state.rounds[0].requested = kept;
  state.rounds[0].fill_groups[0] = min(kept, FILL_GROUPS);
  state.rounds[state.coming_round].requested = coming;
  state.rounds[state.coming_round].fill_groups[0] = coming;
}

// Assigns slots to the meshlets that are decoded during the first launch: those after `kept`.
void place_coming(CacheState state) {
  uint coming = state.rounds[state.coming_round].requested;
  for (uint i = gl_LocalInvocationIndex; i < coming; i += GROUP) {
    uint m = SharedCounts(push.lists).at[meshlet_place(state, state.kept + i)];
    uint slot = SharedCounts(push.lists).at[slot_place(state, state.kept + i)];
    SharedCounts(push.slot_table).at[Counts(push.slot_meshlets).at[slot]] = NO_SLOT;
    Counts(push.slot_meshlets).at[slot] = m;
    SharedCounts(push.slot_table).at[m] = COMING | slot;
  }
}

void main() {
  CacheState state = CacheState(push.state);
  frame = state.frame + 1u;
  uint m = gl_GlobalInvocationID.x;
  uint local = gl_LocalInvocationIndex;
  uint slots = slot_count(state);
  if (local < LISTS) counts[local] = 0u;
  barrier();
  uint into = LISTS;  // list for the meshlet or its slot; LISTS: none
  uint rank = 0u;
  uint item = m;
  if (m < state.meshlets) {
    uint entry = Counts(push.slot_table).at[m];
    uint counted = Counts(push.counters).at[m];
    uint needed = counted / COUNTED_RAY;
    Counts(push.counters).at[m] = 0u;
    uint nearness = state.owners != uvec2(0u) ? spread_nearness(state, m, needed != 0u) : 0u;
    into = max(recency(state, m, needed),
               (counted & TOUCHED_RAY) != 0u ? TOUCHED : min(nearness, ITSELF - 1u));
    if (entry < REQUESTED) {
      item = entry & SLOT_BITS;
      SharedCounts(push.slot_table).at[m] = item | (needed >= HOT_COUNT ? HOT : 0u);
    } else {
      into = into == IDLE ? LISTS : CLASSES + into;
      SharedCounts(push.slot_table).at[m] = NO_SLOT;
    }
    if (into < LISTS) rank = atomicAdd(counts[into], 1u);
  }
  barrier();
  if (local < LISTS && counts[local] != 0u)
    begins[local] = atomicAdd(state.listed[listed_at(frame, local)], counts[local]);
  barrier();
  SharedCounts lists = SharedCounts(push.lists);
  if (into < LISTS && begins[into] + rank < slots)
    lists.at[list_begin(state, into) + begins[into] + rank] = item;
  if (!is_last_group(state)) return;
  prepare(state);
  memoryBarrierBuffer();
  barrier();
  if (local == 0u) plan(state);
  memoryBarrierBuffer();
  barrier();
  place_coming(state);
}

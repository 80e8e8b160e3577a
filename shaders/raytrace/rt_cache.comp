// Which meshlets the slots hold when a frame begins, chosen without the host by what rays needed in
// the last frame. Slots and meshlets without a slot are listed by classes: how many rays needed it,
// how long ago, whether rays came past it, or how near it is to such. Meshlets take the slots of
// lower classes. The first, those that rays needed in the last frame, are decoded before the first
// ray; the others, and of a few only those that not many rays needed, while the first rays are on
// their way. What the other slots hold stays; during the frame those of the classes that were not
// needed, or `rotating` if these are more, are given to what rays wait for, the lowest class first.
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "raytrace/rt_common.glsl"
#include "raytrace/rt_cache.glsl"

// Of so few meshlets that rays needed and have no slot, only those that many rays needed are
// decoded before the first ray, since that costs more time than it takes the others' rays to wait.
// Where rays cannot wait, all are.
#define FEW_MISSING 128u
#define NEEDED_OFTEN (NEEDED + 3u)
#define GROUP 512u  // CHOOSE_GROUP of vk_backend/raytrace.py
layout(local_size_x = GROUP) in;

shared uint counts[LISTS];  // of what the workgroup adds to each list,
shared uint begins[LISTS];  //   and where that begins in it
shared bool last_group;
uint frame;  // the number of the one that begins

#define LISTED(list) counts[list]
#include "raytrace/rt_order.glsl"

// What other workgroups have written in this dispatch.
layout(buffer_reference, std430, buffer_reference_align = 4) coherent buffer SharedCounts {
  uint at[];
};

// How near a meshlet is to those that rays needed: ITSELF, one less for each step away from them,
// which then is its class, 0 if it is not near.
#define ITSELF (NEAR + 3u)
uint stamp(uint number, uint nearness) {
  return number * 8u + nearness;
}  // of 29 bits; then they begin anew
#define STAMPED_FRAMES 0x20000000u
uint nearness_of(uint stamped) { return stamped >= stamp(frame - 1u, 0u) ? stamped & 7u : 0u; }

// Each frame nearness spreads by one step to the meshlets that share a boundary. It is a hint: that
// some see others' stamps of this frame and some those of the last does no harm. Returns the
// meshlet's, which below ITSELF is its class.
uint spread_nearness(CacheState state, uint m, bool needed) {
  Counts stamps = Counts(state.stamps);
  if (frame % STAMPED_FRAMES == 0u) {
    stamps.at[m] = 0u;
    return IDLE;
  }
  uint before = nearness_of(stamps.at[m]);
  uint own = needed ? ITSELF : min(before, ITSELF - 1u);
  uint next = needed ? stamp(frame, ITSELF) : 0u;
  uint owners[NEIGHBOURS];   // read all at once, then
  uint stamped[NEIGHBOURS];  //   all these: one after another would take longer than the rest
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

// The class by when rays needed a meshlet, IDLE if that is long ago.
uint recency(CacheState state, uint m, uint needed) {
  Counts seen = Counts(state.seen);
  if (needed != 0u) {
    seen.at[m] = frame;
    return min(NEEDED + uint(findMSB(needed)) / 2u, CLASSES - 1u);
  }
  uint age = frame - seen.at[m];
  return age < 3u ? RECENT + 2u : age < 8u ? RECENT + 1u : age < 32u ? RECENT : IDLE;
}

// Whether all other workgroups of the dispatch are done, and what they wrote can be read.
bool is_last_group(CacheState state) {
  memoryBarrierBuffer();
  barrier();
  if (gl_LocalInvocationIndex == 0u)
    last_group = atomicAdd(state.finished, 1u) == gl_NumWorkGroups.x - 1u;
  barrier();
  memoryBarrierBuffer();
  return last_group;
}

// Rounds without work, and empty lists for the next frame. Leaves the lengths of this one's lists
// in `counts`.
void prepare(CacheState state) {
  uint local = gl_LocalInvocationIndex;
  for (uint i = local; i <= state.coming_round; i += GROUP)
    state.rounds[i] = Round(uint[](0u, 1u, 1u), 0u, uint[](0u, 1u, 1u), 0u, 0u, 0u);
  if (local >= LISTS) return;
  counts[local] = min(atomicAdd(state.listed[listed_at(frame, local)], 0u), slot_count(state));
  state.listed[listed_at(frame + 1u, local)] = 0u;
}

// How many meshlets are decoded before and during the first launch, and which slots are given away
// later: those after theirs, in turn.
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
  uint coming = min(
      used - kept, min(MOST_COMING, ring / 2u));  // the rest of the ring is for what paths wait for
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

// The slots of meshlets that are coming: the next in the order after those that are kept.
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
  uint into = LISTS;  // the list that gets the meshlet, or its slot
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

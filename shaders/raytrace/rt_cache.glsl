// The state of the cache, in a frame and between frames; vk_backend/raytrace.py mirrors it.

// Classes of slots and meshlets by what rays needed. The higher, the more likely they will need it
// again.
#define CLASSES 13u
#define IDLE 0u  // nothing of the following
#define NEAR \
  1u  // to 3: so many steps less than four away from one that rays needed in the last frame
#define TOUCHED \
  4u  // tested in the last frame by rays that found nothing there, or not what they hit
#define RECENT 5u             // to 7: needed less than 32, 8, 3 frames ago
#define NEEDED 8u             // to 12: needed in the last frame by 1 to 3 rays, 4 to 15, and so on
#define LISTS (2u * CLASSES)  // of slots by class, then of meshlets without a slot by class

// Of a meshlet's counter: what each ray adds that needs it, and the bit of those that touch it.
#define COUNTED_RAY 2u
#define TOUCHED_RAY 1u

// What a round of a frame has to do. The launch before it writes it; when a frame begins there is
// nothing.
struct Round {
  uint fill_groups[3];  // of the dispatch that decodes
  uint requested;       // meshlets to decode
  uint launch[3];  // the invocations of paths that go on, and if any start again the strip's pixels
                   // after them
  uint restarted;  // paths that start again
  uint waiting;    // paths that asked for a record
  uint filled;     // workgroups of the dispatch that are done
};

layout(buffer_reference, std430, buffer_reference_align = 16) buffer CacheState {
  uvec2 bounds;   // of each meshlet, the box around it: 6 floats; or 0
  uvec2 paths;    // two times path_limit records of waiting paths
  uvec2 owners;   // of each meshlet: NEIGHBOURS meshlets that own boundaries of it, or fewer and
                  // NO_SLOT; or 0
  uvec2 stamps;   // of each meshlet: when it was near one that rays needed, and how near
  uvec2 seen;     // of each meshlet: the frame after the one in which rays last needed it
  uvec2 ahead;    // Frame of the small picture that looks ahead; its width is 0 where nothing moves
  uint stable;    // all slots but
  uint rotating;  //   those that can be given away during a frame, whatever they hold
  uint meshlets;
  uint primitives;
  uint waits;               // whether paths may wait for meshlets
  uint path_limit;          // records of paths for a round
  uint coming_round;        // the last of rounds: what is decoded during the first launch
  uint frame;               // its number
  uint kept;                // meshlets to decode before it
  uint ring;                // slots that are given away during the frame, in turn
  uint cursor;              //   of which so many have been
  uint finished;            // workgroups of the running step that are done
  uint listed[2u * LISTS];  // what the lists of this frame hold, and those of the next; or more
                            // than there is room for
  Round rounds[];
};

uint listed_at(uint frame, uint list) { return (frame & 1u) * LISTS + list; }
uint slot_count(CacheState state) { return state.stable + state.rotating; }
// Where a list of slots or meshlets begins: each has as many words as there are slots.
uint list_begin(CacheState state, uint list) { return list * slot_count(state); }
#define REQUESTS \
  (CLASSES +     \
   IDLE)  // of the lists: there is none of such meshlets, so this one is for what paths wait for

#ifdef OWN_PUSH
layout(push_constant) uniform Push {
  uvec2 frame;
  uvec2 traced;
  uvec2 slot_table;
  uvec2 cache;
  uvec2 counters;
  uvec2 state;          // CacheState
  uvec2 lists;          // LISTS of them
  uvec2 slot_meshlets;  // of each slot: its meshlet, or NO_SLOT
  uint round;           // in CacheState.rounds
}
push;
#endif

#define FILL_GROUPS 32768u  // workgroups that decode at once, at most
#define MOST_COMING 2048u

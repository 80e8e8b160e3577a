// The cache's state, within a frame and between frames. vk_backend/raytrace_layout.py mirrors it.

// Classes of slots and meshlets by how rays used them. The higher the class, the more likely rays
// will need the meshlet again.
#define IDLE 0u     // none of the following
#define NEAR 1u     // 1..3: 4 minus the graph distance to the nearest meshlet that rays needed
#define TOUCHED 4u  // in the last frame rays tested it, but did not hit it
#define RECENT 5u   // 5..7: needed less than 32, 8, 3 frames ago
#define NEEDED 8u   // 8..12: needed in the last frame by 1..3, 4..15, ... rays

// The work of one round of a frame. The launch before it fills this in; it is cleared when a frame
// begins.
struct Round {
  uint fill_groups[3];  // size of the dispatch that decodes
  uint requested;       // meshlets to decode
  uint launch[3];  // size of the launch: invocations of resumed paths, then, if any path restarts,
                   // the strip's pixels
  uint restarted;  // paths that start again
  uint waiting;    // paths that asked for a record
  uint filled;     // workgroups of the dispatch that are done
};

layout(buffer_reference, std430, buffer_reference_align = 16) buffer CacheState {
  uvec2 bounds;   // per meshlet: the box around it, 6 floats; or 0
  uvec2 paths;    // records of waiting paths: path_limit for even rounds, then for odd rounds
  uvec2 owners;   // per meshlet: up to NEIGHBOURS owners of its boundaries, then NO_SLOT; or 0
  uvec2 stamps;   // per meshlet: when it was last near one that rays needed, and how near
  uvec2 seen;     // per meshlet: the frame after the one in which rays last needed it
  uvec2 ahead;    // Frame of the prefetch picture; its width is 0 if the camera does not move
  uint stable;    // slots that keep their meshlets during a frame
  uint rotating;  // slots that can be reused during a frame even if rays need their meshlets
  uint meshlets;
  uint primitives;
  uint waits;               // whether paths may wait for meshlets
  uint path_limit;          // records of paths per round
  uint coming_round;        // index of the last round: meshlets decoded during the first launch
  uint frame;               // counter
  uint kept;                // meshlets to decode before the first launch
  uint ring;                // slots that are reused during the frame, one after the other
  uint cursor;              // next of them
  uint finished;            // workgroups of the running step that are done
  uint listed[2u * LISTS];  // length of each list in this frame, then in the next; may exceed the
                            // room for it
  Round rounds[];
};

uint listed_at(uint frame, uint list) { return (frame & 1u) * LISTS + list; }
uint slot_count(CacheState state) { return state.stable + state.rotating; }
// Offset of a list: each has as many words as there are slots. There is no list of idle meshlets
// without a slot, so the list REQUESTS = CLASSES + IDLE serves for the requests.
uint list_begin(CacheState state, uint list) { return list * slot_count(state); }

#ifdef OWN_PUSH
layout(push_constant) uniform CachePush {
  uvec2 frame;
  uvec2 traced;
  uvec2 slot_table;
  uvec2 cache;
  uvec2 counters;
  uvec2 state;          // CacheState
  uvec2 lists;          // LISTS lists
  uvec2 slot_meshlets;  // per slot: its meshlet, or NO_SLOT
  uint round;           // index in CacheState.rounds
}
push;
#endif

#define MOST_COMING 2048u  // meshlets decoded during the first launch, at most

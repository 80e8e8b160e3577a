// The state of the cache, in a frame and between frames; vk_backend/raytrace.py mirrors it.

#define KEYS 512u

// What a round of a frame has to do. The launch before it writes it; the command buffer sets it to nothing when a frame begins.
struct Round {
  uint fill_groups[3];                     // of the dispatch that decodes
  uint requested;                          // meshlets to decode
  uint pixels[3];                          // of the launch of paths that start again: the strip's size, or none
  uint restarted;                          // paths among them
  uint paths[3];                           // of the launch of paths that go on: their number
  uint waiting;                            // paths that asked for a record
  uint filled;                             // workgroups of the dispatch that are done
  uint unused[3];
};

layout(buffer_reference, std430, buffer_reference_align = 16) buffer CacheState {
  uvec2 bounds;                            // of each meshlet, the box around it: 6 floats; or 0
  uvec2 paths;                             // two times path_limit records of waiting paths
  uint stable;                             // slots whose meshlets stay throughout a frame, at most
  uint rotating;                           // further slots, which are given away during a frame
  uint meshlets;
  uint primitives;
  uint predict;                            // whether rotating slots are filled before rays ask
  uint threshold;                          // meshlets with a larger key are kept, and
  uint quota;                              //   so many with this key
  uint taken;                              //   of which so many have been seen
  uint kept;                               // meshlets to decode since they are to be kept,
  uint predicted;                          //   and since rays will ask for them
  uint idle;                               // slots whose meshlets no ray asked for in the last frame; empty ones too
  uint empty;                              // slots that never had a meshlet, and have been seen
  uint ring;                               // slots that are given away during the frame, in turn
  uint cursor;                             //   of which so many have been
  uint finished;                           // workgroups of the running step that are done
  uint path_limit;                         // records of paths for a round
  uint unused[2];
  uint histogram[KEYS];                    // meshlets by key
  uint places[KEYS];                       // in the order of slots: the next with this key
  Round rounds[];
};

#ifdef OWN_PUSH
layout(push_constant) uniform Push {
  uvec2 frame;
  uvec2 traced;
  uvec2 slot_table;
  uvec2 cache;
  uvec2 counters;
  uvec2 state;                             // CacheState
  uvec2 wanted;                            // the meshlets to decode; before a frame `stable` places for those to be kept, then others
  uvec2 order;                             // all slots, those first that can be done without
  uvec2 slot_meshlets;                     // of each slot: its meshlet, or NO_SLOT
  uint round;                              // in CacheState.rounds
} push;
#endif

#define FILL_GROUPS 32768u                 // workgroups that decode at once, at most

// The state of the cache between frames; vk_backend/raytrace.py mirrors it.

#define KEYS 512u

layout(buffer_reference, std430, buffer_reference_align = 16) buffer CacheState {
  uint fill_groups[3];                     // of the dispatch that decodes what is missing
  uint missing;                            // meshlets to decode
  uint free_slots;
  uint threshold;                          // meshlets with a larger key are wanted, and
  uint quota;                              //   so many with this key
  uint taken;                              //   of which so many have been seen
  uint capacity;
  uint meshlets;
  uint primitives;
  uint ring;                               // where the search for scratch slots begins
  uint rays[3];                            // of the next round: the picture's size, or none
  uint rays_wanted;                        // width of the picture once a path waits
  uint requested;                          // meshlets that paths wait for
  uint admitted;                           //   of which so many are decoded for the next round
  uint unused[2];
  uint histogram[KEYS];                    // meshlets by key
};

#ifdef OWN_PUSH
layout(push_constant) uniform Push {
  uvec2 frame;
  uvec2 traced;
  uvec2 slot_table;
  uvec2 cache;
  uvec2 counters;
  uvec2 state;                             // CacheState
  uvec2 missing;                           // the meshlets to decode
  uvec2 free_slots;                        // a stack of slots
  uint scratch;                            // slots behind the cache's own, for meshlets that paths wait for
  uint last;                               // no further meshlets are admitted
} push;
#endif

#define FILL_GROUPS 32768u                 // workgroups that decode at once, at most

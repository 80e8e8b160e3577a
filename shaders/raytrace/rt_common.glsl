// What the ray-tracing shaders share: the push constants, a primitive as rays meet it, and the
// cache of decoded meshlets.
#include "scene/slots.glsl"

// 0, 1: MAX_STREAMS and MAX_ELEMENTS of the decoder.
layout(constant_id = 2) const uint GROUP_TRIANGLES =
    64u;  // triangles behind one box of the acceleration structure
layout(constant_id = 5) const bool ALL_CACHED = false;  // every meshlet m is in slot m
layout(constant_id = 6) const uint VERTEX_FLOATS = 8u;  // of an uncompressed vertex,
layout(constant_id = 7) const uint ATTRIBUTES =
    7u;  //   and what it has beside its position: HAS_ bits
// 8: STAGE_WORDS of the cooperative decoder.
layout(constant_id = 9) const bool DEFERRED =
    false;  // paths wait for meshlets that are not in the cache, instead of decoding them
layout(constant_id = 10) const bool RESUMES = false;  // paths may go on from records
layout(constant_id = 11) const bool COUNTED = false;  // meshlets count the rays that need them

#define NO_SLOT 0xFFFFFFFFu
#define REQUESTED 0xFFFFFFFEu  // no slot yet, but on the list of requests
// Else an entry of the table of slots is a slot's number, and
#define COMING \
  0x80000000u  // the meshlet is being decoded into it during the frame's first launch, for the
               // later ones
#define HOT 0x40000000u  // in the last frame HOT_COUNT rays or more needed it
#define SLOT_BITS 0x3FFFFFFFu
#define HOT_COUNT 256u

#define NEIGHBOURS 6u  // of a meshlet that are kept in mind: those that own boundaries of it

struct Traced {
  uvec2 blob;
  uint blob_words;
  uint first_meshlet;  // the primitives' meshlets are numbered through
  uvec2 indices;       // uncompressed paths: three words per triangle, and
  uvec2 vertices;      //   VERTEX_FLOATS floats per vertex
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer TracedList {
  Traced at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Counts { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer SceneFloatsOut {
  float at[];
};

#ifndef OWN_PUSH
layout(push_constant) uniform Push {
  uvec2 frame;            // Frame
  uvec2 structure;        // the top level
  uvec2 traced;           // Traced of each primitive
  uvec2 slot_table;       // of each meshlet: its slot, perhaps with COMING or HOT, or NO_SLOT, or
                          // REQUESTED
  uvec2 cache;            // the slots
  uvec2 counters;         // of each meshlet: what rays did there in this frame, see rt_request.glsl
  uvec2 first_triangles;  // of each meshlet: its first triangle in Traced.indices
  uvec2 colors;           // a word per pixel
  uvec2 hits;             // HIT_WORDS per pixel
  uint bounces;
  uint samples;    // paths per pixel
  uint first_row;  // of the strip of the picture that is traced
  uint shadows;
  uint round;   // of the strip. 0: all pixels; later: the paths with records, and those that start
                // again
  uint record;  // its place in CacheState.rounds
  uvec2 state;  // CacheState
  uvec2 requests;  // at most CacheState.ring meshlets that paths wait for
  uvec2 waiting;   // a bit per pixel: its path shall start again
  uint strip_rows;
}
push;

uint slot_entry(uint number) { return ALL_CACHED ? number : Counts(push.slot_table).at[number]; }

// Whether rays of this launch find a meshlet with that entry in its slot.
bool has_slot(uint entry) { return entry < COMING || (entry < REQUESTED && push.record > 0u); }
#endif

#define HIT_WORDS 5u  // instance, meshlet * 64 + triangle, t, two barycentrics

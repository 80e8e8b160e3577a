// Shared by the ray-tracing shaders: specialisation and push constants, the primitives, and the
// slot table of the cache.
#include "raytrace/rt_constants.h"
#include "scene/slots.glsl"

// Ids 0 and 1 are the decoder's MAX_STREAMS and MAX_ELEMENTS.
layout(constant_id = 2) const uint GROUP_TRIANGLES = 64u;  // triangles per box
layout(constant_id = 5) const bool ALL_CACHED = false;     // meshlet m is in slot m, for all m
layout(constant_id = 6) const uint VERTEX_FLOATS = 8u;     // of an uncompressed vertex
layout(constant_id = 7) const uint ATTRIBUTES = 7u;        // HAS_ bits of such a vertex
// Paths wait for meshlets without a slot instead of decoding them.
layout(constant_id = 9) const bool DEFERRED = false;
layout(constant_id = 10) const bool RESUMES = false;  // waiting paths may resume from a record
layout(constant_id = 11) const bool COUNTED = false;  // count the rays that need each meshlet

// A primitive of the ray tracer.
struct Traced {
  uvec2 blob;
  uint blob_words;
  uint first_meshlet;  // number of its first meshlet: meshlets are numbered across primitives
  uvec2 indices;       // uncompressed paths: three words per triangle
  uvec2 vertices;      // uncompressed paths: VERTEX_FLOATS floats per vertex
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer TracedList {
  Traced at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Counts { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer SceneFloatsOut {
  float at[];
};

#ifndef OWN_PUSH
layout(push_constant) uniform RaysPush {
  uvec2 frame;       // Frame
  uvec2 structure;   // top-level acceleration structure
  uvec2 traced;      // per primitive: Traced
  uvec2 slot_table;  // per meshlet: its slot, perhaps with COMING or HOT, or NO_SLOT or REQUESTED
  uvec2 cache;       // the slots
  uvec2 counters;    // per meshlet: rays of this frame, see rt_request.glsl
  uvec2 first_triangles;  // per meshlet: its first triangle in Traced.indices
  uvec2 colors;           // output, a word per pixel
  uvec2 hits;             // output, HIT_WORDS per pixel
  uint bounces;
  uint samples;    // paths per pixel
  uint first_row;  // of the strip that is traced
  uint shadows;
  uint round;      // of the strip; 0: all pixels, later: paths with records and paths that restart
  uint record;     // index of the round in CacheState.rounds
  uvec2 state;     // CacheState
  uvec2 requests;  // at most CacheState.ring meshlets that paths wait for
  uvec2 waiting;   // a bit per pixel: restart its path
  uint strip_rows;
}
push;

uint slot_entry(uint number) { return ALL_CACHED ? number : Counts(push.slot_table).at[number]; }

// Whether rays of this launch may read the slot of a meshlet with this entry.
bool has_slot(uint entry) { return entry < COMING || (entry < REQUESTED && push.record > 0u); }
#endif

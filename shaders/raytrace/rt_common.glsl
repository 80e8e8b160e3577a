// Shared by the ray-tracing shaders: specialisation and push constants, numbers of meshlets, and
// the slot table of the cache.
#include "raytrace/rt_constants.h"
#include "scene/slots.glsl"

// Ids 0 and 1 are the decoder's MAX_STREAMS and MAX_ELEMENTS; 8 is the team decoder's STAGE_WORDS.
layout(constant_id = 2) const uint GROUP_TRIANGLES = 64u;  // triangles per box
layout(constant_id = 5) const bool ALL_CACHED = false;     // meshlet m is in slot m, for all m
layout(constant_id = 6) const uint VERTEX_FLOATS = 8u;     // of an uncompressed vertex
layout(constant_id = 7) const uint ATTRIBUTES = 7u;        // HAS_ bits of such a vertex
// Some meshlets have no slot. Paths wait for them.
layout(constant_id = 9) const bool PARTIAL = false;

// Meshlets have numbers across primitives. A part of the model is a range of numbers, and so is a
// piece: the meshlets of a part that belong to one primitive. Placed: a piece in an instance.
struct Placed {
  uint instance;
  uint primitive;
  uint first;  // number of the piece's first meshlet
  uint key;    // smallest key of the instance's hits, see hit_key
};
struct Source {
  uint primitive;
  uint meshlet;  // in its primitive
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer PlacedPieces {
  Placed at[];
};
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Sources {
  Source at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Counts { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer AddressList {
  uvec2 at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer SceneFloatsOut {
  float at[];
};

#ifndef OWN_PUSH
layout(push_constant) uniform RaysPush {
  uvec2 frame;       // Frame
  uvec2 structure;   // top-level acceleration structure of the whole scene
  uvec2 placed;      // per instance of that structure: Placed
  uvec2 sources;     // per meshlet: Source
  uvec2 slot_table;  // per meshlet: its slot, NO_SLOT or REQUESTED
  uvec2 cache;       // the slots
  uvec2 counters;  // per meshlet: the last frame that needed it; PAPER: how many rays have tested it
  uvec2 first_triangles;  // uncompressed meshlets: number of their first triangle in all primitives
  uvec2 colors;           // output, a word per pixel
  uvec2 hits;             // output, HIT_WORDS per pixel
  uvec2 state;            // CacheState
  uint bounces;
  uint samples;  // paths per pixel
  uint shadows;
  uint kind;  // of the pass
  uint pass;  // index in CacheState.passes
  uint turn;
  uint step;       // of the sweep: one for each part
  uint next_turn;  // index of the next turn's first pass
}
push;

// The meshlet's number in its primitive.
uint meshlet_of(Placed placed, uint number) {
  return PARTIAL ? Sources(push.sources).at[number].meshlet : number - placed.first;
}

// Of hits at equal distances the smallest key counts: the smallest (instance, meshlet, triangle).
uint hit_key(Placed placed, uint number, uint triangle) {
  return placed.key + meshlet_of(placed, number) * MESHLET_TRIANGLES + triangle;
}

uint slot_entry(uint number) { return ALL_CACHED ? number : Counts(push.slot_table).at[number]; }
#endif

// Buffers that connect.comp and lengths.comp fill for the passes after them.
//
// needs: push
// optional: PLACE_OF
#ifndef DECODE_BUFFERS_GLSL
#define DECODE_BUFFERS_GLSL

struct Connected {
  uvec2 boundary;  // mask of the boundary vertices
  uvec2 starts;    // mask of the triangles that begin a disk
  uvec2 closing;   // masks of the symbols C, E and S
  uvec2 ends;
  uvec2 splits;
  // Mask of the ranks along the boundary at which references begin; written by lengths.comp.
  uvec2 references;
};

// A meshlet's header and the bit positions of its sections, so that a pass that visits it need not
// parse it. connect.comp writes the members up to codes, lengths.comp the others. NO_PLACE: the
// sections before are malformed.
struct Places {
  uvec2 foreign_refs;
  uvec2 private_refs;
  uvec2 loop_ends;
  uint counts;   // see count_field
  uint lengths;  // NO_PLACE: the header is malformed
  uint entries;
  uint codes;
  uint anchors;
  uint chains;     // low bits of chains,
  uint quotients;  //   and their unary parts
  uint interior;
  uvec2 waiting;  // mask of the boundary vertices that get their values in the traversal
};
// Offset and width of fields in Places.counts.
#define COUNT_TRIANGLES 0, 7
#define COUNT_REFERENCES 7, 6
#define COUNT_FLAGS 13, 3
#define COUNT_LENGTH_WIDTH 16, 3
#define COUNT_DELTA_WIDTH 19, 5
#define COUNT_SLOT_WIDTH 24, 3
#define count_field(places, field) bitfieldExtract((places).counts, field)
#define NO_PLACE 0xFFFFFFFFu
#define UNWANTED 0x80000000u

// --- access ---

// web/wgsl.glsl has the same for WGSL.
#ifndef WGSL
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Integers { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Pairs { uvec2 at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Summaries { uint of[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Connectivity {
  Connected of[];
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer PlacesOfMeshlets {
  Places of[];
};

// The place of the results of another meshlet of the job's blob.
#ifndef PLACE_OF
#define PLACE_OF(m) (m)
#endif

// Word or pair of words i from an address on.
#define ADDRESS uvec2
#define TRIANGLE_AT(address, i) Integers(address).at[i]
#define VALUE_AT(address, i) Integers(address).at[i]
#define VALUE_PAIR_AT(address, i) Pairs(address).at[i]
#define SET_VALUE_PAIR_AT(address, i, pair) Pairs(address).at[i] = pair

// triangles | vertices << 8 | error << 16. Both counts are 0 if the meshlet is malformed or
// UNWANTED. Threads combine errors by OR: the result need not be one of the ERROR_ constants.
#define SUMMARY(i) Summaries(push.summaries).of[i]
#define SET_SUMMARY(i, summary) SUMMARY(i) = summary
#define ADD_ERROR(i, code) atomicOr(SUMMARY(i), (code) << 16)
#define CONNECTED(i) Connectivity(push.connectivity).of[i]
#define PLACES(m) PlacesOfMeshlets(push.places).of[PLACE_OF(m)]
#endif

#endif

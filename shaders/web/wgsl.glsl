// First in every module that is translated to WGSL (tools/build_wgsl.py), after the macros that
// stand for specialisation constants: GLSL's functions that Slang does not translate, WGSL's
// atomics, and bindings instead of buffer addresses. web/webgpu.js binds the buffers.
#define WGSL

// build_wgsl.py's entry points set these: Slang would set its own in the first of a module only.
static uint the_thread;
static uint3 the_workgroup;
static uint3 the_invocation;
#define gl_LocalInvocationIndex the_thread
#define gl_WorkGroupID the_workgroup
#define gl_GlobalInvocationID the_invocation

#define barrier() GroupMemoryBarrierWithGroupSync()
#define findLSB(x) firstbitlow(x)
#define findMSB(x) firstbithigh(x)
#define bitCount(x) countbits(x)
#define floatBitsToUint(x) asuint(x)
#define uintBitsToFloat(x) asfloat(x)
// Slang writes its own without parentheses.
#define bitfieldExtract extract_bits
#define bitfieldInsert insert_bits
uint extract_bits(uint value, int first, int count) {
  __intrinsic_asm "extractBits($0, u32($1), u32($2))";
}
int extract_bits(int value, int first, int count) {
  __intrinsic_asm "extractBits($0, u32($1), u32($2))";
}
uint insert_bits(uint value, uint inserted, int first, int count) {
  __intrinsic_asm "insertBits($0, $1, u32($2), u32($3))";
}

#include "format/constants.h"
#include "decoders/decode_buffers.glsl"

// decode_push.glsl's push constants, and others.
struct Push {
  uint blob_words;
  uint meshlets;  // the job is meshlets [first, meshlets)
  uint streams;
  uint value_words;
  uint spread;
  uint first;
  // Of attribute.comp: the stream to convert, the word at which a meshlet's values of it begin, the
  // words between vertices, the bits of an element, and whether to write integers instead of
  // values.
  uint stream;
  uint base;
  uint stride;
  uint field;
  uint integers;
};
layout(binding = 0) StructuredBuffer<uint> the_blob;
layout(binding = 1) ConstantBuffer<Push> push;
layout(binding = 2) RWStructuredBuffer<Atomic<uint>> the_summaries;
layout(binding = 3) RWStructuredBuffer<uint> all_triangles;
layout(binding = 4) RWStructuredBuffer<uint> all_values;
layout(binding = 5) RWStructuredBuffer<Connected> connectivity;
layout(binding = 6) RWStructuredBuffer<Places> all_places;
layout(binding = 7) RWStructuredBuffer<uint> first_triangles;  // of each meshlet in the indices
layout(binding = 8) RWStructuredBuffer<uint> draw;             // arguments of drawIndexedIndirect
layout(binding = 9) RWStructuredBuffer<uint> status;  // malformed meshlets, and the first of them
layout(binding = 10) RWStructuredBuffer<uint> results;

// As in sections.glsl: WGSL takes only these values, and those of workgroupUniformLoad, for the
// same in all threads.
shared uint shared_uniform;
uint uniform_word(uint word) {
  if (gl_LocalInvocationIndex == 0u) shared_uniform = word;
  return workgroupUniformLoad(shared_uniform);
}
#define UNIFORM(word) uniform_word(word)
#define uniform_streams() push.streams
#define uniform_elements(s) ((the_blob[STREAM_SHAPE_WORD(s)] >> 8) & 7u)
#define uniform_predictor(s) (the_blob[STREAM_SHAPE_WORD(s)] >> 24)

// As in sections.glsl.
#define ATOMIC_UINT Atomic<uint>
#define ATOMIC_LOAD(place) (place).load()
#define ATOMIC_STORE(place, value) (place).store(value)
#define ATOMIC_OR(place, value) (place).or (value)
#define ATOMIC_MAX(place, value) (place).max(value)
#define ATOMIC_ADD(place, value) (place).add(value)

// As in serial_prologue.glsl.
#define open_blob(address, words)
#define BLOB_WORD(i) the_blob[i]
#define blob_word_total push.blob_words

// As in decode_buffers.glsl; an address is the index of a word.
#define ADDRESS uint
#define TRIANGLE_AT(address, i) all_triangles[(address) + (i)]
#define VALUE_AT(address, i) all_values[(address) + (i)]
#define VALUE_PAIR_AT(address, i) \
  uvec2(all_values[(address) + 2u * (i)], all_values[(address) + 2u * (i) + 1u])
#define SET_VALUE_PAIR_AT(address, i, pair)           \
  {                                                   \
    all_values[(address) + 2u * (i)] = (pair).x;      \
    all_values[(address) + 2u * (i) + 1u] = (pair).y; \
  }
#define SUMMARY(i) the_summaries[i].load()
#define SET_SUMMARY(i, summary) the_summaries[i].store(summary)
#define ADD_ERROR(i, code) the_summaries[i].or ((code) << 16)
#define CONNECTED(i) connectivity[i]
#define PLACES(i) all_places[i]

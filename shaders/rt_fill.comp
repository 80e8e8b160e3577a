// Decodes meshlets into slots, one invocation each: those that the cache lacks into free ones, or (push.scratch) those that paths wait for.
#version 460
#extension GL_GOOGLE_include_directive : require

#define OWN_PUSH
#include "rt_common.glsl"
#include "rt_cache.glsl"
#include "meshlet_decoder_prologue.glsl"
#include "meshlet_decoder.glsl"
#include "meshlet_decoder_epilogue.glsl"

layout(local_size_x = FILL_GROUP) in;

// The primitive that a meshlet belongs to.
uint primitive_of(uint number, uint primitives) {
  uint low = 0u;
  uint high = primitives;
  while (high - low > 1u) {
    uint middle = (low + high) >> 1;
    if (TracedList(push.traced).at[middle].first_meshlet <= number) low = middle;
    else high = middle;
  }
  return low;
}

uint pending;                              // bits of a vertex's attributes that do not fill a word yet
uint pending_bits;
uint next_word;

void put_bits(Counts words, uint value, uint bits) {
  pending |= value << pending_bits;
  uint filled = pending_bits + bits;
  if (filled >= 32u) {
    words.at[next_word] = pending;
    next_word++;
    filled -= 32u;
    pending = filled == 0u ? 0u : value >> (bits - filled);
  }
  pending_bits = filled;
}

void put_attributes(Counts words, uint vertex) {
  next_word = slot_attributes() + vertex * ATTRIBUTE_WORDS;
  uint end = next_word + ATTRIBUTE_WORDS;
  pending = 0u;
  pending_bits = 0u;
  for (uint s = 1u; s < stream_end; s++)
    for (uint c = 0u; c < stream_components[s]; c++) put_bits(words, values[(stream_lane[s] + c) * 64u + vertex], stream_bits[s]);
  if (next_word < end) words.at[next_word] = pending;
}

void put_position(uvec2 slot, uint vertex, Attribute position) {
  uvec3 q = uvec3(values[vertex], values[64u + vertex], values[128u + vertex]);
  if (POSITION_FLOATS) {
    vec3 p = position_value(position, q);
    for (uint c = 0u; c < 3u; c++) Counts(slot).at[SLOT_POSITIONS + 3u * vertex + c] = floatBitsToUint(p[c]);
  } else {
    Pairs(slot).at[SLOT_POSITIONS / 2u + vertex] = packed_position(q);
  }
}

void main() {
  CacheState state = CacheState(push.state);
  uint i = gl_GlobalInvocationID.x;
  if (i >= (push.scratch != 0u ? state.admitted : state.missing)) return;
  uint number = Counts(push.missing).at[i];
  uint first = state.ring + push.scratch - state.admitted;
  uint slot_number = push.scratch != 0u ? state.capacity + (first + i) % push.scratch : Counts(push.free_slots).at[state.free_slots - 1u - i];
  uint index = primitive_of(number, state.primitives);
  Traced traced = TracedList(push.traced).at[index];
  uvec2 slot = slot_address(push.cache, slot_number);
  Counts words = Counts(slot);
  open_blob(traced.blob, traced.blob_words);
  load_streams(0u, Primitives(Frame(push.frame).primitives).at[index].stream_end);
  decode_meshlet(number - traced.first_meshlet);
  uint count = error == ERROR_NONE ? triangle_count : 0u;
  for (uint t = 0u; t < MESHLET_TRIANGLES; t++) words.at[t] = t < count ? triangles[t] & 0xFFFFFFu : 0u;
  Attribute position = Primitives(Frame(push.frame).primitives).at[index].position;
  for (uint v = 0u; v < vertex_count && error == ERROR_NONE; v++) {
    put_position(slot, v, position);
    put_attributes(words, v);
  }
  Counts(push.slot_table).at[number] = slot_number;
}

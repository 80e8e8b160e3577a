// After a decoder: the values of one stream, vertex after vertex, 64 per meshlet (spec, appendix
// A.9). Nothing is written for missing vertices and for malformed meshlets.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;
#include "decoders/decode_push.glsl"

// Element c of vertex v, as packed_values.glsl stores it.
uint element_of(uint c, uint v) {
  uint at = job_values() + push.base;
  at += push.stride * v;
  if (push.stride > 2u) return VALUE_AT(at, c);
  uint first = c * push.field;
  uint value = VALUE_AT(at, first >> 5) >> (first & 31u);
  if ((first & 31u) + push.field > 32u) value |= VALUE_AT(at, 1u) << (32u - (first & 31u));
  return push.field == 32u ? value : value & ((1u << push.field) - 1u);
}

// One rounding if the device fuses, as in the C++ decoder.
float grid_value(uint q, float step, float offset) { return fma(float(q), step, offset); }

void put_direction(uint at, uint v, uint bits) {
  float scale = 2.0 / float((1u << bits) - 2u);
  float x = float(element_of(0u, v)) * scale - 1.0;
  float y = float(element_of(1u, v)) * scale - 1.0;
  float z = 1.0 - abs(x) - abs(y);
  float fold = max(-z, 0.0);
  x -= x < 0.0 ? -fold : fold;
  y -= y < 0.0 ? -fold : fold;
  float inverse = 1.0 / sqrt(x * x + y * y + z * z);
  results[at] = floatBitsToUint(x * inverse);
  results[at + 1u] = floatBitsToUint(y * inverse);
  results[at + 2u] = floatBitsToUint(z * inverse);
}

void main() {
  uint m = push.first + gl_WorkGroupID.x;
  uint v = gl_LocalInvocationIndex;
  open_job(m);
  uint summary = SUMMARY(m);
  if (summary >> 16 != ERROR_NONE || v >= ((summary >> 8) & 127u)) return;
  uint row = BLOB_HEADER_WORDS + BLOB_STREAM_WORDS * push.stream;
  uint shape = the_blob[row];
  uint kind = push.integers != 0u ? KIND_INTEGER : shape & 255u;
  uint elements = (shape >> 8) & 255u;
  uint vertex = 64u * gl_WorkGroupID.x + v;
  if (kind == KIND_OCT) {
    put_direction(3u * vertex, v, (shape >> 16) & 255u);
    return;
  }
  for (uint c = 0u; c < elements; c++) {
    uint q = element_of(c, v);
    uint word = q;
    if (kind == KIND_FLOAT32)
      word = (q & 0x80000000u) != 0u ? q ^ 0x80000000u : ~q;
    else if (kind == KIND_SIGN)
      word = floatBitsToUint(2.0 * float(q) - 1.0);
    else if (kind == KIND_GRID)
      word = floatBitsToUint(grid_value(q, uintBitsToFloat(the_blob[row + 2u]),
                                        uintBitsToFloat(the_blob[row + 3u + c])));
    results[elements * vertex + c] = word;
  }
}

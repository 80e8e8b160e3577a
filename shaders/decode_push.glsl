// Buffers of the decoding compute shaders (vk_backend/decode.py), and the job of connect.comp and values.comp: all meshlets of a blob.
#include "addresses.glsl"
#include "decode_buffers.glsl"

layout(push_constant) uniform Push {
  uvec2 blob;
  uvec2 summaries;
  uvec2 connectivity;
  uvec2 triangles;       // 64 words per meshlet, packed
  uvec2 integers;        // lanes x 64 words per meshlet
  uvec2 values;          // packed (packed_values.glsl), 64 vertices per meshlet (meshlet_passes.glsl)
  uint blob_words;
  uint meshlets;
  uint streams;          // that are decoded, and
  uint lanes;            //   the sum of their components
  uint vertex_words;     // of packed values (packed_values.glsl)
} push;

uint job_meshlet;        // number in the blob
uint job_place;          // of its results

// Meshlet i of the push.meshlets of the job; to be called before the functions below.
void open_job(uint i) {
  job_meshlet = i;
  job_place = i;
}

bool job_wanted() { return true; }
uvec2 job_blob() { return push.blob; }
uint job_blob_words() { return push.blob_words; }
uint job_streams() { return push.streams; }
uvec2 job_triangles() { return byte_offset(push.triangles, 64u, job_place); }   // address

uvec2 job_values() { return byte_offset(push.values, 64u * push.vertex_words, job_place); }

#ifdef PASS
// Of stream s, for packed_values.glsl: 64 vertices of the streams one after another, a position's components in 21 bits each if they fit.
uint field_of(uint s) {
  uint bits = stream_field(s, STREAM_BITS);
  uint n = stream_field(s, STREAM_COMPONENTS);
  uint field = s == 0u ? max(bits, 21u) : bits;
  return field * n <= 64u ? field : 32u;
}

uint words_of(uint s) { return (field_of(s) * stream_field(s, STREAM_COMPONENTS) + 31u) >> 5; }

uint stream_place(uint s) {
  uint words = 0u;
  for (uint before = 0u; before < s; before++) words += words_of(before);
  return placed(64u * words, words_of(s), field_of(s));
}
#endif

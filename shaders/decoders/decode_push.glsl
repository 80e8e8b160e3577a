// Push constants of the decoding compute shaders (bench/gpu_decoder.py), whose job is all
// meshlets of a blob. A shader need not use every buffer.
#ifndef DECODE_PUSH_GLSL
#define DECODE_PUSH_GLSL

#include "decoders/decode_buffers.glsl"
#ifdef WGSL
#define FIRST_MESHLET push.first
#else
#define FIRST_MESHLET 0u
#include "scene/addresses.glsl"

layout(push_constant) uniform Push {
  uvec2 blob;
  uvec2 summaries;
  uvec2 connectivity;
  uvec2 places;
  uvec2 triangles;  // 64 words per meshlet, packed
  uvec2 values;     // value_words words per meshlet: 64 per element, or packed_values.glsl's
  uint blob_words;
  uint meshlets;
  uint streams;  // to decode
  uint value_words;
  uint spread;  // of connect.comp: threads per meshlet, of which one decodes it and the others are
                // idle
}
push;
#endif

uint job_meshlet;  // number in the blob
uint job_place;    // number of its results

// Selects meshlet i of the job. Call before the functions below.
void open_job(uint i) {
  job_meshlet = i;
  job_place = i;
}

#define job_present true
bool job_wanted() { return true; }
uint job_streams() { return push.streams; }
#ifdef WGSL
uint job_triangles() { return 64u * job_place; }
uint job_values() { return push.value_words * (job_place - push.first); }
#else
uvec2 job_blob() { return push.blob; }
uint job_blob_words() { return push.blob_words; }
uvec2 job_triangles() { return byte_offset(push.triangles, 64u, job_place); }
uvec2 job_values() { return byte_offset(push.values, push.value_words, job_place); }
#endif

#endif

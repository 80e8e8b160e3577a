// Buffers of the decoding compute shaders (vk_backend/decode.py), and their job: all meshlets of a
// blob. A method need not use every buffer.
#include "scene/addresses.glsl"
#include "decoders/decode_buffers.glsl"

layout(push_constant) uniform Push {
  uvec2 blob;
  uvec2 summaries;
  uvec2 connectivity;
  uvec2 triangles;  // 64 words per meshlet, packed
  uvec2 values;     // value_words words per meshlet: 64 for each component, or packed ones
                    // (packed_values.glsl)
  uint blob_words;
  uint meshlets;
  uint streams;  // that are decoded
  uint value_words;
}
push;

uint job_meshlet;  // number in the blob
uint job_place;    // of its results

// Meshlet i of the push.meshlets of the job; to be called before the functions below.
void open_job(uint i) {
  job_meshlet = i;
  job_place = i;
}

bool job_wanted() { return true; }
uvec2 job_blob() { return push.blob; }
uint job_blob_words() { return push.blob_words; }
uint job_streams() { return push.streams; }
uvec2 job_triangles() { return byte_offset(push.triangles, 64u, job_place); }  // addresses
uvec2 job_values() { return byte_offset(push.values, push.value_words, job_place); }

// Buffers of the decoding compute shaders (vk_backend/decode.py), and the job of connect.comp and values.comp: all meshlets of a blob.
#include "addresses.glsl"
#include "decode_buffers.glsl"

layout(push_constant) uniform Push {
  uvec2 blob;
  uvec2 summaries;
  uvec2 connectivity;
  uvec2 triangles;       // 64 words per meshlet, packed
  uvec2 integers;        // lanes x 64 words per meshlet
  uvec2 lengths;         // of references, 64 words per meshlet (decode_pass.comp)
  uint blob_words;
  uint meshlets;
  uint streams;          // that are decoded, and
  uint lanes;            //   the sum of their components
} push;

uvec2 job_blob() { return push.blob; }
uint job_blob_words() { return push.blob_words; }
uint job_streams() { return push.streams; }
// Of meshlet i of the job: its number in the blob, whether it is to be decoded, where its results go, and the address of its triangles there.
uint job_meshlet(uint i) { return i; }
bool job_wants(uint i) { return true; }
uint job_place(uint i) { return i; }
uvec2 job_triangles(uint i) { return byte_offset(push.triangles, 64u, i); }

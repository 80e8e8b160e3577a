// Decodes meshlets into plain buffers with the serial decoder, one thread per meshlet.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(local_size_x = 32) in;
#include "decoders/decode_push.glsl"
#include "decoders/serial.glsl"

void main() {
  uint m = gl_GlobalInvocationID.x;
  if (m >= push.meshlets) return;
  open_job(m);
  open_blob(job_blob(), job_blob_words());
  load_streams(0u, job_streams());
  decode_meshlet(m);
  SET_SUMMARY(m, error == ERROR_NONE ? triangle_count | vertex_count << 8 : error << 16);
  if (error != ERROR_NONE) return;
  ADDRESS packed = job_triangles();
  ADDRESS integers = job_values();
  for (uint t = 0u; t < triangle_count; t++) TRIANGLE_AT(packed, t) = triangles[t];
  for (uint first = 0u; first < push.value_words; first += 64u)
    for (uint v = 0u; v < vertex_count; v++) VALUE_AT(integers, first + v) = values[first + v];
}

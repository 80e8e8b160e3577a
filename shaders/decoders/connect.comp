// Connectivity of meshlets by decoder B, one invocation per meshlet: triangles into the buffer that
// is also the result, and what values.comp, or the passes of passes.glsl, need to know about them.
// variants: connect.comp= connect_stream.comp=STREAM
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(local_size_x = 32) in;
#define MAX_ELEMENTS 1u
#ifdef STREAM
#include "raster/stream_push.glsl"
#else
#include "decoders/decode_push.glsl"
#endif
// No arrays of an invocation's own, which would be in slow memory; and four apices to a word, since
// the less shared memory a group takes, the more groups run at once.
shared uint apexes[16 * 32];
#define APEX_WORD(t) apexes[((t) >> 2) * 32u + gl_LocalInvocationIndex]
#define APEX(t) bitfieldExtract(APEX_WORD(t), int(((t) & 3u) * 8u), 8)
#define SET_APEX(t, v) APEX_WORD(t) = bitfieldInsert(APEX_WORD(t), v, int(((t) & 3u) * 8u), 8)
uvec2 connected_triangles;
#define TRIANGLE(t) Integers(connected_triangles).at[t]
#include "decoders/serial_prologue.glsl"
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"
#include "decoders/serial_connectivity.glsl"

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.meshlets) return;
  open_job(i);
  Summaries summaries = Summaries(push.summaries);
  if (!job_wanted()) {
    summaries.of[job_place] = 0u;
    return;
  }
  open_blob(job_blob(), job_blob_words());
  connected_triangles = job_triangles();
  connect(job_meshlet);
  Connectivity connectivity = Connectivity(push.connectivity);
  connectivity.of[job_place].boundary = boundary;
  connectivity.of[job_place].starts = disk_starts;
  summaries.of[job_place] = error == ERROR_NONE ? triangle_count | vertex_count << 8 : error << 16;
}

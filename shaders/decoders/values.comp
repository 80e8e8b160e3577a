// Values of meshlets by the team decoder, a workgroup each. Triangles come from connect.comp, or
// (PARALLEL) from the parallel connectivity. Writes slots of the ring of path `stream` (STREAM), or
// plain buffers.
// variants: values_stream.comp=STREAM bench:values.comp= bench:values_parallel.comp=PARALLEL
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(local_size_x = 32) in;
#define WORKGROUP 32u
#ifdef STREAM
#include "decoders/slot_jobs.glsl"
#else
#include "decoders/decode_push.glsl"
#endif

ADDRESS team_triangles;
#ifdef PARALLEL
#include "decoders/parallel_triangles.glsl"
#else
uint packed_triangle(uint t) { return TRIANGLE_AT(team_triangles, t & 63u); }
uvec2 connectivity_boundary() { return CONNECTED(job_place).boundary; }
uvec2 connectivity_starts() { return CONNECTED(job_place).starts; }
#endif
#include "decoders/team_values.glsl"
#ifdef STREAM
#include "decoders/slot_output.glsl"
#endif

void put_values() {
#ifdef STREAM
  Primitive primitive = job_primitive();
  for (uint v = THREAD; v < vertex_count; v += WORKGROUP) put_vertex(team_triangles, primitive, v);
#else
  ADDRESS integers = job_values();
  for (uint k = THREAD; k < push.value_words; k += WORKGROUP)
    if ((k & 63u) < vertex_count) VALUE_AT(integers, k) = team_values[k];
#endif
}

void main() {
#ifdef STREAM
  open_job(job_workgroup());
  if (!job_present) return;
#else
  open_job(gl_WorkGroupID.x);
#endif
#ifndef PARALLEL
  if ((SUMMARY(job_place) & 255u) == 0u) return;  // malformed or not wanted
#endif
  team_triangles = job_triangles();
  open_blob(job_blob(), job_blob_words());
  share_streams(job_streams());
  open_team();
  Header h = read_header(job_meshlet);
#ifdef PARALLEL
  read_team_symbols(h);
  decode_connectivity();
#else
  Connected connected = CONNECTED(job_place);
  triangle_count = h.triangles;
  symbol_c = connected.closing;
  symbol_e = connected.ends;
  symbol_s = connected.splits;
#endif
  team_decode(h);
#ifdef PARALLEL
  if (THREAD == 0u) SET_SUMMARY(job_place, triangle_count | vertex_count << 8);
  for (uint t = THREAD; t < triangle_count; t += WORKGROUP)
    TRIANGLE_AT(team_triangles, t) = packed_triangle(t);
  barrier();
#endif
  if (error == ERROR_NONE)
    put_values();
  else if (THREAD == 0u)
    SET_SUMMARY(job_place, error << 16);
}

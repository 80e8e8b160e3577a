// The first pass: connectivity by the serial decoder, one thread per meshlet. Writes the triangles
// to the result buffer, and masks for values.comp and the passes of passes.glsl.
// variants: connect_stream.comp=STREAM connect_bulk.comp=STREAM,BULK bench:connect.comp=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define WORKGROUP 32u
layout(local_size_x = WORKGROUP) in;
#ifdef STREAM
#include "decoders/slot_jobs.glsl"
#define THREAD_NUMBER (job_workgroup() * WORKGROUP + gl_LocalInvocationIndex)
layout(constant_id = 21) const uint SPREAD = 1u;  // as in decode_push.glsl
#else
#include "decoders/decode_push.glsl"
#define SPREAD push.spread
#define THREAD_NUMBER gl_GlobalInvocationID.x
#endif
#include "decoders/shared_apexes.glsl"
ADDRESS connected_triangles;
#define TRIANGLE(t) TRIANGLE_AT(connected_triangles, t)
#include "decoders/serial.glsl"
#include "decoders/serial_connectivity.glsl"

#if !defined(STREAM) || defined(BULK)
#define KEEPS_HEADERS
// Keeps the header for the passes after this one. Other meshlets look it up even if this one is
// malformed in another way.
void keep_header(HEADER_IN h) {
  Places places;
  places.foreign_refs = h.foreign_refs;
  places.private_refs = h.private_refs;
  places.loop_ends = h.loop_ends;
  places.counts = bitfieldInsert(0u, h.triangles, COUNT_TRIANGLES);
  places.counts = bitfieldInsert(places.counts, h.references, COUNT_REFERENCES);
  places.counts = bitfieldInsert(places.counts, h.flags, COUNT_FLAGS);
  places.counts = bitfieldInsert(places.counts, h.length_width, COUNT_LENGTH_WIDTH);
  places.counts = bitfieldInsert(places.counts, h.delta_width, COUNT_DELTA_WIDTH);
  places.counts = bitfieldInsert(places.counts, h.slot_width, COUNT_SLOT_WIDTH);
  places.lengths = header_sound ? h.lengths : NO_PLACE;
  places.entries = h.entries;
  places.codes = h.codes;
  PLACES(job_meshlet) = places;
}
#endif

void main() {
  uint i = FIRST_MESHLET + THREAD_NUMBER / SPREAD;
  if (i >= push.meshlets || gl_LocalInvocationIndex % SPREAD != 0u) return;
  open_job(i);
  bool wanted = job_present && job_wanted();
#ifdef BULK
  bool needed = job_present;  // other meshlets look up its header
#else
  bool needed = wanted;
#endif
  if (!needed) {
    SET_SUMMARY(job_place, UNWANTED);
    return;
  }
  open_blob(job_blob(), job_blob_words());
  connected_triangles = job_triangles();
  connect(job_meshlet);
#ifdef KEEPS_HEADERS
  keep_header(opened);
#endif
  CONNECTED(job_place).boundary = boundary;
  CONNECTED(job_place).starts = disk_starts;
  CONNECTED(job_place).closing = symbol_c;
  CONNECTED(job_place).ends = symbol_e;
  CONNECTED(job_place).splits = symbol_s;
  uint summary = error == ERROR_NONE ? triangle_count | vertex_count << 8 : error << 16;
  SET_SUMMARY(job_place, wanted ? summary : UNWANTED);
}

// Shared by lengths.comp, corners.comp and chains.comp of the bulk passes: a thread's meshlet,
// places along the boundary, sections, and residuals. Each thread decodes a small part of a
// meshlet. A pass writes values to their final place and the next pass reads them there.
//
// A pass must fit the instruction cache to be fast, so long functions are called from one place.
//
// Hostile bytes: local ids, ranks and references are masked or come from 64-bit masks, and buffers
// are written only at places computed from these. Loops end after 64 steps, with the streams, or at
// the blob's end. After an error, later passes skip the meshlet.

#ifndef PASSES_GLSL
#define PASSES_GLSL

#define WORKGROUP 64u
#define OWN_GRID_POSITION
#include "decoders/serial.glsl"
#include "decoders/sections.glsl"
#ifdef STREAM
#include "decoders/slot_jobs.glsl"
#else
#include "decoders/decode_push.glsl"
#endif
#include "decoders/packed_values.glsl"

layout(local_size_x = WORKGROUP) in;

// --- the thread's meshlet ---

uint member;      // number of the meshlet in the workgroup
uint first_item;  // number of the thread among those of the meshlet
bool present;     // there is such a meshlet
mask64 the_boundary;
mask64 the_starts;
mask64 the_references;  // ranks at which references begin; set by lengths.comp

// Call first, with all threads: contains barriers. threads: per meshlet. Returns false for threads
// without a meshlet or with a malformed one.
bool open_pass(uint threads) {
  member = THREAD / threads;
  first_item = THREAD % threads;
  uint number = FIRST_MESHLET + gl_WorkGroupID.x * (WORKGROUP / threads) + member;
  open_job(min(number, push.meshlets - 1u));
  open_blob(job_blob(), job_blob_words());
  share_streams(job_streams());
  share_value_places();
  the_values = job_values();
  Connected connected = CONNECTED(job_place);
  the_boundary = connected.boundary;
  the_starts = connected.starts;
  the_references = connected.references;
  symbol_c = connected.closing;
  symbol_e = connected.ends;
  symbol_s = connected.splits;
  error = ERROR_NONE;
  uint summary = SUMMARY(job_place);
  present = number < push.meshlets && job_present;
  return present && summary >> 16 == ERROR_NONE;
}

// The header of meshlet m, which connect.comp has read.
Header header_of(uint m) {
  Places places = PLACES(m);
  if (places.lengths == NO_PLACE) error = ERROR_REFERENCES;
  Header h;
  h.meshlet = m;
  h.triangles = count_field(places, COUNT_TRIANGLES);
  h.references = count_field(places, COUNT_REFERENCES);
  h.flags = count_field(places, COUNT_FLAGS);
  h.length_width = count_field(places, COUNT_LENGTH_WIDTH);
  h.delta_width = count_field(places, COUNT_DELTA_WIDTH);
  h.slot_width = count_field(places, COUNT_SLOT_WIDTH);
  h.entry_width =
      h.delta_width + h.slot_width + ((h.flags & FLAG_SEAMS) != 0u ? stream_total - 1u : 0u);
  h.lengths = places.lengths;
  h.entries = places.entries;
  h.codes = places.codes;
  h.foreign_refs = places.foreign_refs;
  h.private_refs = places.private_refs;
  h.loop_ends = places.loop_ends;
  h.owned_refs = mask_below(h.references) & ~(h.foreign_refs | h.private_refs);
  h.sized_refs = h.owned_refs | (h.private_refs & ~lone_references(h.loop_ends));
  return h;
}

Header open_header() {
  Header h = header_of(job_meshlet);
  triangle_count = h.triangles;
  return h;
}

void close_pass() {
  if (error != ERROR_NONE) ADD_ERROR(job_place, error);
}

// --- the workgroup's streams ---

// A row of workgroups decodes each stream. Streams of AFFINE need the values of stream 0, whose
// workgroups decode them after it.
uint first_stream() {
  uint s = gl_WorkGroupID.y;
  bool later = s > 0u && stream_field(s, STREAM_PREDICTOR) == PREDICT_AFFINE;
  return later ? stream_end : s;
}

// The stream to decode after stream s; stream_end if there is none.
uint next_stream(uint s) {
  if (gl_WorkGroupID.y > 0u) return stream_end;
  for (s++; s < stream_end; s++)
    if (stream_field(s, STREAM_PREDICTOR) == PREDICT_AFFINE) break;
  return s;
}

// --- along the boundary ---

// Position of the n-th one of a mask, counted from 0; at most 63 even if there is none.
uint nth_bit(mask64 m, uint n) {
  uint low = uint(bitCount(m.x));
  uint at = n < low ? 0u : 32u;
  uint word = n < low ? m.x : m.y;
  if (n >= low) n -= low;
  for (uint half_width = 16u; half_width > 0u; half_width >>= 1) {
    uint ones = uint(bitCount(word & word_below(half_width)));
    if (n >= ones) {
      n -= ones;
      at += half_width;
      word >>= half_width;
    }
  }
  return min(at, 63u);
}

// Number of local ids before disk k.
uint ids_before(uint k) {
  uint t = k >= mask_count(the_starts) ? triangle_count : nth_bit(the_starts, k);
  return min(64u, pushed_vertices(mask_below(t)) + min(k, mask_count(the_starts)));
}

// The loop of reference r of h: its first rank along the boundary, and the one behind its last.
uvec2 loop_of(HEADER_IN h, uint r) {
  uint k = mask_count(h.loop_ends & mask_below(r));
  return uvec2(mask_count(the_boundary & mask_below(ids_before(k))),
               mask_count(the_boundary & mask_below(ids_before(k + 1u))));
}

uint id_at(uint rank) { return nth_bit(the_boundary, rank); }

// A reference along the boundary.
struct Run {
  uint rank;   // of its first vertex
  uint steps;  // its length in edges
};

Run run_of(uint r) {
  uint rank = nth_bit(the_references, r);
  mask64 later = the_references & ~mask_below(rank + 1u);
  uint end = mask_any(later) ? mask_lsb(later) : mask_count(the_boundary);
  return Run(rank, min(end - rank, 64u));  // the masks of a malformed meshlet may be any
}

// Id of the last vertex of reference r.
uint last_id(HEADER_IN h, uint r, Run run) {
  return id_at(mask_test(h.loop_ends, r) ? loop_of(h, r).x : run.rank + run.steps);
}

// Local ids of the inner vertices of a reference.
mask64 inner_ids(Run run) {
  return the_boundary & ~mask_below(id_at(run.rank) + 1u) &
         mask_below(id_at(run.rank + run.steps - 1u) + 1u);
}

// --- sections ---

// Number of anchors of stream s. `count`: the number for stream s - 1; initially the number of
// disks.
uint anchors_of(HEADER_IN h, uint s, uint count) {
  if (h.references == 0u || (s > 0u && (h.flags & FLAG_SEAMS) == 0u)) return count;
  return mask_count(stored_corners(h, seam_references(h, s)));
}

// The places of meshlet m, found by lengths.comp.
Places places_of(uint m) {
  Places places = PLACES(m);
  if (places.quotients == NO_PLACE) error = ERROR_CODE;
  return places;
}

// Number of inner vertices of all owned references (x) and of those before `reference` (y).
uvec2 chain_vertices(HEADER_IN h, uint reference) {
  uvec2 count = uvec2(0u);
  uint p = h.lengths;
  uint used = 0u;
  mask64 window = load_mask(p, 64u);
  for (mask64 rest = h.sized_refs; mask_any(rest); rest = mask_clear_lsb(rest)) {
    if (used + h.length_width > 64u) {
      p += used;
      used = 0u;
      window = load_mask(p, 64u);
    }
    uint r = mask_lsb(rest);
    uint inner = mask_test(h.owned_refs, r) ? get_field(window, used, h.length_width) : 0u;
    count += uvec2(inner, r < reference ? inner : 0u);
    used += h.length_width;
  }
  return count;
}

// --- positions ---

// Three packed elements of stream 0 have 21 bits each: more do not fit, and less are widened.
Triple grid_position(uint id) {
  uint word = word_of(0u, id);
  if (!is_packed(0u))
    return Triple(VALUE_AT(the_values, word), VALUE_AT(the_values, word + 1u),
                  VALUE_AT(the_values, word + 2u));
  uvec2 fields = VALUE_PAIR_AT(the_values, word >> 1);
  return Triple(fields.x & 0x1FFFFFu, ((fields.x >> 21) | (fields.y << 11)) & 0x1FFFFFu,
                (fields.y >> 10) & 0x1FFFFFu);
}

#endif

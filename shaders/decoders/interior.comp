// The last pass, after chains.comp: the vertices inside the boundary of a meshlet, and its seams. A
// workgroup decodes a meshlet as the team decoder does.
// variants: interior_bulk.comp=STREAM bench:interior.comp=
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
uint packed_triangle(uint t) { return TRIANGLE_AT(team_triangles, t & 63u); }
Connected connected;
uvec2 connectivity_boundary() { return connected.boundary; }
uvec2 connectivity_starts() { return connected.starts; }
#include "decoders/team_meshlet.glsl"
#include "decoders/team_interior.glsl"
#include "decoders/packed_values.glsl"

// Ranks and lengths of the references, from the ranks at which they begin.
void place_team_references() {
  uint ranks = mask_count(team_boundary);
  for (uint rank = THREAD; rank < ranks; rank += WORKGROUP) {
    if (!mask_test(connected.references, rank)) continue;
    uint r = mask_count(connected.references & mask_below(rank));
    mask64 later = connected.references & ~mask_below(rank + 1u);
    uint length = (mask_any(later) ? mask_lsb(later) : ranks) - rank;
    team_references[r & 63u] = rank | length << 8;
  }
  if (THREAD == 0u) team_ranks = connected.references;
}

// Finds the seams of the meshlet. Contains barriers.
Header find_seams_of() {
  Header h = read_header(job_meshlet);
  find_disks();
  place_team_references();
  for (uint s = THREAD; s < stream_total; s += WORKGROUP) team_seam_refs[s] = seam_references(h, s);
  barrier();
  return h;
}

// Copies the values of boundary vertices, which earlier passes have decoded.
void load_boundary() {
  for (uint id = THREAD; id < vertex_count; id += WORKGROUP) {
    if (!mask_test(team_boundary, id)) continue;
    for (uint s = 0u; s < stream_end; s++) {
      uvec2 fields = is_packed(s) ? vertex_at(s, id) : uvec2(0u);
      uint field = place_field(s, PLACE_FIELD);
      for (uint c = 0u; c < stream_field(s, STREAM_ELEMENTS); c++)
        team_values[value_element(s, c) + id] =
            is_packed(s) ? get_field(fields, c * field, field) : value_at(s, c, id);
    }
  }
}

void store_values(mask64 known) {
  for (uint id = THREAD; id < vertex_count; id += WORKGROUP) {
    if (mask_test(known, id)) continue;
    for (uint s = 0u; s < stream_end; s++) {
      uvec2 fields = uvec2(0u);
      for (uint c = 0u; c < stream_field(s, STREAM_ELEMENTS); c++) {
        uint value = team_values[value_element(s, c) + id];
        if (is_packed(s))
          fields |= put_field(c * place_field(s, PLACE_FIELD), value);
        else
          put_value(s, c, id, value);
      }
      if (is_packed(s)) put_vertex(s, id, fields);
    }
  }
}

void main() {
  open_job(FIRST_MESHLET + gl_WorkGroupID.x);
  uint summary = SUMMARY(job_place);
  Places places = PLACES(job_meshlet);
  uint live = summary >> 16 == ERROR_NONE && places.interior != NO_PLACE ? 1u : 0u;
  uint state = UNIFORM(live | count_field(places, COUNT_FLAGS) << 1);
  if ((state & 1u) == 0u) return;
  bool seams = ((state >> 1) & FLAG_SEAMS) != 0u;
  open_blob(job_blob(), job_blob_words());
  share_streams(job_streams());
  share_value_places();
  the_values = job_values();
  team_triangles = job_triangles();
  connected = CONNECTED(job_place);
  symbol_c = connected.closing;
  symbol_e = connected.ends;
  symbol_s = connected.splits;
  triangle_count = summary & 127u;
  vertex_count = min((summary >> 8) & 127u, 64u);
  team_boundary = connected.boundary;
  open_team();
  for (uint s = THREAD; s < stream_total; s += WORKGROUP) team_seam_refs[s] = mask_none();
  mask64 owned = mask_below(count_field(places, COUNT_REFERENCES)) &
                 ~(places.foreign_refs | places.private_refs);
  read_interior_codes(places.codes, mask_any(owned));
  barrier();
  if (THREAD == 0u) {
    team_interior = places.interior;
    team_waiting = places.waiting;
  }
  Header h;
  h.references = 0u;
  h.flags = 0u;
  if (seams) h = find_seams_of();
  barrier();
  list_traversal();
  load_boundary();
  read_interior(true);
  bool sound = agree();
  predict(h, sound, true, seams);
  barrier();
  if (sound)
    store_values(h.flags != 0u ? mask_none() : team_boundary & ~places.waiting);
  else if (THREAD == 0u)
    ADD_ERROR(job_place, error);
}

// The last pass, after chains.comp: what lies inside the boundary of a meshlet, and its seams. A
// workgroup decodes a meshlet as the team decoder does.
// variants: interior.comp=TEAM=32u interior8.comp=TEAM=32u,NO_STAGE interior16.comp=TEAM=16u,NO_STAGE
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(local_size_x = 32) in;
#include "decoders/decode_push.glsl"
#include "decoders/team_size.glsl"
#include "decoders/serial_prologue.glsl"
#define OWN_GRID_POSITION
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"

uvec2 team_triangles;
uint packed_triangle(uint t) { return Integers(team_triangles).at[t & 63u]; }
Connected connected;
uvec2 connectivity_boundary() { return connected.boundary; }
uvec2 connectivity_starts() { return connected.starts; }
#include "decoders/team_meshlet.glsl"
#include "decoders/team_interior.glsl"
#include "decoders/packed_values.glsl"

// Ranks and lengths of the references, from the ranks at which they begin.
void place_references_of(HEADER_IN h) {
  uint ranks = mask_count(team_boundary);
  for (uint rank = MEMBER; rank < ranks && h.references > 0u; rank += TEAM) {
    mask64 later = connected.references & ~mask_below(rank + 1u);
    uint r = mask_count(connected.references & mask_below(rank + 1u)) - 1u;
    if (mask_test(connected.references, rank))
      team_references[TEAM_INDEX][r & 63u] = rank | ((mask_any(later) ? mask_lsb(later) : ranks) - rank) << 8;
    else if (mask_test(h.private_refs, r))
      add_waiting(rank);
  }
  if (MEMBER == 0u) team_ranks[TEAM_INDEX] = connected.references;
  if (h.references == 0u && MEMBER == 0u) add_waiting_loops();
}

// Bit position of the interior; keeps the positions of its codes.
uint find_interior(HEADER_IN h) {
  bool chains = mask_any(h.owned_refs);
  uint total = 0u;  // inner vertices of owned references
  for (mask64 rest = h.owned_refs; mask_any(rest); rest = mask_clear_lsb(rest))
    total += reference_length_of(mask_lsb(rest)) - 1u;
  uint p = anchors_begin(h);
  uint codes = h.codes;
  uint count = team_disks;
  uint low = 0u;
  uint ones = 0u;
  for (uint s = 0u; s < stream_total; s++) {
    uint n = stream_field(s, STREAM_ELEMENTS);
    if (h.references > 0u && (s == 0u || (h.flags & FLAG_SEAMS) != 0u))
      count = mask_count(stored_corners(h, seam_references(h, s)));
    p = after_anchors(p, s, count);
    if (chains) {
      uint code = code_at(codes, s, true);
      low += total * low_width(code, n, codes - WIDTH_BITS * n);
      if (code != CODE_FIXED) ones += total * n;
    }
    if (MEMBER == 0u) team_codes[TEAM_INDEX][s] = codes;
    code_at(codes, s, false);
  }
  return after_ones(p + low, ones);
}

// Copies the values of boundary vertices, which earlier passes have decoded.
void load_boundary() {
  for (uint id = MEMBER; id < vertex_count; id += TEAM) {
    if (!mask_test(team_boundary, id)) continue;
    for (uint s = 0u; s < stream_end; s++) {
      uvec2 fields = is_packed(s) ? vertex_at(s, id) : uvec2(0u);
      uint field = place_field(s, PLACE_FIELD);
      for (uint c = 0u; c < stream_field(s, STREAM_ELEMENTS); c++)
        team_values[TEAM_INDEX][value_element(s, c) + id] =
            is_packed(s) ? get_field(fields, c * field, field) : value_at(s, c, id);
    }
  }
}

void store_values(mask64 known) {
  for (uint id = MEMBER; id < vertex_count; id += TEAM) {
    if (mask_test(known, id)) continue;
    for (uint s = 0u; s < stream_end; s++) {
      uvec2 fields = uvec2(0u);
      for (uint c = 0u; c < stream_field(s, STREAM_ELEMENTS); c++) {
        uint value = team_values[TEAM_INDEX][value_element(s, c) + id];
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
  uint number = gl_WorkGroupID.x * TEAMS + TEAM_INDEX;
  open_job(min(number, push.meshlets - 1u));
  Summaries summaries = Summaries(push.summaries);
  bool sound = number < push.meshlets && summaries.of[job_place] >> 16 == ERROR_NONE;
  if (TEAMS == 1u && !sound) return;  // no other team waits at the barriers
  open_blob(job_blob(), job_blob_words());
  group_streams(job_streams());
  group_value_places();
  the_values = job_values();
  team_triangles = job_triangles();
  connected = Connectivity(push.connectivity).of[job_place];
  symbol_c = connected.closing;
  symbol_e = connected.ends;
  symbol_s = connected.splits;
  open_team(job_meshlet);
  Header h = read_header(job_meshlet);
  triangle_count = h.triangles;
  if (!sound) error = ERROR_OFFSET;
  if (agree()) {
    find_disks();
    for (uint s = MEMBER; s < stream_total; s += TEAM)
      team_seam_refs[TEAM_INDEX][s] = seam_references(h, s);
  }
  bool live = agree();
  if (live) place_references_of(h);
  barrier();
  uint interior = live ? find_interior(h) : 0u;
  if (MEMBER == 0u) team_interior[TEAM_INDEX] = interior;
  if (live) {
    list_traversal();
    load_boundary();
  }
  read_interior(live);
  live = agree();
  predict_chains(h, live, true);
  predict_traversed(live);
  barrier();
  if (live)
    store_values((h.flags & FLAG_SEAMS) != 0u ? mask_none()
                                              : team_boundary & ~team_waiting[TEAM_INDEX]);
  else if (sound && MEMBER == 0u)
    atomicOr(summaries.of[job_place], error << 16);
}

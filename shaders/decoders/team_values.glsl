// The team decoder: WORKGROUP threads decode the values of one meshlet (spec, appendix A.7). The
// triangles come from the serial decoder of another shader or from parallel_connectivity.glsl.
//
// The includer does what team_meshlet.glsl asks for, and calls open_blob and share_streams(end)
// once, then open_team(), read_header(m), read_team_symbols(h), and then team_decode with all
// threads. Results: team_values[element * 64 + local id], vertex_count, and `error`,
// equal for all threads of a team.
//
// needs: WORKGROUP, packed_triangle, connectivity_boundary, connectivity_starts
#ifndef TEAM_VALUES_GLSL
#define TEAM_VALUES_GLSL

#include "decoders/team_meshlet.glsl"
#include "decoders/team_boundary.glsl"
#include "decoders/team_interior.glsl"

uint decoded_value(uint element, uint vertex) {
  return team_values[min(element, MAX_ELEMENTS - 1u) * 64u + vertex];
}

// Reads the symbols of meshlet h: each thread finds those of its triangles by counting bits.
// Contains a barrier.
void read_team_symbols(HEADER_IN h) {
  Planes planes = load_planes(h.begin, h.triangles);
  triangle_count = h.triangles;
  // By the number of planes that the symbol has ones in: R, first, second, third, S.
  uint kinds = h.table == 0u ? 0x34210u : 0x32140u;
  for (uint t = THREAD; t < triangle_count; t += WORKGROUP) {
    uint place = t;  // the symbol's bit in its last plane
    uint ones = 0u;
    if (mask_test(planes.p0, t)) {
      place = mask_count(planes.p0 & mask_below(t));
      ones = 1u;
      if (mask_test(planes.p1, place)) {
        place = mask_count(planes.p1 & mask_below(place));
        ones = 2u;
        if (mask_test(planes.p2, place)) {
          place = mask_count(planes.p2 & mask_below(place));
          ones = mask_test(planes.p3, place) ? 4u : 3u;
        }
      }
    }
    uint kind = t + 1u == triangle_count ? 2u : bitfieldExtract(kinds, int(4u * ones), 4);
    mask64 bit = mask_bit(t);
    if (kind == 4u) continue;  // L
    if (t < 32u)
      atomicOr(team_symbols[kind].x, bit.x);
    else
      atomicOr(team_symbols[kind].y, bit.y);
  }
  barrier();
  symbol_r = team_symbols[0];
  symbol_c = team_symbols[1];
  symbol_e = team_symbols[2];
  symbol_s = team_symbols[3];
}

// Decodes the values of the meshlet with header h, whose symbols and triangles are known.
void team_decode(Header h) {
  if (agree()) {
    find_disks();
    for (uint s = THREAD; s < stream_total; s += WORKGROUP)
      team_seam_refs[s] = seam_references(h, s);
  }
  bool sound = agree();
  uint corners = h.references == 0u ? team_disks : h.references;
  for (uint pass = 0u; pass < 2u; pass++) {
    bool measuring = pass == 0u;
    uint items = measuring ? h.references : h.references + corners + 1u;
    for (uint item = THREAD; item < items && sound; item += WORKGROUP) {
      uint kind = item < h.references             ? ITEM_REFERENCE
                  : item < h.references + corners ? ITEM_CORNER
                                                  : ITEM_SELF;
      read_boundary_item(h, measuring, kind, kind == ITEM_CORNER ? item - h.references : item);
    }
    sound = agree();
    if (measuring && sound) place_team_references(h);
    barrier();
    if (measuring && sound) list_traversal();
  }
  if (sound) read_interior_codes(h.codes, mask_any(h.owned_refs));
  read_interior(sound);
  sound = agree();
  predict(h, sound, false, true);
  barrier();
}

#endif

// The boundary of a team's meshlet: lengths of references, values of corners, and residuals of
// chains in place of their values.
//
// needs: WORKGROUP, packed_triangle, connectivity_boundary, connectivity_starts
#ifndef TEAM_BOUNDARY_GLSL
#define TEAM_BOUNDARY_GLSL

#include "decoders/team_meshlet.glsl"

// --- references, corners, chains ---

#define ITEM_REFERENCE 0u
#define ITEM_CORNER 1u
#define ITEM_SELF 2u  // finds the interior

void write_anchor(uint s, uint p, uint index, uint id) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint widths = index > 0u ? anchor_widths(s, p + n * stream_field(s, STREAM_BITS)) : 0u;
  for (uint c = 0u; c < n; c++)
    team_values[value_element(s, c) + id] = anchor_value(s, p, index, widths, c);
}

// Writes the residuals of the inner vertices of reference r for stream s in place of their values.
// `low`, `quotients`: bit positions of the first low bits and quotient.
void write_chain_residuals(uint s, uint r, bool backwards, uint code, uint widths, uint low,
                           uint quotients) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint length = reference_length_of(r);
  uint rank = team_references[r & 63u] & 63u;
  bool rice = code != CODE_FIXED;
  if (rice) unary = seek_unary(quotients);
  uint id = 0u;
  uint c = n;
  uint i = 0u;
  for (uint item = (length - 1u) * n; item > 0u; item--) {
    if (c == n) {
      c = 0u;
      i++;
      id = loop_id(rank + (backwards ? length - i : i));
    }
    uint width = rice ? code : width_field(widths + WIDTH_BITS * c);
    uint residual = load_bits(low, width);
    if (rice) residual += next_quotient() << width;
    low += width;
    team_values[value_element(s, c) + id] = unzigzag(residual);
    c++;
  }
  if (max(low, rice ? unary.cursor : 0u) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

// Reads an item's part of meshlet h's sections: anchor `index` of streams [begin, end), the
// residuals of the chain that is `reference` of its owner, or the beginning of the interior.
void read_sections(HEADER_IN own, HEADER_IN h, uint kind, uint j, uint reference, uint index,
                   uint begin, uint end) {
  bool chains = mask_any(h.owned_refs);
  uint total = 0u;  // inner vertices of all owned references
  uint first = 0u;  // and of those before `reference`
  uint lengths = h.lengths;
  for (mask64 rest = h.sized_refs; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    uint inner = mask_test(h.owned_refs, r) ? load_bits(lengths, h.length_width) : 0u;
    total += inner;
    if (r < reference) first += inner;
    lengths += h.length_width;
  }
  uint p = anchors_begin(h);
  uint count = team_disks;  // anchors, if h, then the team's own meshlet, has no references
  for (uint s = 0u; s < stream_total; s++) {
    if (h.references > 0u && (s == 0u || (h.flags & FLAG_SEAMS) != 0u))
      count = mask_count(stored_corners(h, seam_references(h, s)));
    if (kind == ITEM_CORNER && s >= begin && s < end)
      write_anchor(s, p, index, own.references == 0u ? disk_begin(j) & 63u : first_id(j));
    p = after_anchors(p, s, count, further_widths(p, s, count));
  }
  if (kind == ITEM_CORNER || !chains) {
    if (kind == ITEM_SELF) team_interior = p;
    return;
  }
  uint low = p;
  uint quotients = p;
  // Two passes: the quotients begin after the low bits of all streams.
  for (uint pass = 0u; pass < 2u; pass++) {
    uint codes = h.codes;
    uint skipped = 0u;
    for (uint s = 0u; s < stream_total; s++) {
      uint n = stream_field(s, STREAM_ELEMENTS);
      uint code = code_at(codes, s, true);
      uint widths = codes - WIDTH_BITS * n;
      uint width = low_width(code, n, widths);
      code_at(codes, s, false);
      if (pass == 0u) {
        quotients += total * width;
        continue;
      }
      uint rice = code == CODE_FIXED ? 0u : n;
      bool wanted = kind == ITEM_REFERENCE && s < stream_end && !mask_test(team_seam_refs[s], j);
      if (wanted) {
        quotients = after_ones(quotients, skipped + first * rice);
        write_chain_residuals(s, j, mask_test(own.foreign_refs, j), code, widths,
                              low + first * width, quotients);
        skipped = (total - first) * rice;
      } else {
        skipped += total * rice;
      }
      low += total * width;
    }
    if (pass == 1u && kind == ITEM_SELF) team_interior = after_ones(quotients, skipped);
  }
}

// One item: the length of reference j (measuring), the residuals of reference j, the value of
// corner j, or the team's own meshlet. They share this code because all follow references.
void read_boundary_item(HEADER_IN own, bool measuring, uint kind, uint j) {
  if (kind == ITEM_REFERENCE && !measuring &&
      (mask_test(own.private_refs, j) || reference_length_of(j) < 2u))
    return;
  for (uint s = 0u; s < stream_end;) {
    Header h = own;
    uint corner = j;
    uint index = j;
    bool apart = (own.flags & FLAG_SEAMS) != 0u;
    bool found = kind == ITEM_SELF || (kind == ITEM_CORNER && own.references == 0u);
    for (uint hop = 0u; !found; hop++) {
      mask64 seams = kind == ITEM_CORNER ? seam_references(h, s) : mask_none();
      mask64 shared_refs = h.foreign_refs & ~seams;
      uint before = previous_reference(h, corner) & 63u;
      bool follow = mask_test(shared_refs, corner) && !(kind == ITEM_REFERENCE && hop == 1u);
      bool follow_before = kind == ITEM_CORNER && mask_test(shared_refs, before);
      if (!follow && !follow_before) {
        if (kind == ITEM_CORNER) index = mask_count(stored_corners(h, seams) & mask_below(corner));
        break;
      }
      if (follow && follow_before) follow = owner_of(h, before) >= owner_of(h, corner);
      uint r = follow ? corner : before;
      uint entry = entry_position(h, r);
      uint slot = entry_slot(h, entry);
      if (hop == MAX_HOPS) error = ERROR_HOPS;
      h = read_header(entry_owner(h, entry));
      uint reference = slot_reference(h, slot) & 63u;
      corner = (kind == ITEM_CORNER && follow ? next_reference(h, reference) : reference) & 63u;
      apart = apart || (h.flags & FLAG_SEAMS) != 0u;
      if (error != ERROR_NONE) break;
    }
    uint next = kind == ITEM_CORNER && apart ? s + 1u : stream_end;
    if (measuring && error == ERROR_NONE) {
      uint length = 0u;
      if (mask_test(own.private_refs & ~own.sized_refs, j)) {
        uvec2 ranks = loop_ranks(mask_count(own.loop_ends & mask_below(j)));
        length = ranks.y - ranks.x;
      } else {
        length = stored_length(h, corner);
      }
      team_references[j] = min(length, 64u) << 8;
    } else if (error == ERROR_NONE) {
      read_sections(own, h, kind, j, corner, index, s, next);
    }
    s = error == ERROR_NONE ? next : stream_end;
  }
}

// Computes the ranks of the references from their lengths, and collects the inner vertices of
// private ones, which wait for the traversal.
void place_team_references(HEADER_IN h) {
  if (h.references > 0u && mask_count(h.loop_ends) != team_disks) error = ERROR_REFERENCES;
  for (uint r = THREAD; r < h.references; r += WORKGROUP) {
    uint rank = 0u;
    for (uint before = 0u; before < r; before++) rank += team_references[before] >> 8;
    uint length = reference_length_of(r);
    uvec2 ranks = loop_ranks(mask_count(h.loop_ends & mask_below(r)));
    if (r == loop_begin(h, r) && rank != ranks.x) error = ERROR_REFERENCES;
    if (mask_test(h.loop_ends, r) ? rank + length != ranks.y : rank + length > ranks.y)
      error = ERROR_REFERENCES;
    atomicOr(team_references[r], rank & 63u);
    mask64 start = mask_bit(rank & 63u);
    atomicOr(team_ranks.x, start.x);
    atomicOr(team_ranks.y, start.y);
    if (!mask_test(h.private_refs, r)) continue;
    for (uint i = 1u; i < length; i++) add_waiting(rank + i);
  }
  if (h.references == 0u && THREAD == 0u) add_waiting_loops();
}

#endif

// Positions only, for shaders short of registers and local memory. The steps are those of
// serial_decoder.glsl, but values go vertex by vertex instead of through lists. Of other streams
// only the unary parts of chains are touched, which lie before the interior of stream 0.
//
// Call load_streams(0u, 1u) on an open blob first. Results are those of decode_meshlet, except that
// errors in other streams go unnoticed.
#ifndef SERIAL_POSITIONS_GLSL
#define SERIAL_POSITIONS_GLSL

#define RESIDUALS 4u
#include "decoders/serial.glsl"

uint position_code;     // of the open list
uvec3 position_widths;  // under a fixed code

void open_positions(uint code, uint widths) {
  position_code = code;
  if (code == CODE_FIXED)
    position_widths = uvec3(width_field(widths), width_field(widths + WIDTH_BITS),
                            width_field(widths + 2u * WIDTH_BITS));
}

uint next_residual(uint width) {
  if (position_code != CODE_FIXED)
    return unzigzag(coded_value(position_code, next_quotient(), low_cursor));
  uint residual = load_bits(low_cursor, width);
  low_cursor += width;
  return unzigzag(residual);
}

uvec3 position_of(uint v) { return uvec3(values[v], values[v + 64u], values[v + 128u]); }

void put_position(uint v, uvec3 prediction) {
  uint bits = stream_mask[0];
  values[v] = (prediction.x + next_residual(position_widths.x)) & bits;
  values[v + 64u] = (prediction.y + next_residual(position_widths.y)) & bits;
  values[v + 128u] = (prediction.z + next_residual(position_widths.z)) & bits;
}

// The inner vertices of reference r. A foreign chain runs backwards, in its owner's direction.
void put_chain(uint r, bool backwards) {
  uint n = reference_length[r];
  uint rank = reference_rank[r];
  uvec3 start = position_of(loop_vertex[rank]);
  uvec3 end = position_of(reference_end[r]);
  uvec3 before = backwards ? end : start;
  uvec3 last = backwards ? start : end;
  bool copies = stream_predictor[0] == PREDICT_COPY;
  for (uint left = n; left > 1u && error == ERROR_NONE; left--) {
    uint v = loop_vertex[(rank + (backwards ? left - 1u : n + 1u - left)) & 63u];
    uvec3 point = before;
    if (!copies)
      point = uvec3(toward(before.x, last.x, left), toward(before.y, last.y, left),
                    toward(before.z, last.z, left));
    put_position(v, point);
    before = position_of(v);
  }
}

void put_foreign_chains(HEADER_IN h) {
  for (mask64 rest = h.foreign_refs; mask_any(rest) && error == ERROR_NONE;
       rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    if (reference_length[r] < 2u) continue;
    visit(reference_owner[r]);
    locate_visited();
    uint other = slot_reference(visited, reference_slot[r]);
    uint first = 0u;
    for (mask64 earlier = visited.owned_refs & mask_below(other); mask_any(earlier);
         earlier = mask_clear_lsb(earlier))
      first += stored_length(visited, mask_lsb(earlier)) - 1u;
    open_chains();
    open_positions(chain_code[0], chain_widths[0]);
    skip_residuals(0u, first, chain_code[0], chain_widths[0]);
    put_chain(r, true);
  }
}

// Leaves the unary reader behind the chains.
void put_own_chains(HEADER_IN h) {
  open_chains();
  if (chain_total == 0u) return;
  open_positions(chain_code[0], chain_widths[0]);
  for (mask64 rest = h.owned_refs; mask_any(rest); rest = mask_clear_lsb(rest))
    put_chain(mask_lsb(rest), false);
  uint others = 0u;
  for (uint s = 1u; s < stream_total; s++) others += unary_count(s, chain_total, chain_code[s]);
  if (error == ERROR_NONE) skip_unary(others);
}

void put_traversed(uint triangle) {
  bool across = triangle >> 24 != NO_VERTEX;
  uvec3 a = position_of(triangle & 255u);
  uvec3 b = position_of((triangle >> 8) & 255u);
  uvec3 o = across ? position_of(triangle >> 24) : uvec3(0u);
  uvec3 prediction;
  for (uint c = 0u; c < 3u; c++)
    prediction[c] = traversed_prediction(stream_predictor[0], a[c], b[c], o[c], across);
  put_position((triangle >> 16) & 255u, prediction);
}

// `waiting`: boundary vertices that get their values in the traversal. A root gate with a waiting a
// takes two steps: first a, predicted from b alone.
void put_interior(mask64 waiting) {
  uint count = mask_count(symbol_c) + mask_count(waiting);
  open_lists(unary.cursor, unary_count(0u, count, interior_code[0]));
  open_positions(interior_code[0], interior_widths[0]);
  for (uint t = 0u; t < triangle_count && error == ERROR_NONE;) {
    uint triangle = triangles[t];
    uint a = triangle & 255u;
    bool root = mask_test(disk_starts, t) && mask_test(waiting, a);
    if (root) {
      uint b = (triangle >> 8) & 255u;
      triangle = pack4(b, b, a, b);
    }
    uint v = (triangle >> 16) & 255u;
    if (mask_test(waiting, v) || mask_test(symbol_c, t)) put_traversed(triangle);
    waiting = waiting & ~mask_bit(v);
    if (!root) t++;
  }
  if (mask_any(waiting) || max(unary.cursor, low_cursor) > 8u * (byte_length - BLOB_PADDING_BYTES))
    error = ERROR_UNARY;
}

void decode_positions(uint m) {
  open_meshlet(m);
  if (error == ERROR_NONE) connect_meshlet();
  if (error == ERROR_NONE && mask_any(opened.foreign_refs)) {
    read_foreign_corners(opened);
    if (error == ERROR_NONE) put_foreign_chains(opened);
  }
  if (error != ERROR_NONE) return;
  find_lists(opened, disk_count);
  if (error != ERROR_NONE) return;
  read_own_anchors(opened, 0u, stored_corners(opened, mask_none()));
  put_own_chains(opened);
  if (error == ERROR_NONE) put_interior(boundary & ~known_vertices(opened));
}

#endif

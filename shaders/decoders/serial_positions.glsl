// Positions only, for shaders short of registers and local memory. The steps are those of
// serial_decoder.glsl, but values go vertex by vertex instead of through lists, and all long
// functions are called from one place. Other streams are never touched: stream 0 comes first.
//
// Define RESIDUALS as 4u before serial_decoder.glsl. Include after serial_epilogue.glsl; call
// load_streams(0u, 1u) on an open blob first. Results are those of decode_meshlet, except that
// errors in other streams go unnoticed.

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
    return unzigzag(coded_value(position_code, next_quotient(unary), low_cursor));
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

// What put_boundary reads: everything of the opened meshlet, or a foreign corner or chain.
#define OWN_BOUNDARY 0u
#define FOREIGN_CORNER 1u
#define FOREIGN_CHAIN 2u

// Makes `visited` the meshlet that stores what reference r of the opened one needs: its corner,
// reached through reference `source`, or its chain. Returns the number of the stored corner, or the
// owned reference.
uint find_stored(uint kind, uint r, uint source) {
  uint owner = reference_owner[source];
  uint slot = reference_slot[source];
  bool at_end = source != r;
  for (uint hop = 0u; hop < MAX_HOPS; hop++) {
    visit(owner);
    uint reference = slot_reference(visited, slot) & 63u;
    if (kind == FOREIGN_CHAIN || error != ERROR_NONE) return reference;
    uint corner = at_end ? next_reference(visited, reference) : reference;
    mask64 stored = stored_corners(visited, mask_none());
    if (mask_test(stored, corner)) return mask_count(stored & mask_below(corner));
    uint onward = at_end ? corner : previous_reference(visited, reference);
    if (!mask_test(visited.foreign_refs, onward)) {
      error = ERROR_OWNER;
      return 0u;
    }
    uint entry = entry_position(visited, onward);
    owner = entry_owner(visited, entry);
    slot = entry_slot(visited, entry);
    if (error != ERROR_NONE) return 0u;
  }
  error = ERROR_HOPS;
  return 0u;
}

// Reads anchors and chains of `visited`: all for the opened meshlet itself, else those that its
// reference r needs. `wanted`: see find_stored.
void put_boundary(uint kind, uint r, uint wanted) {
  open_part(visited, 0u, visited.codes, disk_count);
  uint bits = stream_bits[0];
  uint p = anchor_position[0];
  uvec3 value =
      uvec3(load_bits(p, bits), load_bits(p + bits, bits), load_bits(p + 2u * bits, bits));
  mask64 stored = kind == OWN_BOUNDARY ? stored_corners(visited, mask_none()) : mask_none();
  open_positions(anchor_code(0u), 0u);
  for (uint i = 0u; i < anchor_count[0] && error == ERROR_NONE; i++) {
    uint v = loop_vertex[reference_rank[kind == OWN_BOUNDARY ? mask_lsb(stored) & 63u : r]];
    if (kind == OWN_BOUNDARY && visited.references == 0u) v = disk_first[i];
    stored = mask_clear_lsb(stored);
    if (i > 0u) {
      value.x += next_residual(0u);
      value.y += next_residual(0u);
      value.z += next_residual(0u);
    }
    if (kind == FOREIGN_CHAIN || (kind == FOREIGN_CORNER && i != wanted)) continue;
    values[v] = value.x & stream_mask[0];
    values[v + 64u] = value.y & stream_mask[0];
    values[v + 128u] = value.z & stream_mask[0];
    if (kind == FOREIGN_CORNER) return;
  }
  if (kind == FOREIGN_CORNER) return;
  open_positions(chain_code[0], chain_widths[0]);
  for (mask64 rest = visited.owned_refs; mask_any(rest) && error == ERROR_NONE;
       rest = mask_clear_lsb(rest)) {
    uint owned = mask_lsb(rest);
    if (kind == OWN_BOUNDARY || owned == wanted)
      put_chain(kind == OWN_BOUNDARY ? owned : r, kind == FOREIGN_CHAIN);
    else
      skip_residuals(0u, stored_length(visited, owned) - 1u, chain_code[0], chain_widths[0]);
    if (kind == FOREIGN_CHAIN && owned == wanted) return;
  }
}

// First foreign corners, then foreign chains, which are predicted from them, then the rest.
void put_boundaries(HEADER_IN h) {
  uint references = mask_any(h.foreign_refs) ? h.references : 0u;
  for (uint i = 0u; i <= 2u * references && error == ERROR_NONE; i++) {
    uint kind = i == 2u * references ? OWN_BOUNDARY
                : i < references     ? FOREIGN_CORNER
                                     : FOREIGN_CHAIN;
    uint r = i < references ? i : i - references;
    uint wanted = 0u;
    if (kind == OWN_BOUNDARY) {
      visited = h;
      r = 0u;
    } else {
      uint source = r;
      if (kind == FOREIGN_CORNER) {
        uint before = previous_reference(h, r);
        bool from_before = mask_test(h.foreign_refs, before);
        if (from_before &&
            (!mask_test(h.foreign_refs, r) || reference_owner[before] < reference_owner[r]))
          source = before;
      }
      if (!mask_test(h.foreign_refs, source)) continue;
      if (kind == FOREIGN_CHAIN && reference_length[r] < 2u) continue;
      wanted = find_stored(kind, r, source);
    }
    if (error == ERROR_NONE) put_boundary(kind, r, wanted);
  }
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
  open_lists(low_cursor, unary_count(0u, count, interior_code[0]));
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
  if (error == ERROR_NONE) put_boundaries(opened);
  if (error == ERROR_NONE) put_interior(boundary & ~known_vertices(opened));
}

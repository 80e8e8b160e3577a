// Positions only, for shaders short of registers and local memory. The steps are those of
// serial_decoder.glsl, but chains and interior go vertex by vertex instead of through lists. Other
// streams are skipped only if position data follow.
//
// Include after serial_epilogue.glsl; call load_streams(0u, 1u) on an open blob first. Results are
// those of decode_meshlet, except that errors in other streams go unnoticed.

uint low_cursor;   // bit position of the next residual's low bits
uvec3 low_widths;  // number of low bits of each coordinate
bool has_quotients;

// Skips n quotients, a word at a time.
void skip_quotients(uint n) {
  uint words = 0u;
  while (n > 0u) {
    uint ones = uint(bitCount(unary.window));
    if (n <= ones) {
      for (; n > 1u; n--) unary.window &= unary.window - 1u;
      unary.cursor = unary.base + uint(findLSB(unary.window)) + 1u;
      unary.window &= unary.window - 1u;
      return;
    }
    n -= ones;
    words = ones > 0u ? 0u : words + 1u;
    unary.base += 32u;
    if ((unary.base >> 5) >= blob_word_total || words > MAX_QUOTIENT / 32u) {
      error = ERROR_UNARY;
      return;
    }
    unary.window = load_word(unary.base >> 5);
  }
}

// Selects the code of the position residuals that begin at bit `low`.
void open_residuals(uint code, uint widths, uint low) {
  has_quotients = code != CODE_FIXED;
  low_widths = has_quotients ? uvec3(code)
                             : uvec3(width_field(widths), width_field(widths + WIDTH_BITS),
                                     width_field(widths + 2u * WIDTH_BITS));
  low_cursor = low;
}

uint next_residual(uint width) {
  uint residual = load_bits(low_cursor, width);
  low_cursor += width;
  if (has_quotients) residual |= next_quotient(unary) << width;
  return unzigzag(residual);
}

uvec3 position_of(uint v) { return uvec3(values[v], values[v + 64u], values[v + 128u]); }

void put_position(uint v, uvec3 prediction) {
  uint bits = stream_mask[0];
  values[v] = (prediction.x + next_residual(low_widths.x)) & bits;
  values[v + 64u] = (prediction.y + next_residual(low_widths.y)) & bits;
  values[v + 128u] = (prediction.z + next_residual(low_widths.z)) & bits;
}

// The inner vertices of reference r. A foreign chain runs backwards, in its owner's direction.
void put_chain(uint r, bool backwards) {
  uint n = reference_length[r];
  uint rank = reference_rank[r];
  uvec3 start = position_of(loop_vertex[rank]);
  uvec3 end = position_of(reference_end[r]);
  uvec3 a = backwards ? end : start;
  uvec3 b = backwards ? start : end;
  bool copies = stream_predictor[0] == PREDICT_COPY;
  for (uint i = 1u; i < n && error == ERROR_NONE; i++) {
    uvec3 point =
        copies ? a : uvec3(chord(a.x, b.x, i, n), chord(a.y, b.y, i, n), chord(a.z, b.z, i, n));
    put_position(loop_vertex[rank + (backwards ? n - i : i)], point);
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
    open_residuals(chain_code[0], chain_widths[0],
                   chain_low[0] + first * low_bits(0u, chain_code[0], chain_widths[0]));
    unary = seek_unary(chain_unary);
    if (has_quotients) skip_quotients(3u * first);
    put_chain(r, true);
  }
}

// Leaves the unary reader behind section F.
void put_own_chains(HEADER_IN h) {
  unary = seek_unary(chain_unary);
  if (chain_total == 0u) return;
  open_residuals(chain_code[0], chain_widths[0], chain_low[0]);
  for (mask64 rest = h.owned_refs; mask_any(rest); rest = mask_clear_lsb(rest))
    put_chain(mask_lsb(rest), false);
  uint others = 0u;
  for (uint s = 1u; s < stream_total; s++)
    if (chain_code[s] != CODE_FIXED) others += chain_total * stream_elements[s];
  if (error == ERROR_NONE) skip_quotients(others);
}

void put_traversed(uint v, uint a, uint b, uint o) {
  bool across = o != NO_VERTEX;
  uvec3 at_a = position_of(a);
  uvec3 at_b = position_of(b);
  uvec3 beyond = across ? position_of(o) : uvec3(0u);
  uvec3 prediction;
  for (uint c = 0u; c < 3u; c++)
    prediction[c] = traversed_prediction(stream_predictor[0], at_a[c], at_b[c], beyond[c], across);
  put_position(v, prediction);
}

// `waiting`: boundary vertices that get their values in the traversal.
void put_interior(mask64 waiting) {
  uint count = mask_count(symbol_c) + mask_count(waiting);
  uint low = unary.cursor;
  uint end = low;
  for (uint s = 0u; s < stream_total; s++)
    end += (count + seam_vertices(s)) * low_bits(s, interior_code[s], interior_widths[s]);
  unary = seek_unary(end);
  open_residuals(interior_code[0], interior_widths[0], low);
  for (uint t = 0u; t < triangle_count && error == ERROR_NONE; t++) {
    uint triangle = triangles[t];
    uint a = triangle & 255u;
    uint b = (triangle >> 8) & 255u;
    uint v = (triangle >> 16) & 255u;
    if (mask_test(disk_starts, t) && mask_test(waiting, a)) {
      put_traversed(a, b, b, b);
      waiting = waiting & ~mask_bit(a);
    }
    if (mask_test(symbol_c, t) || mask_test(waiting, v)) put_traversed(v, a, b, triangle >> 24);
    waiting = waiting & ~mask_bit(v);
  }
  if (mask_any(waiting) || max(unary.cursor, low_cursor) > 8u * (byte_length - 8u))
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
  find_sections(opened, disk_count);
  if (error != ERROR_NONE) return;
  read_own_anchors(opened);
  put_own_chains(opened);
  if (error == ERROR_NONE) put_interior(boundary & ~known_vertices(opened));
}

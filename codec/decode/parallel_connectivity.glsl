// Parallel connectivity: the triangles of a meshlet from its CLERS symbols with one thread per
// triangle and O(1) steps per thread (spec, appendix A.6). Written once for C++17 and GLSL, like
// serial_decoder.glsl, whose masks it uses.
//
// Threads 0 .. 63 run parallel_step_0 .. 7 with their number t, with a barrier between steps. In a
// smaller workgroup, a thread runs several numbers; C++ runs them one after another. Besides the
// masks the includer provides:
//   SHARED                          storage class of variables shared by all threads
//   OR_MASK(target, mask)           target |= mask, atomically
//   ADD(target, value)              target += value, atomically
//   TRIANGLES                       the packed triangles: 64 shared words
//   symbol_r, symbol_e, symbol_c, symbol_s, triangle_count, and uint error
// Optional: PARALLEL_ROOM(n), the size of an array for n; less if no thread ever runs a step.
//
// Results: TRIANGLES as decode_triangles writes them, closing_ends, and interior_ids.
//
// The outline of a disk, walked from the root gate's b to its a, is a string of `m` (push a vertex)
// and `c` (pop one: it is interior). Levels of the S-E nesting find the E that ends each subtree,
// numbers of earlier pushes find the place of a triangle's subtree in the outline, and parenthesis
// depths find the vertex at a place.
//
// needs: SHARED, OR_MASK, ADD, TRIANGLES, decoders/serial.glsl
// optional: PARALLEL_ROOM

#ifndef PARALLEL_ROOM
#define PARALLEL_ROOM(n) (n)
#endif
#define LEVELS 66u  // S-E levels and outline depths: at most 64 each, and one guard at both ends

SHARED mask64 level_ends[PARALLEL_ROOM(LEVELS)];  // per S-E level: the E's that lead to it
SHARED uint left_pushes[PARALLEL_ROOM(64u)];      // per E: C's and L's that it resolves
SHARED mask64 closing_ends;                       // the E's that end a disk
SHARED mask64 pops[2];                            // outline places of the c's
SHARED mask64 interior_ids;                       // the vertices that they pop
SHARED uint
    split_before[PARALLEL_ROOM(65u)];  // per triangle: the S whose left subtree it begins, or 64
// Per parenthesis depth: outline places of the m's, 0 .. 63 and 64 .. 127.
SHARED mask64 depth_pushes_low[PARALLEL_ROOM(LEVELS)];
SHARED mask64 depth_pushes_high[PARALLEL_ROOM(LEVELS)];

uint disks_of_symbols() { return mask_count(symbol_e) - mask_count(symbol_s); }

// S-E level before triangle t. The roots of the disks count as pending splits.
uint level_before(uint t) {
  return disks_of_symbols() + mask_count(symbol_s & mask_below(t)) -
         mask_count(symbol_e & mask_below(t));
}

// The E that ends the subtree of t at the given level. Returns 64 and sets `error` if there is
// none.
uint subtree_end(uint t, uint level) {
  uint end = level > 0u && level < LEVELS ? mask_lsb(level_ends[level - 1u] & ~mask_below(t)) : 64u;
  if (end == 64u) error = ERROR_CLERS;
  return end;
}

// First outline place of the subtree of t.
uint outline_start(uint t) {
  uint ends = mask_count(symbol_e & mask_below(t));
  return mask_count(symbol_r & mask_below(t)) + 2u * ends + left_pushes[ends & 63u] +
         mask_count(closing_ends & mask_below(t));
}

uint pops_up_to(uint place) {
  return mask_count(pops[0] & mask_below(place + 1u)) +
         (place >= 64u ? mask_count(pops[1] & mask_below(place - 63u)) : 0u);
}

uint outline_depth(uint place) { return place - 2u * pops_up_to(place); }

// The vertex at an outline place: the last one pushed at its depth.
uint outline_vertex(uint place) {
  uint depth = outline_depth(place);
  if (place > 127u || depth >= LEVELS) {
    error = ERROR_CLERS;
    return 0u;
  }
  mask64 high = place >= 64u ? depth_pushes_high[depth] & mask_below(place - 63u) : mask_none();
  mask64 low = depth_pushes_low[depth] & mask_below(place + 1u);
  if (!mask_any(high) && !mask_any(low)) {
    error = ERROR_CLERS;
    return 0u;
  }
  uint pushed = mask_any(high) ? 64u + mask_msb(high) : mask_msb(low);
  return pushed - pops_up_to(pushed);
}

void parallel_step_0(uint t) {
  for (uint i = t; i < LEVELS; i += 64u) {
    level_ends[i] = mask_none();
    depth_pushes_low[i] = mask_none();
    depth_pushes_high[i] = mask_none();
  }
  left_pushes[t] = 0u;
  split_before[t] = 64u;
  if (t == 0u) {
    closing_ends = mask_none();
    interior_ids = mask_none();
    pops[0] = mask_none();
    pops[1] = mask_none();
  }
}

void parallel_step_1(uint t) {
  if (t >= triangle_count || !mask_test(symbol_e, t)) return;
  uint level = level_before(t + 1u);
  if (level >= LEVELS)
    error = ERROR_CLERS;
  else
    OR_MASK(level_ends[level], mask_bit(t));
}

void parallel_step_2(uint t) {
  if (t >= triangle_count || error != ERROR_NONE) return;
  uint level = level_before(t);
  uint end = subtree_end(t, level);
  if (end == 64u) return;
  if (!mask_test(symbol_r | symbol_e | symbol_s, t))
    ADD(left_pushes[mask_count(symbol_e & mask_below(end))], 1u);
  bool closes = mask_test(symbol_e, t) && level - 1u < disks_of_symbols() &&
                mask_lsb(level_ends[level - 1u]) == t;
  if (closes) OR_MASK(closing_ends, mask_bit(t));
}

// Turns left_pushes into its exclusive prefix sum. One thread suffices for the few E's; a workgroup
// with a scan may use that instead.
void parallel_step_3(uint t) {
  if (t != 0u || error != ERROR_NONE) return;
  uint sum = 0u;
  for (uint i = 0u; i < 64u; i++) {
    uint count = left_pushes[i];
    left_pushes[i] = sum;
    sum += count;
  }
}

void parallel_step_4(uint t) {
  if (t >= triangle_count || error != ERROR_NONE || !mask_test(symbol_c, t)) return;
  uint place = outline_start(t) + subtree_end(t, level_before(t)) - t + 2u;
  if (place > 127u)
    error = ERROR_CLERS;
  else
    OR_MASK(pops[place >> 6], mask_bit(place & 63u));
}

void parallel_step_5(uint t) {
  uint length = triangle_count + 2u * disks_of_symbols();
  if (error != ERROR_NONE) return;
  if (length > 128u) {
    error = ERROR_CLERS;
    return;
  }
  for (uint place = t; place < length; place += 64u) {
    if (mask_test(pops[place >> 6], place & 63u)) continue;
    uint depth = outline_depth(place);
    if (depth >= LEVELS) {
      error = ERROR_CLERS;
      return;
    }
    if (place < 64u)
      OR_MASK(depth_pushes_low[depth], mask_bit(place));
    else
      OR_MASK(depth_pushes_high[depth], mask_bit(place - 64u));
  }
}

// Triangle t without the vertex across its gate.
void parallel_step_6(uint t) {
  if (t >= triangle_count || error != ERROR_NONE) return;
  uint level = level_before(t);
  uint start = outline_start(t);
  uint end = start + subtree_end(t, level) - t + 2u;
  uint middle = end - 1u;
  if (mask_test(symbol_r | symbol_e, t)) {
    middle = start + 1u;
  } else if (mask_test(symbol_s, t)) {
    uint split_end = subtree_end(t + 1u, level + 1u);
    middle = start + split_end - t + 1u;
    split_before[min(split_end + 1u, 64u)] = t;
  }
  uint a = outline_vertex(end);
  uint b = outline_vertex(start);
  uint v = outline_vertex(middle);
  if (max(max(a, b), v) > 63u) error = ERROR_VERTICES;
  if (a == b || b == v || v == a) error = ERROR_CLERS;
  if (error != ERROR_NONE) return;
  TRIANGLES[t] = a | b << 8 | v << 16;
  if (mask_test(symbol_c, t)) OR_MASK(interior_ids, mask_bit(v));
}

// The vertex across the gate: from the triangle before, or the S whose left subtree begins here.
void parallel_step_7(uint t) {
  if (t >= triangle_count || error != ERROR_NONE) return;
  uint across = NO_VERTEX;
  uint split = split_before[t];
  if (split < 64u)
    across = TRIANGLES[split] >> 8;
  else if (t > 0u && !mask_test(closing_ends, t - 1u))
    across = TRIANGLES[t - 1u] >> (mask_test(symbol_r, t - 1u) ? 8 : 0);
  TRIANGLES[t] = (TRIANGLES[t] & 0x00FFFFFFu) | across << 24;
}

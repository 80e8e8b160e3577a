// The team decoder: TEAM threads decode the values of one meshlet (spec, appendix A.7), a workgroup
// decodes GROUP / TEAM meshlets. Each value's bits are found by one thread alone. Only the
// traversal of the interior is sequential: one thread per element walks it. The triangles come from
// the serial decoder of another shader or from parallel_connectivity.glsl.
//
// The includer defines TEAM, includes team_size.glsl first, then serial_prologue.glsl,
// serial_decoder.glsl and serial_epilogue.glsl, runs workgroups of GROUP threads, and provides
//   packed_triangle(t)       triangle t of the team's meshlet, packed as in serial_decoder.glsl
//   connectivity_boundary()  mask of its boundary vertices
//   connectivity_starts()    mask of the triangles that begin a disk
// It calls open_blob and group_streams(end) once, open_team(m), read_header(m), read_symbols, and
// then team_decode with all threads. Results: team_values[TEAM_INDEX][element * 64 + local id],
// vertex_count, and `error`, equal for all threads of a team.
//
// Long functions are called from one place: compilers inline everything, and the code must fit the
// instruction cache. Hostile bytes: every subscript is masked or bounded by a checked count, every
// loop by 64, by the streams, or by the blob's end. Loops that contain barriers run equally often
// in all teams.

#include "decoders/sections.glsl"
#define TEAM_INDEX (THREAD / TEAM)
#define MEMBER (THREAD % TEAM)

shared uint team_values[TEAMS][MAX_ELEMENTS * 64u];
shared uint team_error[TEAMS];
shared uint team_traversal[TEAMS][64];   // packed triangles that introduce a vertex
shared uint team_references[TEAMS][64];  // rank in the loop order | length << 8
shared uint team_loop[TEAMS][16];        // boundary ids in loop order, four to a word
shared uint team_begins[TEAMS][17];      // first local id of each disk and the end, four to a word
shared mask64 team_ranks[TEAMS];         // ranks at which references start
shared mask64 team_waiting[TEAMS];       // inner vertices of private references
// Inner vertices of a stream's seams: id | reference << 8 | place << 16.
shared uint team_seams[TEAMS][64];
shared uint team_codes[TEAMS][MAX_STREAMS];  // bit positions of the interior's codes
shared uint team_low[TEAMS];                 // bit position of section G

// The ends of the quotients lie in the team's scratch memory.
uint ones_place() { return TEAMS * STAGE_WORDS + TEAM_INDEX * SCRATCH_WORDS; }

uint loop_id(uint rank) {
  return bitfieldExtract(team_loop[TEAM_INDEX][(rank >> 2) & 15u], int(rank & 3u) * 8, 6);
}
uint disk_begin(uint disk) {
  return bitfieldExtract(team_begins[TEAM_INDEX][min(disk, 64u) >> 2], int(disk & 3u) * 8, 7);
}
uint first_id(uint r) { return loop_id(team_references[TEAM_INDEX][r & 63u]); }
uint reference_length_of(uint r) { return team_references[TEAM_INDEX][r & 63u] >> 8; }

// --- disks ---

mask64 team_boundary;
uint team_disks;

void find_disks() {
  mask64 starts = connectivity_starts();
  team_boundary = connectivity_boundary();
  team_disks = mask_count(starts);
  vertex_count = pushed_vertices(mask_below(triangle_count)) + team_disks;
  if (vertex_count > 64u || team_disks == 0u) {
    error = ERROR_VERTICES;
    vertex_count = min(vertex_count, 64u);
  }
  for (uint t = MEMBER; t <= triangle_count; t += TEAM) {
    if (t < triangle_count && !mask_test(starts, t)) continue;
    mask64 before = mask_below(t);
    uint disk = mask_count(starts & before);
    uint ids = pushed_vertices(before) + disk;
    if (t == triangle_count) ids = vertex_count;
    atomicOr(team_begins[TEAM_INDEX][disk >> 2], min(ids, 64u) << 8u * (disk & 3u));
  }
  for (uint id = MEMBER; id < vertex_count; id += TEAM) {
    if (!mask_test(team_boundary, id)) continue;
    uint rank = mask_count(team_boundary & mask_below(id));
    atomicOr(team_loop[TEAM_INDEX][rank >> 2], id << 8u * (rank & 3u));
  }
}

// First rank of loop k, and the rank after its last.
uvec2 loop_ranks(uint k) {
  return uvec2(mask_count(team_boundary & mask_below(disk_begin(k))),
               mask_count(team_boundary & mask_below(disk_begin(k + 1u))));
}

// --- staging ---

// The first slot of a team's stage holds the data of its meshlet, the others those of the owners of
// its first foreign references. Dependent reads then cost the latency of shared memory.
void use_stage(uint slot, uint first) {
  stage_first = first;
  stage_place = slot == 0u
                    ? TEAM_INDEX * STAGE_WORDS
                    : TEAMS * STAGE_WORDS + TEAM_INDEX * SCRATCH_WORDS + (slot - 1u) * STAGE_WORDS;
}

uint stage_slot(HEADER_IN h, uint r) { return 1u + mask_count(h.foreign_refs & mask_below(r)); }

// First word of a meshlet's data; any word if the directory is malformed, which read_header
// reports.
uint first_word(uint m) {
  uint group = group_table + BLOB_GROUP_WORDS * (m >> 5);
  uint offset = (load_memory(directory + m) & OFFSET_MASK)
                << ((load_memory(group + 1u) >> 16) & 15u);
  return (data_offset + load_memory(group) + offset) >> 2;
}

// Copies the data of the team's own meshlet. A barrier must follow.
void stage_own(uint m) {
  uint first = first_word(m);
  use_stage(0u, first);
  for (uint i = MEMBER; i < STAGE_WORDS; i += TEAM)
    staged[stage_place + i] = load_memory(first + i);
}

// Copies the owners' data. A barrier must follow.
void stage_owners(HEADER_IN h) {
  uint slots = min(mask_count(h.foreign_refs), STAGE_OWNERS);
  mask64 rest = h.foreign_refs;
  for (uint slot = 1u; slot <= slots; slot++) {
    uint first = first_word(owner_of(h, mask_lsb(rest)));
    uint place = TEAMS * STAGE_WORDS + TEAM_INDEX * SCRATCH_WORDS + (slot - 1u) * STAGE_WORDS;
    for (uint i = MEMBER; i < STAGE_WORDS; i += TEAM) staged[place + i] = load_memory(first + i);
    rest = mask_clear_lsb(rest);
  }
}

// --- references, corners, chains ---

#define ITEM_REFERENCE 0u
#define ITEM_CORNER 1u
#define ITEM_SELF 2u  // finds section G

void write_anchor(uint s, uint p, uint index, uint id) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint bits = stream_field(s, STREAM_BITS);
  uint width = index > 0u ? width_field(p + n * bits) : 0u;
  uint deltas = p + n * bits + WIDTH_BITS + (index - 1u) * n * width;
  for (uint c = 0u; c < n; c++) {
    uint value = load_bits(p + c * bits, bits);
    if (index > 0u) value += unzigzag(load_bits(deltas + c * width, width));
    team_values[TEAM_INDEX][value_element(s, c) + id] = value & bits_mask(s);
  }
}

// Writes the residuals of the inner vertices of reference r for stream s in place of their values.
// `low`, `quotients`: bit positions of the first low bits and quotient.
void write_chain_residuals(uint s, uint r, bool backwards, uint code, uint widths, uint low,
                           uint quotients) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint length = reference_length_of(r);
  uint rank = team_references[TEAM_INDEX][r & 63u] & 63u;
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
    if (rice) residual |= next_quotient(unary) << width;
    low += width;
    team_values[TEAM_INDEX][value_element(s, c) + id] = unzigzag(residual);
    c++;
  }
  if (max(low, rice ? unary.cursor : 0u) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

// Reads an item's part of sections C to F of meshlet h: anchor `index` of streams [begin, end), or
// the residuals of the chain that is `reference` of its owner.
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
  uint p = h.codes;
  for (uint s = 0u; s < stream_total; s++) {
    uint n = stream_field(s, STREAM_ELEMENTS);
    if (chains) code_at(p, n, stream_field(s, STREAM_CHAIN_BASE));
    if (kind == ITEM_SELF) team_codes[TEAM_INDEX][s] = p;
    code_at(p, n, stream_field(s, STREAM_INTERIOR_BASE));
  }
  uint count = team_disks;  // anchors, if h, then the team's own meshlet, has no references
  for (uint s = 0u; s < stream_total; s++) {
    uint n = stream_field(s, STREAM_ELEMENTS);
    if (h.references > 0u && (s == 0u || (h.flags & FLAG_SEAMS) != 0u))
      count = mask_count(stored_corners(h, seam_references(h, s)));
    if (kind == ITEM_CORNER && s >= begin && s < end)
      write_anchor(s, p, index, own.references == 0u ? disk_begin(j) & 63u : first_id(j));
    if (count > 0u) p += n * stream_field(s, STREAM_BITS);
    if (count > 1u) p += WIDTH_BITS + (count - 1u) * n * width_field(p);
  }
  if (kind == ITEM_CORNER || !chains) {
    if (kind == ITEM_SELF) team_low[TEAM_INDEX] = p;
    return;
  }
  uint codes = h.codes;
  uint low = p;
  uint quotients = p;
  // Two passes: the quotients begin after the low bits of all streams.
  for (uint pass = 0u; pass < 2u; pass++) {
    codes = h.codes;
    uint skipped = 0u;
    for (uint s = 0u; s < stream_total; s++) {
      uint n = stream_field(s, STREAM_ELEMENTS);
      uint code = code_at(codes, n, stream_field(s, STREAM_CHAIN_BASE));
      uint widths = codes - WIDTH_BITS * n;
      uint width = low_width(code, n, widths);
      code_at(codes, n, stream_field(s, STREAM_INTERIOR_BASE));
      if (pass == 0u) {
        quotients += total * width;
        continue;
      }
      uint rice = code == CODE_FIXED ? 0u : n;
      bool wanted = kind == ITEM_REFERENCE && s < stream_end &&
                    !mask_test(own.foreign_refs & seam_references(own, s), j);
      if (wanted) {
        quotients = after_ones(quotients, skipped + first * rice);
        skipped = 0u;
        write_chain_residuals(s, j, mask_test(own.foreign_refs, j), code, widths,
                              low + first * width, quotients);
        skipped = total * rice - first * rice;
      } else {
        skipped += total * rice;
      }
      low += total * width;
    }
    if (pass == 1u && kind == ITEM_SELF) team_low[TEAM_INDEX] = after_ones(quotients, skipped);
  }
}

// One item: the length of reference j (measuring), the residuals of reference j, the value of
// corner j, or the team's own meshlet. They share this code because all follow references.
void read_boundary_item(HEADER_IN own, bool measuring, uint kind, uint j) {
  if (kind == ITEM_REFERENCE && !measuring &&
      (mask_test(own.private_refs, j) || reference_length_of(j) < 2u))
    return;
  uint own_first = stage_first;
  for (uint s = 0u; s < stream_end;) {
    Header h = own;
    uint corner = j;
    uint index = j;
    bool apart = (own.flags & FLAG_SEAMS) != 0u;
    bool found = kind == ITEM_SELF || (kind == ITEM_CORNER && own.references == 0u);
    use_stage(0u, own_first);
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
      uint owner = entry_owner(h, entry);
      if (hop == MAX_HOPS) error = ERROR_HOPS;
      uint stage = hop == 0u ? stage_slot(h, r) : STAGE_OWNERS + 1u;
      use_stage(min(stage, STAGE_OWNERS), stage <= STAGE_OWNERS ? first_word(owner) : 0x80000000u);
      h = read_header(owner);
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
      team_references[TEAM_INDEX][j] = min(length, 64u) << 8;
    } else if (error == ERROR_NONE) {
      read_sections(own, h, kind, j, corner, index, s, next);
    }
    s = error == ERROR_NONE ? next : stream_end;
  }
  use_stage(0u, own_first);
}

// Adds the chords to the residuals of the inner vertices of owned and foreign references.
void predict_chains(HEADER_IN h) {
  uint ends = h.references > 0u ? mask_count(team_boundary) : 0u;
  for (uint place = MEMBER; place < ends; place += TEAM) {
    uint r = (mask_count(team_ranks[TEAM_INDEX] & mask_below(place + 1u)) - 1u) & 63u;
    uint length = reference_length_of(r);
    uint i = place - (team_references[TEAM_INDEX][r] & 63u);
    if (i == 0u || i >= length || mask_test(h.private_refs, r)) continue;
    bool foreign = mask_test(h.foreign_refs, r);
    uint rank = team_references[TEAM_INDEX][r] & 63u;
    uint id = loop_id(rank + i);
    uint from = loop_id(rank);
    uint to = first_id(next_reference(h, r));
    for (uint s = 0u; s < stream_end; s++) {
      if (foreign && mask_test(seam_references(h, s), r)) continue;
      uint n = stream_field(s, STREAM_ELEMENTS);
      bool copies = stream_field(s, STREAM_PREDICTOR) == PREDICT_COPY;
      for (uint c = 0u; c < n; c++) {
        uint element = value_element(s, c);
        uint a = team_values[TEAM_INDEX][element + (foreign ? to : from)];
        uint b = team_values[TEAM_INDEX][element + (foreign ? from : to)];
        uint point = copies ? a : chord_point(a, b, foreign ? length - i : i, length);
        team_values[TEAM_INDEX][element + id] =
            (point + team_values[TEAM_INDEX][element + id]) & bits_mask(s);
      }
    }
  }
}

// Computes the ranks of the references from their lengths, and collects the inner vertices of
// private ones, which wait for the traversal.
void place_team_references(HEADER_IN h) {
  if (h.references > 0u && mask_count(h.loop_ends) != team_disks) error = ERROR_REFERENCES;
  for (uint r = MEMBER; r < h.references; r += TEAM) {
    uint rank = 0u;
    for (uint before = 0u; before < r; before++) rank += team_references[TEAM_INDEX][before] >> 8;
    uint length = reference_length_of(r);
    uvec2 ranks = loop_ranks(mask_count(h.loop_ends & mask_below(r)));
    if (r == loop_begin(h, r) && rank != ranks.x) error = ERROR_REFERENCES;
    if (mask_test(h.loop_ends, r) ? rank + length != ranks.y : rank + length > ranks.y)
      error = ERROR_REFERENCES;
    atomicOr(team_references[TEAM_INDEX][r], rank & 63u);
    mask64 start = mask_bit(rank & 63u);
    atomicOr(team_ranks[TEAM_INDEX].x, start.x);
    atomicOr(team_ranks[TEAM_INDEX].y, start.y);
    if (!mask_test(h.private_refs, r)) continue;
    for (uint i = 1u; i < length; i++) {
      mask64 id = mask_bit(loop_id(rank + i));
      atomicOr(team_waiting[TEAM_INDEX].x, id.x);
      atomicOr(team_waiting[TEAM_INDEX].y, id.y);
    }
  }
  if (h.references == 0u && MEMBER == 0u) {
    mask64 firsts = mask_none();
    for (uint i = 0u; i < team_disks; i++) firsts = firsts | mask_bit(disk_begin(i) & 63u);
    team_waiting[TEAM_INDEX] = team_boundary & ~firsts;
  }
}

// --- interior ---

// Lists the triangles that introduce a vertex, in order (spec, A.7, "Traversed vertices").
void list_traversal() {
  mask64 waiting = team_waiting[TEAM_INDEX];
  mask64 starts = connectivity_starts();
  mask64 roots = mask_none();  // root triangles whose gate introduces its a
  mask64 introducing = symbol_c;
  if (mask_any(waiting)) {
    for (mask64 rest = starts; mask_any(rest); rest = mask_clear_lsb(rest)) {
      uint t = mask_lsb(rest);
      uint a = packed_triangle(t) & 63u;
      if (!mask_test(waiting, a)) continue;
      roots = roots | mask_bit(t);
      waiting = waiting & ~mask_bit(a);
    }
    // Every other waiting vertex first occurs as the apex of a triangle that is not C.
    for (uint t = 0u; t < triangle_count && mask_any(waiting); t++) {
      uint v = (packed_triangle(t) >> 16) & 63u;
      if (!mask_test(waiting, v)) continue;
      introducing = introducing | mask_bit(t);
      waiting = waiting & ~mask_bit(v);
    }
    if (mask_any(waiting)) error = ERROR_CLERS;
  }
  traversed_count = mask_count(introducing) + mask_count(roots);
  if (traversed_count > 64u) {
    error = ERROR_CLERS;
    traversed_count = 0u;
  }
  for (uint t = MEMBER; t < triangle_count; t += TEAM) {
    if (!mask_test(introducing | roots, t)) continue;
    uint place = mask_count(introducing & mask_below(t)) + mask_count(roots & mask_below(t));
    uint triangle = packed_triangle(t);
    if (mask_test(roots, t)) {
      uint b = (triangle >> 8) & 255u;
      team_traversal[TEAM_INDEX][place & 63u] = pack4(b, b, triangle & 255u, b);
      place++;
    }
    if (mask_test(introducing, t)) team_traversal[TEAM_INDEX][place & 63u] = triangle;
  }
}

// Lists the inner vertices of the seams of stream s in reference order; returns their number.
uint list_seams(HEADER_IN h, uint s) {
  uint count = 0u;
  for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    uint length = reference_length_of(r);
    uint rank = team_references[TEAM_INDEX][r] & 63u;
    for (uint i = 1u + MEMBER; i < length; i += TEAM)
      team_seams[TEAM_INDEX][(count + i - 1u) & 63u] = loop_id(rank + i) | r << 8 | i << 16;
    count += length - 1u;
  }
  return min(count, 64u);
}

// Lists the positions of n ones from bit p. Each thread takes every TEAM-th word. A barrier must
// follow.
void list_ones(uint p, uint n) {
  uint found = 0u;  // ones before the team's current words
  uint empty = 0u;  // zero words in a row
  for (uint w = p >> 5; found < n; w += TEAM) {
    uint mine = 0u;
    uint before = found;
    for (uint k = 0u; k < TEAM; k++) {
      uint word = load_word(w + k);
      if (w + k == p >> 5) word &= ~word_below(p & 31u);
      if (k == MEMBER) {
        mine = word;
        before = found;
      }
      empty = word == 0u ? empty + 1u : 0u;
      found += uint(bitCount(word));
    }
    if (w >= blob_word_total || empty > (MAX_QUOTIENT >> 5) + TEAM) {
      error = ERROR_UNARY;
      return;
    }
    for (; mine != 0u && before < n; before++) {
      staged[ones_place() + before] = ((w + MEMBER) << 5) + uint(findLSB(mine));
      mine &= mine - 1u;
    }
  }
}

// Writes `count` residuals of stream s in place of values: the seams', then those of the traversed
// vertices. ones: index of the stream's first quotient in the list; begin: bit position of the
// first stream's quotients.
void read_interior_residuals(uint s, uint code, uint widths, uint low, uint seams, uint count,
                             uint ones, uint begin) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint step = low_width(code, n, widths);
  for (uint item = MEMBER; item < count; item += TEAM) {
    uint i = n == 3u ? (item * 171u) >> 9 : n == 2u ? item >> 1 : item / n;
    uint c = item - i * n;
    uint id = (i < seams ? team_seams[TEAM_INDEX][i & 63u]
                         : team_traversal[TEAM_INDEX][(i - seams) & 63u] >> 16) &
              63u;
    uint residual;
    if (code == CODE_FIXED) {
      residual = load_bits(low + i * step + low_width(code, c, widths),
                           width_field(widths + WIDTH_BITS * c));
    } else {
      uint quotient = staged[ones_place() + ones + item] -
                      (ones + item == 0u ? begin : staged[ones_place() + ones + item - 1u] + 1u);
      if (quotient > MAX_QUOTIENT) error = ERROR_UNARY;
      residual = load_bits(low + item * code, code) | quotient << code;
    }
    team_values[TEAM_INDEX][value_element(s, c) + id] = unzigzag(residual);
  }
}

// Adds the chord to the residuals of the seams.
void predict_seams(HEADER_IN h, uint s, uint seams) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  bool copies = stream_field(s, STREAM_PREDICTOR) == PREDICT_COPY;
  for (uint item = MEMBER; item < seams; item += TEAM) {
    uint seam = team_seams[TEAM_INDEX][item];
    uint r = (seam >> 8) & 63u;
    uint from = first_id(r);
    uint to = first_id(next_reference(h, r));
    for (uint c = 0u; c < n; c++) {
      uint element = value_element(s, c);
      uint a = team_values[TEAM_INDEX][element + from];
      uint point = copies ? a
                          : chord_point(a, team_values[TEAM_INDEX][element + to], seam >> 16,
                                        max(reference_length_of(r), 1u));
      uint v = element + (seam & 63u);
      team_values[TEAM_INDEX][v] = (point + team_values[TEAM_INDEX][v]) & bits_mask(s);
    }
  }
}

// Adds the predictions to the residuals of the traversed vertices, for one element. The predictors
// are (u (a + w b) + x o + y) >> z with constants of the stream; without a triangle across the
// gate, u = 1 and x = y = 0.
void predict_element(uint s, uint c) {
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  uint bits = bits_mask(s);
  uint element = value_element(s, c);
  bool copies = predictor == PREDICT_COPY;
  bool damped = predictor == PREDICT_DAMPED;
  bool uses_o = predictor == PREDICT_PARALLELOGRAM || damped;
  uint factor = damped ? 3u : 1u;
  uint factor_o = damped ? 0u - 2u : 0u - 1u;
  uint rounding = damped ? 2u : 0u;
  int shift = damped ? 2 : 0;
  int shift_mean = copies ? 0 : 1;
  for (uint i = 0u; i < traversed_count; i++) {
    uint triangle = team_traversal[TEAM_INDEX][i];
    uint v = element + bitfieldExtract(triangle, 16, 6);
    uint a = team_values[TEAM_INDEX][element + (triangle & 63u)];
    uint b = team_values[TEAM_INDEX][element + bitfieldExtract(triangle, 8, 6)];
    uint o = team_values[TEAM_INDEX][element + bitfieldExtract(triangle, 24, 6)];
    uint sum = copies ? a : a + b;
    bool across = uses_o && triangle < NO_VERTEX << 24;
    uint point = across ? factor * sum + factor_o * o + rounding : sum;
    point = uint(int(point) >> (across ? shift : shift_mean));
    team_values[TEAM_INDEX][v] = (point + team_values[TEAM_INDEX][v]) & bits;
  }
}

// The decoded stream that an element of the values belongs to, and the element's number in it.
uvec2 stream_of_element(uint element) {
  uint s = 0u;
  for (uint next = 1u; next < stream_end; next++)
    if (element >= stream_field(next, STREAM_ELEMENT)) s = next;
  return uvec2(s, element - stream_field(s, STREAM_ELEMENT));
}

// Sections G and H. A team that is not `sound` only takes part in the barriers.
void decode_team_interior(HEADER_IN h, bool sound) {
  uint low = team_low[TEAM_INDEX];
  uint begin = low;  // of section H
  uint ones = 0u;    // quotients of the streams that are decoded
  for (uint s = 0u; s < stream_total && sound; s++) {
    uint n = stream_field(s, STREAM_ELEMENTS);
    uint count = traversed_count;
    for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest))
      count += reference_length_of(mask_lsb(rest)) - 1u;
    uint p = team_codes[TEAM_INDEX][s];
    uint code = code_at(p, n, stream_field(s, STREAM_INTERIOR_BASE));
    begin += count * low_width(code, n, p - WIDTH_BITS * n);
    if (code != CODE_FIXED && s < stream_end) ones += count * n;
  }
  if (ones > MAX_ELEMENTS * 64u) error = ERROR_VERTICES;
  ones = min(ones, MAX_ELEMENTS * 64u);
  barrier();  // the list of ones overwrites the owners' data
  if (sound) list_ones(begin, ones);
  uint listed = ones;
  ones = 0u;
  for (uint s = 0u; s < stream_end; s++) {
    uint n = stream_field(s, STREAM_ELEMENTS);
    uint p = team_codes[TEAM_INDEX][s];
    uint code = code_at(p, n, stream_field(s, STREAM_INTERIOR_BASE));
    uint seams = sound ? list_seams(h, s) : 0u;
    uint count = sound && error == ERROR_NONE ? min(seams + traversed_count, 64u) * n : 0u;
    barrier();
    read_interior_residuals(s, code, p - WIDTH_BITS * n, low, seams, count,
                            min(ones, listed - min(count, listed)), begin);
    if (code != CODE_FIXED) ones += count;
    low += (seams + traversed_count) * low_width(code, n, p - WIDTH_BITS * n);
    barrier();
    predict_seams(h, s, seams);
    barrier();
  }
  if (sound && max(begin, low) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
  if (sound && listed > 0u && staged[ones_place() + listed - 1u] >= 8u * (byte_length - 8u))
    error = ERROR_UNARY;
  uint elements = stream_field(stream_end - 1u, STREAM_ELEMENT) +
                  stream_field(stream_end - 1u, STREAM_ELEMENTS);
  for (uint element = MEMBER; element < elements && sound; element += TEAM) {
    uvec2 of = stream_of_element(element);
    predict_element(of.x, of.y);
  }
}

// --- a whole meshlet ---

// Broadcasts any thread's error to its team. Contains a barrier.
bool agree() {
  if (error != ERROR_NONE) atomicMax(team_error[TEAM_INDEX], error);
  barrier();
  error = team_error[TEAM_INDEX];
  return error == ERROR_NONE;
}

// Call first, for meshlet m, before its header is read.
void open_team(uint m) {
  error = ERROR_NONE;
  stage_own(m);
  for (uint i = MEMBER; i < 17u; i += TEAM) {
    team_begins[TEAM_INDEX][i] = 0u;
    team_loop[TEAM_INDEX][i & 15u] = 0u;
  }
  if (MEMBER == 0u) {
    team_error[TEAM_INDEX] = ERROR_NONE;
    team_ranks[TEAM_INDEX] = mask_none();
    team_waiting[TEAM_INDEX] = mask_none();
  }
  barrier();
}

// Decodes the values of the meshlet with header h, whose symbols and triangles are known. sound:
// false if there is nothing to decode.
void team_decode(Header h, bool sound) {
  if (!sound) error = ERROR_OFFSET;
  if (agree()) {
    find_disks();
    stage_owners(h);
  }
  sound = agree();
  uint corners = h.references == 0u ? team_disks : h.references;
  for (uint pass = 0u; pass < 2u; pass++) {
    bool measuring = pass == 0u;
    uint items = measuring ? h.references : h.references + corners + 1u;
    for (uint item = MEMBER; item < items && sound; item += TEAM) {
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
  if (sound) predict_chains(h);
  sound = agree();
  decode_team_interior(h, sound);
  agree();
}

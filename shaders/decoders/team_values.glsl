// The team decoder: TEAM threads decode the values of one meshlet (spec, appendix A.7), a workgroup
// decodes GROUP / TEAM meshlets. Each value's bits are found by one thread alone; residuals go
// where the values belong. Then the values in their order: first stream 0, then the others, which
// may depend on it. Only two things are sequential: a chain of a reference, one thread per element,
// and the traversal of the interior, one thread per element. The triangles come from the serial
// decoder of another shader or from parallel_connectivity.glsl.
//
// The includer defines TEAM, includes team_size.glsl first, then serial_prologue.glsl,
// serial_decoder.glsl and serial_epilogue.glsl, runs workgroups of GROUP threads, and provides
//   packed_triangle(t)       triangle t of the team's meshlet, packed as in serial_decoder.glsl
//   connectivity_boundary()  mask of its boundary vertices
//   connectivity_starts()    mask of the triangles that begin a disk
// It calls open_blob and group_streams(end) once, open_team(m), read_header(m),
// read_team_symbols(h), and then team_decode with all threads. Results:
// team_values[TEAM_INDEX][element * 64 + local id], vertex_count, and `error`, equal for all
// threads of a team.
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
shared mask64 team_symbols[TEAMS][4];    // R, C, E, S
shared uint team_traversal[TEAMS][64];   // packed triangles that introduce a vertex
shared uint team_references[TEAMS][64];  // rank in the loop order | length << 8
shared uint team_loop[TEAMS][16];        // boundary ids in loop order, four to a word
shared uint team_begins[TEAMS][17];      // first local id of each disk and the end, four to a word
shared mask64 team_ranks[TEAMS];         // ranks at which references start
shared mask64 team_waiting[TEAMS];       // inner vertices of private references
// Inner vertices of a stream's seams: id | reference << 8 | place << 16. Later weights of AFFINE:
// by rank along the boundary, then by place in the traversal.
shared uint team_seams[TEAMS][64];
shared mask64 team_seam_refs[TEAMS][MAX_STREAMS];
shared uint team_codes[TEAMS][MAX_STREAMS];  // bit positions of the interior's codes
// Bit positions of the interior's unary parts and low bits: of stream 0, and of the others.
shared uint team_unary[TEAMS][2];
shared uint team_low[TEAMS][2];

// The ends of the quotients, later the vertices' sums of cross products, lie in the team's scratch
// memory.
uint ones_place() { return TEAMS * STAGE_WORDS + TEAM_INDEX * SCRATCH_WORDS; }

uint loop_id(uint rank) {
  return bitfieldExtract(team_loop[TEAM_INDEX][(rank >> 2) & 15u], int(rank & 3u) * 8, 6);
}
uint disk_begin(uint disk) {
  return bitfieldExtract(team_begins[TEAM_INDEX][min(disk, 64u) >> 2], int(disk & 3u) * 8, 7);
}
uint first_id(uint r) { return loop_id(team_references[TEAM_INDEX][r & 63u]); }
uint reference_length_of(uint r) { return team_references[TEAM_INDEX][r & 63u] >> 8; }

// Number of inner vertices of the seams of stream s.
uint seam_vertices_of(uint s) {
  uint count = 0u;
  for (mask64 rest = team_seam_refs[TEAM_INDEX][s]; mask_any(rest); rest = mask_clear_lsb(rest))
    count += reference_length_of(mask_lsb(rest)) - 1u;
  return count;
}

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

// First word of a meshlet's data; any word if the group table is malformed, which read_header
// reports.
uint first_word(uint m) { return meshlet_start(m) >> 2; }

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
#define ITEM_SELF 2u  // finds the interior's residuals

// Reads `items` values of stream s in the order of their vertices: an anchor's differences
// (id < 64; the value of the first anchor is in place), or the residuals of the inner vertices of
// reference r. `low`, `quotients`: bit positions of the first low bits and quotient.
void read_values(uint s, uint items, uint id, uint r, bool backwards, uint code, uint widths,
                 uint low, uint quotients) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint length = reference_length_of(r);
  uint rank = team_references[TEAM_INDEX][r & 63u] & 63u;
  bool sums = id < 64u;
  bool fixed_code = code == CODE_FIXED;
  if (!fixed_code) unary = seek_unary(quotients);
  uint c = n;
  uint i = 0u;
  for (uint item = items; item > 0u && error == ERROR_NONE; item--) {
    if (c == n) {
      c = 0u;
      i++;
      if (!sums) id = loop_id(rank + (backwards ? length - i : i));
    }
    uint place = value_element(s, c) + id;
    uint residual;
    if (fixed_code) {
      uint width = width_field(widths + WIDTH_BITS * c);
      residual = load_bits(low, width);
      low += width;
    } else {
      residual = coded_value(code, next_quotient(unary), low);
    }
    residual = unzigzag(residual);
    if (sums) residual = (residual + team_values[TEAM_INDEX][place]) & bits_mask(s);
    team_values[TEAM_INDEX][place] = residual;
    c++;
  }
  if (max(low, fixed_code ? 0u : unary.cursor) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

// Reads an item's part of meshlet h's sections: anchor `index` of streams [begin, end), the
// residuals of the chain that is `reference` of its owner, or where the interior's begin.
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
  uint corner_id = own.references == 0u ? disk_begin(j) & 63u : first_id(j);
  uint p = h.codes;
  uint parts = kind == ITEM_SELF ? (stream_total > 1u ? 2u : 1u) : end > 1u ? 2u : 1u;
  // Part 0 is stream 0, part 1 the other streams.
  for (uint part = 0u; part < parts && error == ERROR_NONE; part++) {
    uint streams = part == 0u ? 1u : stream_total - 1u;
    uint codes = p;
    uint firsts = 0u;         // bits of the first anchors
    uint ones = 0u;           // values with a unary part: anchors and chains,
    uint later = 0u;          //   and the interior
    uint interior_code = 0u;  // of the last stream
    uint interior_widths = 0u;
    uint inner = h.meshlet == own.meshlet ? traversed_count
                 : part == 0u             ? traversed_vertices(h)
                                          : 0u;
    uint count = team_disks;  // anchors, if h, then the team's own meshlet, has no references
    for (uint i = 0u; i < streams; i++) {
      uint s = part + i;
      uint n = stream_field(s, STREAM_ELEMENTS);
      if (chains && code_at(p, n, stream_base(s, BASE_CHAIN)) != CODE_FIXED) ones += total * n;
      if (kind == ITEM_SELF) team_codes[TEAM_INDEX][s] = p;
      uint seams = 0u;
      if (kind == ITEM_SELF) seams = seam_vertices_of(s);
      interior_code = code_at(p, n, stream_base(s, BASE_INTERIOR));
      interior_widths = p - WIDTH_BITS * n;
      if (interior_code != CODE_FIXED) later += (inner + seams) * n;
      if (h.references > 0u && (i == 0u || (h.flags & FLAG_SEAMS) != 0u))
        count = mask_count(stored_corners(h, seam_references(h, s)));
      if (count > 0u) firsts += n * stream_field(s, STREAM_BITS);
      if (count > 1u) ones += (count - 1u) * n;
    }
    uint anchors = p;
    uint quotients = p + firsts;
    uint low = after_ones(quotients, ones);
    uint lists = chains ? 2u * streams : streams;  // first the anchors of all, then the chains
    for (uint list = 0u; list < lists && error == ERROR_NONE; list++) {
      bool is_chain = list >= streams;
      uint s = part + list - (is_chain ? streams : 0u);
      uint n = stream_field(s, STREAM_ELEMENTS);
      uint bits = stream_field(s, STREAM_BITS);
      uint code = CODE_EXPONENTIAL | stream_base(s, BASE_ANCHOR);
      uint widths = 0u;
      uint items = 0u;   // values of the list,
      uint before = 0u;  //   those before the item's,
      uint mine = 0u;    //   and the item's
      uint id = 64u;
      if (is_chain) {
        code = code_at(codes, n, stream_base(s, BASE_CHAIN));
        widths = codes - WIDTH_BITS * n;
        code_at(codes, n, stream_base(s, BASE_INTERIOR));
        items = total * n;
        if (kind == ITEM_REFERENCE && s < stream_end &&
            !mask_test(team_seam_refs[TEAM_INDEX][s], j)) {
          before = first * n;
          mine = (max(reference_length_of(j), 1u) - 1u) * n;
        }
      } else {
        if (h.references > 0u && (list == 0u || (h.flags & FLAG_SEAMS) != 0u))
          count = mask_count(stored_corners(h, seam_references(h, s)));
        items = (max(count, 1u) - 1u) * n;
        if (kind == ITEM_CORNER && s >= begin && s < end) {
          id = corner_id;
          mine = index * n;
          for (uint c = 0u; c < n; c++)
            team_values[TEAM_INDEX][value_element(s, c) + id] = load_bits(anchors + c * bits, bits);
        }
        if (count > 0u) anchors += n * bits;
      }
      // Over the values before the item's, then over the rest of the list.
      for (uint rest = 0u; rest < 2u; rest++) {
        uint skipped = rest == 0u ? before : items - before;
        uint next = code == CODE_FIXED ? quotients : after_ones(quotients, skipped);
        low += low_size(code, n, widths, skipped, next - quotients - skipped);
        quotients = next;
        if (rest == 0u && mine > 0u)
          read_values(s, mine, id, j, mask_test(own.foreign_refs, j), code, widths, low, quotients);
      }
    }
    quotients = low;
    low = after_ones(quotients, later);
    if (kind == ITEM_SELF) {
      team_unary[TEAM_INDEX][part] = quotients;
      team_low[TEAM_INDEX][part] = low;
    }
    // Right for part 0, which is one stream.
    p = low + low_size(interior_code, stream_field(0u, STREAM_ELEMENTS), interior_widths,
                       inner * stream_field(0u, STREAM_ELEMENTS), low - quotients - later);
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
uint list_seams(uint s) {
  uint count = 0u;
  for (mask64 rest = team_seam_refs[TEAM_INDEX][s]; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    uint length = reference_length_of(r);
    uint rank = team_references[TEAM_INDEX][r] & 63u;
    for (uint i = 1u + MEMBER; i < length; i += TEAM)
      team_seams[TEAM_INDEX][(count + i - 1u) & 63u] = loop_id(rank + i) | r << 8 | i << 16;
    count += length - 1u;
  }
  return min(count, 64u);
}

// Lists the positions of n ones from bit p, from index `first` of the list on. Each thread takes
// every TEAM-th word. A barrier must follow.
void list_ones(uint p, uint n, uint first) {
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
      staged[ones_place() + first + before] = ((w + MEMBER) << 5) + uint(findLSB(mine));
      mine &= mine - 1u;
    }
  }
}

// Writes `count` residuals of stream s in place of values: the seams', then those of the traversed
// vertices. unary_begin: bit position of their unary parts; ones: index in the list of their first
// quotient.
void read_interior_residuals(uint s, uint code, uint widths, uint low, uint seams, uint count,
                             uint ones, uint unary_begin) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint step = code == CODE_FIXED ? fixed_width(n, widths) : 0u;
  for (uint item = MEMBER; item < count; item += TEAM) {
    uint i = n == 3u ? (item * 171u) >> 9 : n == 2u ? item >> 1 : item / n;
    uint c = item - i * n;
    uint id = (i < seams ? team_seams[TEAM_INDEX][i & 63u]
                         : team_traversal[TEAM_INDEX][(i - seams) & 63u] >> 16) &
              63u;
    uint residual;
    if (code == CODE_FIXED) {
      residual =
          load_bits(low + i * step + fixed_width(c, widths), width_field(widths + WIDTH_BITS * c));
    } else {
      uint from = item == 0u ? unary_begin : staged[ones_place() + ones + item - 1u] + 1u;
      uint quotient = staged[ones_place() + ones + item] - from;
      if (quotient > MAX_QUOTIENT) error = ERROR_UNARY;
      uint at = low + item * (code & 31u) + (is_exponential(code) ? from - unary_begin - item : 0u);
      residual = coded_value(code, quotient, at);
    }
    team_values[TEAM_INDEX][value_element(s, c) + id] = unzigzag(residual);
  }
}

// Reads the interior's residuals of all decoded streams. A team that is not `sound` only takes part
// in the barriers.
void read_interior(bool sound) {
  barrier();  // the list of ones overwrites the owners' data
  uint listed = 0u;
  for (uint part = 0u; part < 2u && part < stream_end; part++) {
    uint end = part == 0u ? 1u : stream_end;
    uint unary_begin = team_unary[TEAM_INDEX][part];
    uint low = team_low[TEAM_INDEX][part];
    uint ones = 0u;
    for (uint s = part; s < end && sound; s++) {
      uint n = stream_field(s, STREAM_ELEMENTS);
      uint p = team_codes[TEAM_INDEX][s];
      if (code_at(p, n, stream_base(s, BASE_INTERIOR)) == CODE_FIXED) continue;
      ones += (traversed_count + seam_vertices_of(s)) * n;
    }
    if (listed + ones > MAX_ELEMENTS * 64u) error = ERROR_VERTICES;
    ones = min(ones, MAX_ELEMENTS * 64u - listed);
    if (sound) list_ones(unary_begin, ones, listed);
    uint all = listed + ones;
    for (uint s = part; s < end; s++) {
      uint n = stream_field(s, STREAM_ELEMENTS);
      uint p = team_codes[TEAM_INDEX][s];
      uint code = code_at(p, n, stream_base(s, BASE_INTERIOR));
      uint widths = p - WIDTH_BITS * n;
      uint seams = sound ? list_seams(s) : 0u;
      uint count = sound && error == ERROR_NONE ? min(seams + traversed_count, 64u) * n : 0u;
      barrier();
      count = code == CODE_FIXED ? count : min(count, all - listed);
      read_interior_residuals(s, code, widths, low, seams, count, listed, unary_begin);
      uint next = unary_begin;
      if (code != CODE_FIXED && count > 0u) {
        listed += count;
        next = staged[ones_place() + listed - 1u] + 1u;
      }
      low += low_size(code, n, widths, count, next - unary_begin - count);
      unary_begin = next;
      barrier();
    }
    if (sound && max(unary_begin, low) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
    listed = all;
  }
}

// --- predictions ---

// Places of the vertices of reference r in the owner's direction: 0 is its first corner.
uint run_id(HEADER_IN h, uint r, bool backwards, uint i) {
  uint length = reference_length_of(r);
  uint place = backwards ? length - i : i;
  if (place == length) return first_id(next_reference(h, r));
  return loop_id((team_references[TEAM_INDEX][r & 63u] & 63u) + place);
}

// Shared foreign chains run in their owner's direction; seams run in this meshlet's.
bool runs_backwards(HEADER_IN h, uint r, uint s) {
  return mask_test(h.foreign_refs & ~team_seam_refs[TEAM_INDEX][s], r);
}

Triple grid_position(uint id) {
  return Triple(team_values[TEAM_INDEX][id], team_values[TEAM_INDEX][64u + id],
                team_values[TEAM_INDEX][128u + id]);
}

// The weights of AFFINE stream s into team_seams: of inner vertices of chains, or of traversed
// vertices.
void find_weights(HEADER_IN h, uint s, bool chains) {
  uint items = chains ? (h.references > 0u ? mask_count(team_boundary) : 0u) : traversed_count;
  for (uint item = MEMBER; item < items; item += TEAM) {
    uint step = 0u;
    if (chains) {
      uint r = (mask_count(team_ranks[TEAM_INDEX] & mask_below(item + 1u)) - 1u) & 63u;
      uint length = reference_length_of(r);
      bool backwards = runs_backwards(h, r, s);
      uint i = item - (team_references[TEAM_INDEX][r] & 63u);
      if (i == 0u || i >= length || mask_test(h.private_refs, r)) continue;
      if (backwards) i = length - i;
      step = pack4(run_id(h, r, backwards, i), run_id(h, r, backwards, i - 1u),
                   run_id(h, r, backwards, length),
                   i < 2u ? NO_VERTEX : run_id(h, r, backwards, i - 2u));
    } else {
      // As a step: v, a, b, o.
      uint triangle = team_traversal[TEAM_INDEX][item];
      step = ((triangle >> 16) & 255u) | (triangle & 0xFFFFu) << 8 | (triangle & 0xFF000000u);
    }
    Weights w;
    w.exist = false;
    uint v = step & 63u;
    uint a = (step >> 8) & 63u;
    uint b = (step >> 16) & 63u;
    if (step >> 24 != NO_VERTEX) w = affine_weights(a, b, (step >> 24) & 63u, v);
    if (chains && !w.exist) w = line_weights(a, b, v);
    team_seams[TEAM_INDEX][item & 63u] = pack_weights(w);
  }
}

// The decoded stream that an element of the values belongs to, and the element's number in it.
uvec2 stream_of_element(uint element) {
  uint s = 0u;
  for (uint next = 1u; next < stream_end; next++)
    if (element >= stream_field(next, STREAM_ELEMENT)) s = next;
  return uvec2(s, element - stream_field(s, STREAM_ELEMENT));
}

// Turns the residuals of the chains of elements [first, end) into values, a thread for each element
// of each reference.
void predict_team_chains(HEADER_IN h, uint first, uint end) {
  uint elements = max(end - first, 1u);
  for (uint item = MEMBER; item < h.references * elements; item += TEAM) {
    uint r = item / elements;
    if (mask_test(h.private_refs, r)) continue;
    uint s = stream_of_element(first + item - r * elements).x;
    uint predictor = stream_field(s, STREAM_PREDICTOR);
    uint base = min(first + item - r * elements, MAX_ELEMENTS - 1u) * 64u;
    uint mask = bits_mask(s);
    uint length = reference_length_of(r);
    bool backwards = runs_backwards(h, r, s);
    uint rank = team_references[TEAM_INDEX][r & 63u] & 63u;
    uint to = first_id(next_reference(h, r));
    uint prev = team_values[TEAM_INDEX][base + (backwards ? to : loop_id(rank))];
    uint last = team_values[TEAM_INDEX][base + (backwards ? loop_id(rank) : to)];
    uint before = prev;
    for (uint left = length; left > 1u; left--) {
      uint place = rank + (backwards ? left - 1u : length + 1u - left);
      uint v = base + loop_id(place);
      uint weights = predictor == PREDICT_AFFINE ? team_seams[TEAM_INDEX][place & 63u] : 0u;
      uint point = prev;
      if (weights != 0u)
        point = affine_point(unpack_weights(weights), prev, last, before);
      else if (predictor != PREDICT_COPY)
        point = toward(prev, last, left);
      before = prev;
      prev = (point + team_values[TEAM_INDEX][v]) & mask;
      team_values[TEAM_INDEX][v] = prev;
    }
  }
}

// Adds the predictions to the residuals of the traversed vertices, for one element. The predictors
// are (u (a + w b) + x o + y) >> z with constants of the stream; without a triangle across the
// gate, u = 1 and x = y = 0. AFFINE and GEO fall back to PARALLELOGRAM.
void predict_element(uint s, uint c) {
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  uint bits = bits_mask(s);
  uint element = value_element(s, c);
  bool copies = predictor == PREDICT_COPY;
  bool damped = predictor == PREDICT_DAMPED;
  bool affine = predictor == PREDICT_AFFINE;
  bool uses_o = predictor != PREDICT_MEAN && !copies;
  uint factor = damped ? 3u : 1u;
  uint factor_o = damped ? 0u - 2u : 0u - 1u;
  uint rounding = damped ? 2u : 0u;
  int shift = damped ? 2 : 0;
  int shift_mean = copies ? 0 : 1;
  // GEO's interior vertices have their values.
  mask64 wanted = predictor == PREDICT_GEO ? team_boundary : mask_below(64u);
  uint count = predictor == PREDICT_GEO_ALL ||
                       (predictor == PREDICT_GEO && !mask_any(team_waiting[TEAM_INDEX]))
                   ? 0u
                   : traversed_count;
  for (uint i = 0u; i < count; i++) {
    uint triangle = team_traversal[TEAM_INDEX][i];
    uint id = bitfieldExtract(triangle, 16, 6);
    if (!mask_test(wanted, id)) continue;
    uint v = element + id;
    uint a = team_values[TEAM_INDEX][element + (triangle & 63u)];
    uint b = team_values[TEAM_INDEX][element + bitfieldExtract(triangle, 8, 6)];
    uint o = team_values[TEAM_INDEX][element + bitfieldExtract(triangle, 24, 6)];
    uint sum = copies ? a : a + b;
    bool across = uses_o && triangle < NO_VERTEX << 24;
    uint point = across ? factor * sum + factor_o * o + rounding : sum;
    point = uint(int(point) >> (across ? shift : shift_mean));
    uint weights = affine ? team_seams[TEAM_INDEX][i] : 0u;
    if (weights != 0u) point = affine_point(unpack_weights(weights), a, b, o);
    team_values[TEAM_INDEX][v] = (point + team_values[TEAM_INDEX][v]) & bits;
  }
}

// Sums the triangles' cross products at their vertices in the scratch memory.
void sum_team_normals(bool sound) {
  barrier();
  for (uint i = MEMBER; i < 192u; i += TEAM) staged[ones_place() + i] = 0u;
  barrier();
  for (uint t = MEMBER; t < triangle_count && sound; t += TEAM) {
    uint triangle = packed_triangle(t);
    Triple normal = triangle_normal(triangle, geo_shift());
    for (uint corner = 0u; corner < 3u; corner++) {
      uint place = ones_place() + 3u * ((triangle >> (8u * corner)) & 63u);
      atomicAdd(staged[place], normal.x);
      atomicAdd(staged[place + 1u], normal.y);
      atomicAdd(staged[place + 2u], normal.z);
    }
  }
  barrier();
}

// Adds the predictions of GEO to the residuals of stream s.
void predict_team_geo(uint s) {
  uint bits = stream_field(s, STREAM_BITS);
  bool all = stream_field(s, STREAM_PREDICTOR) == PREDICT_GEO_ALL;
  for (uint i = MEMBER; i < traversed_count; i += TEAM) {
    uint id = bitfieldExtract(team_traversal[TEAM_INDEX][i], 16, 6);
    if (!all && mask_test(team_boundary, id)) continue;
    uint place = ones_place() + 3u * id;
    OctPair point =
        octahedral_prediction(staged[place], staged[place + 1u], staged[place + 2u], bits & 31u);
    for (uint c = 0u; c < 2u; c++) {
      uint v = value_element(s, c) + id;
      team_values[TEAM_INDEX][v] =
          ((c == 0u ? point.u : point.v) + team_values[TEAM_INDEX][v]) & bits_mask(s);
    }
  }
}

// Turns all residuals into values, stream 0 first, then batches of the others with at most one
// AFFINE stream each. A team that is not `sound` only takes part in the barriers.
void predict(HEADER_IN h, bool sound) {
  bool geo = any_stream_predicts(1u << PREDICT_GEO | 1u << PREDICT_GEO_ALL);
  uint begin = 0u;
  while (begin < stream_end) {
    uint end = begin + 1u;
    uint affine = stream_field(begin, STREAM_PREDICTOR) == PREDICT_AFFINE ? begin : MAX_STREAMS;
    for (; end < stream_end && begin > 0u; end++) {
      if (stream_field(end, STREAM_PREDICTOR) != PREDICT_AFFINE) continue;
      if (affine < MAX_STREAMS) break;
      affine = end;
    }
    uint first = stream_field(begin, STREAM_ELEMENT);
    uint after = stream_field(end - 1u, STREAM_ELEMENT) + stream_field(end - 1u, STREAM_ELEMENTS);
    if (geo && begin == 1u) sum_team_normals(sound);
    for (uint stage = 0u; stage < 2u; stage++) {
      barrier();
      if (affine < MAX_STREAMS) {
        if (sound) find_weights(h, affine, stage == 0u);
        barrier();
      }
      if (stage == 0u) {
        if (sound) predict_team_chains(h, first, after);
        continue;
      }
      if (geo) {
        for (uint s = begin; s < end && sound; s++)
          if (uses_geo(stream_field(s, STREAM_PREDICTOR))) predict_team_geo(s);
        barrier();
      }
      for (uint element = first + MEMBER; element < after && sound; element += TEAM) {
        uvec2 of = stream_of_element(element);
        predict_element(of.x, of.y);
      }
    }
    begin = end;
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
    for (uint i = 0u; i < 4u; i++) team_symbols[TEAM_INDEX][i] = mask_none();
    team_ranks[TEAM_INDEX] = mask_none();
    team_waiting[TEAM_INDEX] = mask_none();
  }
  barrier();
}

// Reads the symbols of meshlet h: each thread finds those of its triangles by counting bits.
// Contains a barrier.
void read_team_symbols(HEADER_IN h) {
  Planes planes = load_planes(h.begin, h.triangles);
  triangle_count = h.triangles;
  // By the number of planes that the symbol has ones in: R, first, second, third, S.
  uint kinds = h.table == 0u ? 0x34210u : 0x32140u;
  for (uint t = MEMBER; t < triangle_count; t += TEAM) {
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
      atomicOr(team_symbols[TEAM_INDEX][kind].x, bit.x);
    else
      atomicOr(team_symbols[TEAM_INDEX][kind].y, bit.y);
  }
  barrier();
  symbol_r = team_symbols[TEAM_INDEX][0];
  symbol_c = team_symbols[TEAM_INDEX][1];
  symbol_e = team_symbols[TEAM_INDEX][2];
  symbol_s = team_symbols[TEAM_INDEX][3];
}

// Decodes the values of the meshlet with header h, whose symbols and triangles are known. sound:
// false if there is nothing to decode.
void team_decode(Header h, bool sound) {
  if (!sound) error = ERROR_OFFSET;
  if (agree()) {
    find_disks();
    stage_owners(h);
    for (uint s = MEMBER; s < stream_total; s += TEAM)
      team_seam_refs[TEAM_INDEX][s] = seam_references(h, s);
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
  read_interior(sound);
  sound = agree();
  predict(h, sound);
  barrier();
}

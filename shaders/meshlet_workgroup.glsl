// The cooperative decoder: a team of TEAM lanes decodes the values of one meshlet (spec, appendix A.7), GROUP / TEAM meshlets to a
// workgroup. Every value has a lane that finds its bits alone; only the traversal of the interior is a chain, which a lane per
// component walks. The triangles come from elsewhere: from decoder B of another shader, or from parallel_connectivity.glsl.
//
// The includer has included meshlet_decoder_prologue.glsl, meshlet_decoder.glsl (whose header and mask functions are used here) and
// meshlet_decoder_epilogue.glsl, defines TEAM and has workgroups of GROUP invocations. It provides
//   packed_triangle(t)              triangle t of the team's meshlet, packed as in meshlet_decoder.glsl
//   connectivity_boundary()         mask of its boundary vertices
//   connectivity_starts()           mask of the triangles that begin a component
// and calls open_blob, team_streams(end) once, and then team_decode(m, sound) with all lanes.
// Results: team_values[TEAM_INDEX][lane * 64 + local id], vertex_count, and `error`, the same for all lanes of a team.
//
// Code is written so that what is long is called from one place: a compiler that inlines everything must still fit the instruction cache.
// Hostile bytes: every subscript is masked or bounded by a checked count; every loop by 64, by the streams, or by the blob's end. Loops
// around barriers run equally often in all teams.

#define GROUP 32u
#define TEAMS (GROUP / TEAM)
#define LANE gl_LocalInvocationIndex
#define TEAM_INDEX (LANE / TEAM)
#define MEMBER (LANE % TEAM)

shared uint group_stream[MAX_STREAMS];               // see stream_field
shared uint team_values[TEAMS][MAX_LANES * 64u];
shared uint team_error[TEAMS];
shared uint team_traversal[TEAMS][64];               // packed triangles that introduce a vertex
shared uint team_ones[TEAMS][64];                    // places of quotients' ends
shared uint team_references[TEAMS][64];              // rank in the loop order | length << 8
shared uint team_loop[TEAMS][16];                    // boundary ids in loop order, four to a word
shared uint team_begins[TEAMS][17];                  // first local id of each component, four to a word; one more at the end
shared mask64 team_waiting[TEAMS];                   // inner vertices of private references
shared uint team_seams[TEAMS][64];                   // inner vertices of a stream's seams: id | reference << 8 | place << 16
shared uint team_codes[TEAMS][MAX_STREAMS];          // bit positions of the interior's codes
shared uint team_low[TEAMS];                         // where section G begins

// ---- streams -------------------------------------------------------------------------------------------------------------------

#define STREAM_COMPONENTS 0, 3                       // offset and width of fields in group_stream
#define STREAM_BITS 3, 6
#define STREAM_PREDICTOR 9, 2
#define STREAM_CHAIN_BASE 11, 5
#define STREAM_INTERIOR_BASE 16, 5
#define STREAM_LANE 21, 11
#define stream_field(s, field) bitfieldExtract(group_stream[s], field)

// Reads the stream table; streams [0, end) are decoded.
void team_streams(uint end) {
  load_tables();
  stream_total = min(stream_total, MAX_STREAMS);
  stream_end = min(end, stream_total);
  for (uint s = LANE; s < stream_total; s += GROUP) {
    uint shape = load_word(8u + 7u * s);
    uint bases = load_word(9u + 7u * s);
    uint lane = 0u;
    for (uint before = 0u; before < s; before++) lane += (load_word(8u + 7u * before) >> 8) & 7u;
    group_stream[s] = ((shape >> 8) & 7u) | ((shape >> 16) & 63u) << 3 | ((shape >> 24) & 3u) << 9 | (bases & 31u) << 11 |
                      ((bases >> 8) & 31u) << 16 | min(lane, MAX_LANES) << 21;
  }
  barrier();
}

uint bits_mask(uint s) { return word_below(stream_field(s, STREAM_BITS)); }

// Where a component's values begin; a lane that there is no room for, which the host rules out, is the first.
uint value_lane(uint s, uint c) {
  uint lane = stream_field(s, STREAM_LANE) + c;
  return (lane < MAX_LANES ? lane : 0u) * 64u;
}

// ---- small parts -----------------------------------------------------------------------------------------------------------------

uint code_at(inout uint p, uint components, uint base) {
  uint code = load_bits(p, 3u);
  p += 3u;
  if (code == 7u) {
    p += 5u * components;
    return CODE_FIXED;
  }
  if (base + code > 31u) error = ERROR_CODE;
  return (base + code) & 31u;
}

// Low bits of one vertex under a code whose widths, if it is fixed, are at bit position `widths`.
uint low_width(uint code, uint components, uint widths) {
  if (code != CODE_FIXED) return code * components;
  uint sum = 0u;
  for (uint c = 0u; c < components; c++) sum += width_field(widths + 5u * c);
  return sum;
}

// The bit position after the n-th one from bit p on.
uint after_ones(uint p, uint n) {
  if (n == 0u) return p;
  uint w = p >> 5;
  uint word = load_word(w) & ~word_below(p & 31u);
  uint empty = 0u;
  for (uint ones = uint(bitCount(word)); ones < n; ones = uint(bitCount(word))) {
    empty = ones == 0u ? empty + 1u : 0u;
    if (w >= blob_word_total || empty > (MAX_QUOTIENT >> 5) + 1u) {
      error = ERROR_UNARY;
      return p;
    }
    n -= ones;
    w++;
    word = load_word(w);
  }
  for (; n > 1u; n--) word &= word - 1u;
  return (w << 5) + uint(findLSB(word)) + 1u;
}

uint chord_point(uint a, uint b, uint i, uint n) {
  return a + ((b - a) * i + (n >> 1) + (n << 24)) / n - (1u << 24);
}

uint loop_id(uint rank) { return bitfieldExtract(team_loop[TEAM_INDEX][(rank >> 2) & 15u], int(rank & 3u) * 8, 6); }
uint component_begin(uint component) { return bitfieldExtract(team_begins[TEAM_INDEX][min(component, 64u) >> 2], int(component & 3u) * 8, 7); }
uint first_id(uint r) { return loop_id(team_references[TEAM_INDEX][r & 63u]); }
uint reference_length_of(uint r) { return team_references[TEAM_INDEX][r & 63u] >> 8; }

// ---- components --------------------------------------------------------------------------------------------------------------------

mask64 team_boundary;
uint team_components;

mask64 symbol_l() { return mask_below(triangle_count) & ~(symbol_r | symbol_e | symbol_c | symbol_s); }

void find_components() {
  mask64 starts = connectivity_starts();
  team_boundary = connectivity_boundary();
  team_components = mask_count(starts);
  vertex_count = mask_count(symbol_r | symbol_e) + mask_count(symbol_e) + mask_count(symbol_l()) + team_components;
  if (vertex_count > 64u || team_components == 0u) {
    error = ERROR_VERTICES;
    vertex_count = min(vertex_count, 64u);
  }
  for (uint t = MEMBER; t <= triangle_count; t += TEAM) {
    if (t < triangle_count && !mask_test(starts, t)) continue;
    mask64 before = mask_below(t);
    uint component = mask_count(starts & before);
    uint ids = mask_count((symbol_r | symbol_e) & before) + mask_count(symbol_e & before) + mask_count(symbol_l() & before) + component;
    if (t == triangle_count) ids = vertex_count;
    atomicOr(team_begins[TEAM_INDEX][component >> 2], min(ids, 64u) << 8u * (component & 3u));
  }
  for (uint id = MEMBER; id < vertex_count; id += TEAM) {
    if (!mask_test(team_boundary, id)) continue;
    uint rank = mask_count(team_boundary & mask_below(id));
    atomicOr(team_loop[TEAM_INDEX][rank >> 2], id << 8u * (rank & 3u));
  }
}

// Loop `k` in the loop order: its first rank, and the one after its last.
uvec2 loop_ranks(uint k) {
  return uvec2(mask_count(team_boundary & mask_below(component_begin(k))), mask_count(team_boundary & mask_below(component_begin(k + 1u))));
}

// ---- places of a meshlet's data for one stream (sections C to F) -------------------------------------------------------------------

struct Place {
  uint anchors;          // bit position of the first anchor,
  uint chain_code;       // Rice parameter or CODE_FIXED,
  uint chain_widths;     //   the widths of a fixed code,
  uint chain_low;        //   low bits of the first chain vertex,
  uint chain_unary;      // section F,
  uint chain_skipped;    //   the quotients of earlier streams in it,
  uint chain_quotients;  //   all quotients in it
};

// `own`: h is the team's own meshlet, whose interior codes are noted for later.
Place find_place(HEADER_IN h, uint stream, bool own) {
  Place place = Place(0u, 0u, 0u, 0u, 0u, 0u, 0u);
  bool chains = mask_any(h.owned_refs);
  uint p = h.codes;
  uint low = 0u;                           // of the chains, per vertex
  uint rice = 0u;                          // components with quotients
  for (uint s = 0u; s < stream_total; s++) {
    uint components = stream_field(s, STREAM_COMPONENTS);
    if (s == stream) place.chain_low = low;
    if (s == stream) place.chain_skipped = rice;
    for (uint kind = chains ? 0u : 1u; kind < 2u; kind++) {
      bool interior = kind == 1u;
      if (interior && own) team_codes[TEAM_INDEX][s] = p;
      uint code = code_at(p, components, interior ? stream_field(s, STREAM_INTERIOR_BASE) : stream_field(s, STREAM_CHAIN_BASE));
      if (interior) continue;
      uint widths = p - 5u * components;
      low += low_width(code, components, widths);
      if (code != CODE_FIXED) rice += components;
      if (s != stream) continue;
      place.chain_code = code;
      place.chain_widths = widths;
    }
  }
  uint total = 0u;                         // inner vertices of all owned references
  uint lengths = h.lengths;
  for (mask64 rest = h.sized_refs; mask_any(rest); rest = mask_clear_lsb(rest)) {
    if (mask_test(h.owned_refs, mask_lsb(rest))) total += load_bits(lengths, h.length_width);
    lengths += h.length_width;
  }
  uint count = team_components;            // anchors, where the meshlet, then the team's own, has no references
  for (uint s = 0u; s < stream_total; s++) {
    uint components = stream_field(s, STREAM_COMPONENTS);
    if (h.references > 0u && (s == 0u || (h.flags & FLAG_SEAMS) != 0u)) count = mask_count(stored_corners(h, seam_references(h, s)));
    if (s == stream) place.anchors = p;
    if (count > 0u) p += components * stream_field(s, STREAM_BITS);
    if (count > 1u) p += 5u + (count - 1u) * components * width_field(p);
  }
  place.chain_low = p + total * place.chain_low;
  place.chain_unary = p + total * low;
  place.chain_skipped *= total;
  place.chain_quotients = rice * total;
  return place;
}

// ---- references, corners, chains -----------------------------------------------------------------------------------------------------

void read_anchor_into(HEADER_IN h, Place place, uint s, uint index, uint id) {
  uint n = stream_field(s, STREAM_COMPONENTS);
  uint bits = stream_field(s, STREAM_BITS);
  uint p = place.anchors;
  uint width = index > 0u ? width_field(p + n * bits) : 0u;
  uint deltas = p + n * bits + 5u + (index - 1u) * n * width;
  for (uint c = 0u; c < n; c++) {
    uint value = load_bits(p + c * bits, bits);
    if (index > 0u) value += unzigzag(load_bits(deltas + c * width, width));
    team_values[TEAM_INDEX][value_lane(s, c) + id] = value & bits_mask(s);
  }
}

// Inner vertices of the team's reference r from the residuals of reference `reference` of `owner`.
void read_chain_into(HEADER_IN h, uint r, HEADER_IN owner, uint reference, Place place, uint s) {
  bool foreign = mask_test(h.foreign_refs, r);
  uint length = reference_length_of(r);
  uint first = 0u;
  for (mask64 rest = owner.owned_refs & mask_below(reference); mask_any(rest); rest = mask_clear_lsb(rest))
    first += stored_length(owner, mask_lsb(rest)) - 1u;
  uint n = stream_field(s, STREAM_COMPONENTS);
  bool copies = stream_field(s, STREAM_PREDICTOR) == PREDICT_COPY;
  bool rice = place.chain_code != CODE_FIXED;
  uint low = place.chain_low + first * low_width(place.chain_code, n, place.chain_widths);
  if (rice) unary = seek_unary(after_ones(place.chain_unary, place.chain_skipped + first * n));
  uint rank = team_references[TEAM_INDEX][r & 63u];
  uint from = loop_id(rank);
  uint to = first_id(next_reference(h, r));
  for (uint item = n; item < length * n && error == ERROR_NONE; item++) {
    uint i = item / n;
    uint c = item - i * n;
    uint width = rice ? place.chain_code : width_field(place.chain_widths + 5u * c);
    uint residual = load_bits(low, width);
    if (rice) residual |= next_quotient(unary) << width;
    low += width;
    uint lane = value_lane(s, c);
    uint a = team_values[TEAM_INDEX][lane + (foreign ? to : from)];
    uint b = team_values[TEAM_INDEX][lane + (foreign ? from : to)];
    uint point = copies ? a : chord_point(a, b, i, length);
    uint id = loop_id((rank & 63u) + (foreign ? length - i : i));
    team_values[TEAM_INDEX][lane + id] = (point + unzigzag(residual)) & bits_mask(s);
  }
  if (max(low, rice ? unary.cursor : 0u) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

#define PASS_LENGTHS 0u                    // of references; and the meshlet's own place
#define PASS_CORNERS 1u
#define PASS_CHAINS 2u

// One item of a pass: reference, or corner, j for stream s. All passes need the headers that references lead to, so that they share
// this code.
void read_boundary_item(HEADER_IN own, uint pass, uint j, uint s) {
  Header h = own;
  uint corner = j;
  bool at_end = false;
  bool self = pass == PASS_LENGTHS && j == own.references;
  uint index = j;                          // of a corner's anchor
  bool found = self || (pass == PASS_CORNERS && own.references == 0u);
  for (uint hop = 0u; !found; hop++) {
    mask64 seams = pass == PASS_LENGTHS ? mask_none() : seam_references(h, s);
    mask64 shared_refs = h.foreign_refs & ~seams;
    uint before = previous_reference(h, corner) & 63u;
    bool follow = mask_test(shared_refs, corner);
    bool follow_before = pass == PASS_CORNERS && mask_test(shared_refs, before);
    found = hop == 1u && pass != PASS_CORNERS || !follow && !follow_before;
    if (found) {
      if (pass == PASS_CORNERS) index = mask_count(stored_corners(h, seams) & mask_below(corner));
      break;
    }
    if (follow && follow_before) follow = entry_owner(h, entry_position(h, before)) >= entry_owner(h, entry_position(h, corner));
    uint entry = entry_position(h, follow ? corner : before);
    uint slot = entry_slot(h, entry);
    if (hop == MAX_HOPS) error = ERROR_HOPS;
    h = read_header(entry_owner(h, entry));
    uint reference = slot_reference(h, slot) & 63u;
    at_end = pass == PASS_CORNERS && follow;
    corner = (at_end ? next_reference(h, reference) : reference) & 63u;
    if (error != ERROR_NONE) return;
  }
  if (pass == PASS_LENGTHS && !self) {
    uint length = 0u;
    if (!mask_test(own.private_refs, j) || mask_test(own.sized_refs, j)) {
      length = stored_length(h, corner);
    } else {
      uvec2 ranks = loop_ranks(mask_count(own.loop_ends & mask_below(j)));
      length = ranks.y - ranks.x;
    }
    team_references[TEAM_INDEX][j] = min(length, 64u) << 8;
    return;
  }
  if (pass == PASS_CHAINS && (mask_test(own.private_refs, j) || mask_test(own.foreign_refs & seam_references(own, s), j) || reference_length_of(j) < 2u)) return;
  Place place = find_place(h, s, self);
  if (self) team_low[TEAM_INDEX] = after_ones(place.chain_unary, place.chain_quotients);
  else if (pass == PASS_CORNERS) read_anchor_into(h, place, s, index, own.references == 0u ? component_begin(j) & 63u : first_id(j));
  else read_chain_into(own, j, h, corner, place, s);
}

// Ranks of the references, from their lengths; and the vertices of private ones, which wait for the traversal.
void place_team_references(HEADER_IN h) {
  if (h.references > 0u && mask_count(h.loop_ends) != team_components) error = ERROR_REFERENCES;
  for (uint r = MEMBER; r < h.references; r += TEAM) {
    uint rank = 0u;
    for (uint before = 0u; before < r; before++) rank += team_references[TEAM_INDEX][before] >> 8;
    uint length = reference_length_of(r);
    uvec2 ranks = loop_ranks(mask_count(h.loop_ends & mask_below(r)));
    if (r == loop_begin(h, r) && rank != ranks.x) error = ERROR_REFERENCES;
    if (mask_test(h.loop_ends, r) ? rank + length != ranks.y : rank + length > ranks.y) error = ERROR_REFERENCES;
    atomicOr(team_references[TEAM_INDEX][r], rank & 63u);
    if (!mask_test(h.private_refs, r)) continue;
    for (uint i = 1u; i < length; i++) {
      mask64 id = mask_bit(loop_id(rank + i));
      atomicOr(team_waiting[TEAM_INDEX].x, id.x);
      atomicOr(team_waiting[TEAM_INDEX].y, id.y);
    }
  }
  if (h.references == 0u && MEMBER == 0u) {
    mask64 firsts = mask_none();
    for (uint i = 0u; i < team_components; i++) firsts = firsts | mask_bit(component_begin(i) & 63u);
    team_waiting[TEAM_INDEX] = team_boundary & ~firsts;
  }
}

// ---- interior ----------------------------------------------------------------------------------------------------------------------

// Lists the triangles that introduce a vertex, in order (spec, A.7, "Traversed vertices").
void list_traversal() {
  mask64 waiting = team_waiting[TEAM_INDEX];
  mask64 starts = connectivity_starts();
  mask64 roots = mask_none();              // triangles whose gate introduces its a, before all others of the component
  mask64 introducing = symbol_c;
  if (mask_any(waiting)) {
    for (mask64 rest = starts; mask_any(rest); rest = mask_clear_lsb(rest)) {
      uint t = mask_lsb(rest);
      uint a = packed_triangle(t) & 63u;
      if (!mask_test(waiting, a)) continue;
      roots = roots | mask_bit(t);
      waiting = waiting & ~mask_bit(a);
    }
    // Every other waiting vertex is first met as the apex of a triangle that is not C.
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

// Inner vertices of the seams of stream s; lists them in reference order.
uint list_seams(HEADER_IN h, uint s) {
  uint count = 0u;
  for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    uint length = reference_length_of(r);
    uint rank = team_references[TEAM_INDEX][r] & 63u;
    for (uint i = 1u + MEMBER; i < length; i += TEAM) team_seams[TEAM_INDEX][(count + i - 1u) & 63u] = loop_id(rank + i) | r << 8 | i << 16;
    count += length - 1u;
  }
  return min(count, 64u);
}

// The places of the next n <= 64 ones from bit p on, into team_ones; returns the bit after the last, once all lanes are here.
uint list_ones(uint p, uint n) {
  uint found = 0u;
  uint empty = 0u;
  uint end = p;
  for (uint w = p >> 5; found < n; w++) {
    uint word = load_word(w);
    if (w == p >> 5) word &= ~word_below(p & 31u);
    empty = word == 0u ? empty + 1u : 0u;
    if (w >= blob_word_total || empty > (MAX_QUOTIENT >> 5) + 1u) {
      error = ERROR_UNARY;
      return p;
    }
    for (uint i = MEMBER; i < 32u; i += TEAM) {
      uint rank = found + uint(bitCount(word & word_below(i)));
      if ((word >> i & 1u) != 0u && rank < n) team_ones[TEAM_INDEX][rank] = (w << 5) + i;
    }
    uint ones = uint(bitCount(word));
    if (found + ones >= n) {
      for (uint k = found + 1u; k < n; k++) word &= word - 1u;
      end = (w << 5) + uint(findLSB(word)) + 1u;
    }
    found += ones;
  }
  return end;
}

// Residuals of vertices `first` and on, 64 values at most, of stream s: into the vertices' values.
void read_interior_residuals(uint s, uint code, uint widths, uint low, uint seams, uint begin, uint first, uint count) {
  uint n = stream_field(s, STREAM_COMPONENTS);
  for (uint item = MEMBER; item < count; item += TEAM) {
    uint value = first + item;
    uint i = value / n;
    uint c = value - i * n;
    uint id = i < seams ? team_seams[TEAM_INDEX][i & 63u] & 63u : (team_traversal[TEAM_INDEX][(i - seams) & 63u] >> 16) & 63u;
    uint at = low + value * code;
    uint width = code;
    uint quotient = 0u;
    if (code == CODE_FIXED) {
      at = low + i * low_width(code, n, widths) + low_width(code, c, widths);
      width = width_field(widths + 5u * c);
    } else {
      quotient = team_ones[TEAM_INDEX][item] - (item == 0u ? begin : team_ones[TEAM_INDEX][item - 1u] + 1u);
      if (quotient > MAX_QUOTIENT) error = ERROR_UNARY;
    }
    team_values[TEAM_INDEX][value_lane(s, c) + id] = unzigzag(load_bits(at, width) | (code == CODE_FIXED ? 0u : quotient << code));
  }
}

// Adds the chord to the seams' residuals.
void predict_seams(HEADER_IN h, uint s, uint seams) {
  uint n = stream_field(s, STREAM_COMPONENTS);
  bool copies = stream_field(s, STREAM_PREDICTOR) == PREDICT_COPY;
  for (uint item = MEMBER; item < seams; item += TEAM) {
    uint seam = team_seams[TEAM_INDEX][item];
    uint r = (seam >> 8) & 63u;
    uint from = first_id(r);
    uint to = first_id(next_reference(h, r));
    for (uint c = 0u; c < n; c++) {
      uint lane = value_lane(s, c);
      uint a = team_values[TEAM_INDEX][lane + from];
      uint point = copies ? a : chord_point(a, team_values[TEAM_INDEX][lane + to], seam >> 16, max(reference_length_of(r), 1u));
      uint v = lane + (seam & 63u);
      team_values[TEAM_INDEX][v] = (point + team_values[TEAM_INDEX][v]) & bits_mask(s);
    }
  }
}

// Adds the predictions to the residuals of the traversed vertices, one member of the team per component. The predictors are
// (u (a + w b) + x o + y) >> z with a stream's own constants; where there is nothing across the gate, u = 1 and x = y = 0.
void predict_component(uint s, uint c) {
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  uint bits = bits_mask(s);
  uint lane = value_lane(s, c);
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
    uint v = lane + bitfieldExtract(triangle, 16, 6);
    uint a = team_values[TEAM_INDEX][lane + (triangle & 63u)];
    uint b = team_values[TEAM_INDEX][lane + bitfieldExtract(triangle, 8, 6)];
    uint o = team_values[TEAM_INDEX][lane + bitfieldExtract(triangle, 24, 6)];
    uint sum = copies ? a : a + b;
    bool across = uses_o && triangle < NO_VERTEX << 24;
    uint point = across ? factor * sum + factor_o * o + rounding : sum;
    point = uint(int(point) >> (across ? shift : shift_mean));
    team_values[TEAM_INDEX][v] = (point + team_values[TEAM_INDEX][v]) & bits;
  }
}

// The stream that lane `lane` of the values belongs to, and its component, for the streams that are decoded.
uvec2 stream_of_lane(uint lane) {
  uint s = 0u;
  for (uint next = 1u; next < stream_end; next++)
    if (lane >= stream_field(next, STREAM_LANE)) s = next;
  return uvec2(s, lane - stream_field(s, STREAM_LANE));
}

// Sections G and H. `sound`: false for a team that only keeps the others company at the barriers.
void decode_team_interior(HEADER_IN h, bool sound) {
  uint low = team_low[TEAM_INDEX];
  uint unary_at = low;
  if (sound) {
    for (uint s = 0u; s < stream_total; s++) {
      uint n = stream_field(s, STREAM_COMPONENTS);
      uint seams = 0u;
      for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest)) seams += reference_length_of(mask_lsb(rest)) - 1u;
      uint p = team_codes[TEAM_INDEX][s];
      uint code = code_at(p, n, stream_field(s, STREAM_INTERIOR_BASE));
      unary_at += (traversed_count + seams) * low_width(code, n, p - 5u * n);
    }
  }
  for (uint s = 0u; s < stream_end; s++) {
    uint n = stream_field(s, STREAM_COMPONENTS);
    uint p = team_codes[TEAM_INDEX][s];
    uint code = code_at(p, n, stream_field(s, STREAM_INTERIOR_BASE));
    uint widths = p - 5u * n;
    uint seams = sound ? list_seams(h, s) : 0u;
    uint values = sound ? (seams + traversed_count) * n : 0u;
    for (uint first = 0u; first < 64u * n; first += 64u) {
      uint count = first < values ? min(values - first, 64u) : 0u;
      uint begin = unary_at;
      if (code != CODE_FIXED && count > 0u) unary_at = list_ones(unary_at, count);
      barrier();
      read_interior_residuals(s, code, widths, low, seams, begin, first, count);
      barrier();
    }
    predict_seams(h, s, seams);
    barrier();
    low += (seams + traversed_count) * low_width(code, n, widths);
  }
  if (sound && max(unary_at, low) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
  uint lanes = stream_field(stream_end - 1u, STREAM_LANE) + stream_field(stream_end - 1u, STREAM_COMPONENTS);
  for (uint lane = MEMBER; lane < lanes && sound; lane += TEAM) {
    uvec2 of = stream_of_lane(lane);
    predict_component(of.x, of.y);
  }
}

// ---- a whole meshlet ---------------------------------------------------------------------------------------------------------------

// What a member has found wrong is known to its team after it.
bool agree() {
  if (error != ERROR_NONE) atomicMax(team_error[TEAM_INDEX], error);
  barrier();
  error = team_error[TEAM_INDEX];
  return error == ERROR_NONE;
}

// Call before team_decode, and a barrier() in between.
void clear_team() {
  error = ERROR_NONE;
  for (uint i = MEMBER; i < 17u; i += TEAM) {
    team_begins[TEAM_INDEX][i] = 0u;
    team_loop[TEAM_INDEX][i & 15u] = 0u;
  }
  if (MEMBER == 0u) {
    team_error[TEAM_INDEX] = ERROR_NONE;
    team_waiting[TEAM_INDEX] = mask_none();
  }
}

// h: the meshlet's header; its symbols are read, and its triangles known. sound: false where there is nothing to decode.
void team_decode(Header h, bool sound) {
  if (!sound) error = ERROR_OFFSET;
  if (agree()) find_components();
  sound = agree();
  uint corners = h.references == 0u ? team_components : h.references;
  for (uint pass = PASS_LENGTHS; pass <= PASS_CHAINS; pass++) {
    uint streams = pass == PASS_LENGTHS ? 1u : stream_end;
    uint items = pass == PASS_LENGTHS ? h.references + 1u : (pass == PASS_CORNERS ? corners : h.references) * streams;
    for (uint item = MEMBER; item < items && sound; item += TEAM) {
      uint j = item / streams;
      read_boundary_item(h, pass, j, item - j * streams);
    }
    sound = agree();
    if (pass == PASS_LENGTHS) {
      if (sound) place_team_references(h);
      barrier();
      if (sound) list_traversal();
      sound = agree();
    }
  }
  decode_team_interior(h, sound);
  agree();
}

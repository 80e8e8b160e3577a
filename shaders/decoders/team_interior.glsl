// The inside of a team's meshlet: seams' residuals, and the vertices that its triangles introduce.
// One thread finds the bits of a value and writes its residual to the place of the value.
// Then the values: first stream 0, then the others, which may depend on it. Only two things are
// sequential: a chain of a reference, one thread per element, and the traversal of the interior,
// one thread per element.
//
// needs: WORKGROUP, packed_triangle, connectivity_boundary, connectivity_starts
#ifndef TEAM_INTERIOR_GLSL
#define TEAM_INTERIOR_GLSL

#include "decoders/team_meshlet.glsl"

// Number of inner vertices of the seams of stream s.
uint seam_vertices_of(uint s) {
  uint count = 0u;
  for (mask64 rest = team_seam_refs[s]; mask_any(rest); rest = mask_clear_lsb(rest))
    count += reference_length_of(mask_lsb(rest)) - 1u;
  return count;
}

// Lists the triangles that introduce a vertex, in order (spec, A.7, "Traversed vertices").
void list_traversal() {
  mask64 waiting = team_waiting;
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
  for (uint t = THREAD; t < triangle_count; t += WORKGROUP) {
    if (!mask_test(introducing | roots, t)) continue;
    uint place = mask_count(introducing & mask_below(t)) + mask_count(roots & mask_below(t));
    uint triangle = packed_triangle(t);
    if (mask_test(roots, t)) {
      uint b = (triangle >> 8) & 255u;
      team_traversal[place & 63u] = pack4(b, b, triangle & 255u, b);
      place++;
    }
    if (mask_test(introducing, t)) team_traversal[place & 63u] = triangle;
  }
}

// Lists the inner vertices of the seams of stream s in reference order; returns their number.
uint list_seams(uint s) {
  uint count = 0u;
  for (mask64 rest = team_seam_refs[s]; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    uint length = reference_length_of(r);
    uint rank = team_references[r] & 63u;
    for (uint i = 1u + THREAD; i < length; i += WORKGROUP)
      team_seams[(count + i - 1u) & 63u] = loop_id(rank + i) | r << 8 | i << 16;
    count += length - 1u;
  }
  return min(count, 64u);
}

// Lists the positions of n ones from bit p. Each thread takes every WORKGROUP-th word. A barrier
// must follow.
void list_ones(uint p, uint n) {
  uint found = 0u;  // ones before the team's current words
  uint empty = 0u;  // zero words in a row
  for (uint w = p >> 5; found < n; w += WORKGROUP) {
    uint mine = 0u;
    uint before = found;
    for (uint k = 0u; k < WORKGROUP && found < n; k++) {
      uint word = load_word(w + k);
      if (w + k == p >> 5) word &= ~word_below(p & 31u);
      if (k == THREAD) {
        mine = word;
        before = found;
      }
      empty = word == 0u ? empty + 1u : 0u;
      found += uint(bitCount(word));
    }
    if (w >= blob_word_total || empty > (MAX_QUOTIENT >> 5) + WORKGROUP) {
      error = ERROR_UNARY;
      return;
    }
    for (; mine != 0u && before < n; before++) {
      ATOMIC_STORE(team_scratch[before], ((w + THREAD) << 5) + uint(findLSB(mine)));
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
  for (uint item = THREAD; item < count; item += WORKGROUP) {
    uint i = n == 3u ? (item * 171u) >> 9 : n == 2u ? item >> 1 : item / n;
    uint c = item - i * n;
    uint id = (i < seams ? team_seams[i & 63u] : team_traversal[(i - seams) & 63u] >> 16) & 63u;
    uint residual;
    if (code == CODE_FIXED) {
      residual =
          load_bits(low + i * step + fixed_width(c, widths), width_field(widths + WIDTH_BITS * c));
    } else {
      uint from = item == 0u ? unary_begin : ATOMIC_LOAD(team_scratch[ones + item - 1u]) + 1u;
      uint quotient = ATOMIC_LOAD(team_scratch[ones + item]) - from;
      if (quotient > MAX_QUOTIENT) error = ERROR_UNARY;
      uint at = low + item * (code & 31u) + (is_exponential(code) ? from - unary_begin - item : 0u);
      residual = coded_value(code, quotient, at);
    }
    team_values[value_element(s, c) + id] = unzigzag(residual);
  }
}

// A stream's interior code, and the bit position of its widths if it is fixed.
uint interior_code_of(uint s) { return team_codes[s] & 255u; }
uint interior_widths_of(uint s) { return team_codes_begin + (team_codes[s] >> 8); }

// Reads the interior's codes; those of all streams begin at bit p. A barrier must follow.
void read_interior_codes(uint p, bool chains) {
  team_codes_begin = p;
  for (uint s = 0u; s < stream_total; s++) {
    if (chains) code_at(p, s, true);
    uint code = code_at(p, s, false);
    uint widths = p - WIDTH_BITS * stream_field(s, STREAM_ELEMENTS) - team_codes_begin;
    if (THREAD == 0u) team_codes[s] = code | widths << 8;
  }
}

// Number of unary parts of the interior's streams [begin, end).
uint interior_ones(uint begin, uint end) {
  uint ones = 0u;
  for (uint s = begin; s < end; s++)
    if (interior_code_of(s) != CODE_FIXED)
      ones += (traversed_count + seam_vertices_of(s)) * stream_field(s, STREAM_ELEMENTS);
  return ones;
}

// The end of the streams from s on, before `end`, whose quotients fit the list: at least one
// stream.
uint listed_streams(uint s, uint end) {
  uint elements = 0u;
  uint next = s;
  while (next < end) {
    elements += uniform_elements(next);
    if (next > s && elements > SCRATCH_ELEMENTS) break;
    next++;
  }
  return next;
}

// Reads the interior's residuals of all decoded streams. A team that is not `sound` only takes
// part in the barriers.
void read_interior(bool sound) {
  uint p = team_interior;
  for (uint phase = 0u; phase < 2u && phase < uniform_streams(); phase++) {
    uint low = p;
    uint next_list = phase;
    uint ones = 0u;
    uint listed = 0u;
    for (uint s = phase; s < (phase == 0u ? 1u : uniform_streams()); s++) {
      uint n = stream_field(s, STREAM_ELEMENTS);
      barrier();
      if (s == next_list) {
        next_list = listed_streams(s, phase == 0u ? 1u : uniform_streams());
        ones = sound ? min(interior_ones(s, next_list), SCRATCH_WORDS) : 0u;
        listed = 0u;
        if (sound) list_ones(p, ones);
        barrier();
        // The low bits begin after the unary parts of all streams.
        if (s == phase && sound)
          low = after_ones(ones > 0u ? ATOMIC_LOAD(team_scratch[ones - 1u]) + 1u : p,
                           interior_ones(next_list, phase == 0u ? 1u : stream_total));
      }
      uint code = interior_code_of(s);
      uint widths = interior_widths_of(s);
      uint seams = sound ? list_seams(s) : 0u;
      uint count = sound && error == ERROR_NONE ? min(seams + traversed_count, 64u) * n : 0u;
      if (code != CODE_FIXED) count = min(count, ones - listed);
      barrier();
      read_interior_residuals(s, code, widths, low, seams, count, listed, p);
      uint next = p;
      if (code != CODE_FIXED && count > 0u) {
        listed += count;
        next = ATOMIC_LOAD(team_scratch[listed - 1u]) + 1u;
      }
      low += low_size(code, n, widths, count, next - p - count);
      p = next;
    }
    if (sound && max(p, low) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
    p = low;
  }
  barrier();
}

// --- predictions ---

// Places of the vertices of reference r in the owner's direction: 0 is its first corner.
uint run_id(HEADER_IN h, uint r, bool backwards, uint i) {
  uint length = reference_length_of(r);
  uint place = backwards ? length - i : i;
  if (place == length) return first_id(next_reference(h, r));
  return loop_id((team_references[r & 63u] & 63u) + place);
}

// Shared foreign chains run in their owner's direction; seams run in this meshlet's.
bool runs_backwards(HEADER_IN h, uint r, uint s) {
  return mask_test(h.foreign_refs & ~team_seam_refs[s], r);
}

// A step of AFFINE's prediction, as in serial_decoder.glsl's chain_step: v | a << 8 | b << 16 |
// o << 24. Of the boundary vertex with rank `item`, if it lies inside a chain of stream s.
bool chain_step_of(HEADER_IN h, uint s, uint item, out uint step) {
  uint r = (mask_count(team_ranks & mask_below(item + 1u)) - 1u) & 63u;
  uint length = reference_length_of(r);
  bool backwards = runs_backwards(h, r, s);
  uint i = item - (team_references[r] & 63u);
  step = NO_VERTEX << 24;
  if (i == 0u || i >= length || mask_test(h.private_refs, r)) return false;
  if (backwards) i = length - i;
  step =
      pack4(run_id(h, r, backwards, i), run_id(h, r, backwards, i - 1u),
            run_id(h, r, backwards, length), i < 2u ? NO_VERTEX : run_id(h, r, backwards, i - 2u));
  return true;
}

// AFFINE's weights into team_seams: of the inner vertices of stream s's chains by rank, or of the
// traversed vertices in order.
void find_weights(HEADER_IN h, uint s, bool chains) {
  uint items = chains ? (h.references > 0u ? mask_count(team_boundary) : 0u) : traversed_count;
  for (uint item = THREAD; item < items; item += WORKGROUP) {
    uint triangle = team_traversal[item & 63u];
    uint step = ((triangle >> 16) & 255u) | (triangle & 0xFFFFu) << 8 | (triangle & 0xFF000000u);
    if (chains && !chain_step_of(h, s, item, step)) continue;
    Weights w;
    w.exist = false;
    uint v = step & 63u;
    uint a = (step >> 8) & 63u;
    uint b = (step >> 16) & 63u;
    if (step >> 24 != NO_VERTEX) w = affine_weights(a, b, (step >> 24) & 63u, v);
    if (chains && !w.exist) w = line_weights(a, b, v);
    team_seams[item & 63u] = pack_weights(w);
  }
}

// The decoded stream that an element of the values belongs to, and the element's number in it.
uvec2 stream_of_element(uint element) {
  uint s = 0u;
  for (uint next = 1u; next < stream_end; next++)
    if (element >= stream_field(next, STREAM_ELEMENT)) s = next;
  return uvec2(s, element - stream_field(s, STREAM_ELEMENT));
}

uint element_total() {
  return min(stream_field(stream_end - 1u, STREAM_ELEMENT) +
                 stream_field(stream_end - 1u, STREAM_ELEMENTS),
             MAX_ELEMENTS);
}

// Turns residuals of the inner vertices of reference r into values, for one element of stream s.
void predict_chain(HEADER_IN h, uint r, uint s, uint element) {
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  uint base = min(element, MAX_ELEMENTS - 1u) * 64u;
  uint mask = bits_mask(s);
  uint length = reference_length_of(r);
  bool backwards = runs_backwards(h, r, s);
  uint rank = team_references[r & 63u] & 63u;
  uint to = first_id(next_reference(h, r));
  uint prev = team_values[base + (backwards ? to : loop_id(rank))];
  uint last = team_values[base + (backwards ? loop_id(rank) : to)];
  uint before = prev;
  for (uint left = length; left > 1u; left--) {
    uint place = rank + (backwards ? left - 1u : length + 1u - left);
    uint v = base + loop_id(place);
    uint weights = predictor == PREDICT_AFFINE ? team_seams[place & 63u] : 0u;
    uint point = prev;
    if (weights != 0u)
      point = affine_point(unpack_weights(weights), prev, last, before);
    else if (predictor != PREDICT_COPY)
      point = toward(prev, last, left);
    before = prev;
    prev = (point + team_values[v]) & mask;
    team_values[v] = prev;
  }
}

// Predicts the chains of AFFINE stream s, or with s = MAX_STREAMS those of all other streams, a
// thread for each element of each reference. only_seams: of seams.
void predict_chains(HEADER_IN h, uint s, bool only_seams) {
  bool one = s < MAX_STREAMS;
  uint first = one ? stream_field(s, STREAM_ELEMENT) : 0u;
  uint elements = max(one ? stream_field(s, STREAM_ELEMENTS) : element_total(), 1u);
  for (uint item = THREAD; item < h.references * elements; item += WORKGROUP) {
    uint r = item / elements;
    uint element = first + item - r * elements;
    uint of = one ? s : stream_of_element(element).x;
    if (mask_test(h.private_refs, r)) continue;
    if (!one && stream_field(of, STREAM_PREDICTOR) == PREDICT_AFFINE) continue;
    if (only_seams && !mask_test(team_seam_refs[of], r)) continue;
    predict_chain(h, r, of, element);
  }
}

// Adds the predictions to the residuals of the traversed vertices, for one element. The predictors
// are (u (a + w b) + x o + y) >> z with constants of the stream; without a triangle across the
// gate, u = 1 and x = y = 0. AFFINE without weights falls back to PARALLELOGRAM.
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
  for (uint i = 0u; i < traversed_count; i++) {
    uint triangle = team_traversal[i];
    uint v = element + bitfieldExtract(triangle, 16, 6);
    uint residual = team_values[v];
    uint a = team_values[element + (triangle & 63u)];
    uint b = team_values[element + bitfieldExtract(triangle, 8, 6)];
    uint o = team_values[element + bitfieldExtract(triangle, 24, 6)];
    uint sum = copies ? a : a + b;
    bool across = uses_o && triangle < NO_VERTEX << 24;
    uint point = across ? factor * sum + factor_o * o + rounding : sum;
    point = uint(int(point) >> (across ? shift : shift_mean));
    if (affine) {
      uint weights = team_seams[i];
      if (weights != 0u) point = affine_point(unpack_weights(weights), a, b, o);
    }
    team_values[v] = (point + residual) & bits;
  }
}

// Sums the triangles' cross products at their vertices in the scratch memory.
void sum_team_normals(bool sound) {
  for (uint i = THREAD; i < 192u; i += WORKGROUP) ATOMIC_STORE(team_scratch[i], 0u);
  barrier();
  for (uint t = THREAD; t < triangle_count && sound; t += WORKGROUP) {
    uint triangle = packed_triangle(t);
    Triple normal = triangle_normal(triangle, geo_shift());
    for (uint corner = 0u; corner < 3u; corner++) {
      uint place = 3u * ((triangle >> (8u * corner)) & 63u);
      ATOMIC_ADD(team_scratch[place], normal.x);
      ATOMIC_ADD(team_scratch[place + 1u], normal.y);
      ATOMIC_ADD(team_scratch[place + 2u], normal.z);
    }
  }
  barrier();
}

// Adds the predictions of GEO to the residuals of stream s.
void predict_team_geo(uint s) {
  for (uint i = THREAD; i < traversed_count; i += WORKGROUP) {
    uint id = bitfieldExtract(team_traversal[i], 16, 6);
    uint place = 3u * id;
    OctPair point = octahedral_prediction(
        ATOMIC_LOAD(team_scratch[place]), ATOMIC_LOAD(team_scratch[place + 1u]),
        ATOMIC_LOAD(team_scratch[place + 2u]), stream_field(s, STREAM_BITS) & 31u);
    for (uint c = 0u; c < 2u; c++) {
      uint v = value_element(s, c) + id;
      team_values[v] = ((c == 0u ? point.u : point.v) + team_values[v]) & bits_mask(s);
    }
  }
}

// Turns all residuals into values. AFFINE and GEO depend on stream 0, so first the chains of other
// streams, then those of each AFFINE stream, then the traversed vertices of streams that depend on
// no other, then all others. only_seams: other chains have their values. has_chains: false if no
// team of the workgroup has chains to predict. A team that is not `sound` only takes part in the
// barriers.
void predict(HEADER_IN h, bool sound, bool only_seams, bool has_chains) {
  bool geo = any_stream_predicts(1u << PREDICT_GEO);
  bool affine = any_stream_predicts(1u << PREDICT_AFFINE);
  uint traversal = uniform_streams() + 1u;  // the steps before it are those of chains
  uint last = geo || affine ? traversal + 1u : traversal;
  // All teams of a workgroup take the same steps.
  for (uint step = has_chains ? 0u : traversal; step <= last; step++) {
    bool chains = step < traversal;
    uint s = chains && step > 0u ? step - 1u : MAX_STREAMS;
    if (s < MAX_STREAMS && uniform_predictor(s) != PREDICT_AFFINE) continue;
    barrier();
    bool after = step > traversal;
    if (after && geo) sum_team_normals(sound);
    for (uint of = 0u; of < stream_end && after && sound; of++)
      if (stream_field(of, STREAM_PREDICTOR) == PREDICT_GEO) predict_team_geo(of);
    if (after ? affine : s < MAX_STREAMS) {
      if (sound) find_weights(h, s, chains);
      barrier();
    }
    if (chains && sound) predict_chains(h, s, only_seams);
    for (uint element = THREAD; element < element_total() && !chains && sound;
         element += WORKGROUP) {
      uvec2 of = stream_of_element(element);
      uint predictor = stream_field(of.x, STREAM_PREDICTOR);
      if (after ? predictor == PREDICT_AFFINE : predictor < PREDICT_GEO)
        predict_element(of.x, of.y);
    }
  }
}

#endif

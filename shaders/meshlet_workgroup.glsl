// The cooperative decoder: one workgroup of GROUP lanes decodes one meshlet (spec, appendix A). Every value has a lane that finds its
// bits alone; only the traversal of the interior is a chain, which a lane per component walks.
//
// The includer has included meshlet_decoder_prologue.glsl, meshlet_decoder.glsl and meshlet_decoder_epilogue.glsl, whose header and mask functions
// are used here, has a workgroup of GROUP invocations, and calls open_blob, then group_streams(end) once, then group_decode(m).
// Results, for all lanes: group_error, triangle_count, vertex_count, group_triangles[t] (packed as in meshlet_decoder.glsl), and
// group_values[lane * 64 + local id].
// Hostile bytes: every subscript is masked or bounded by a checked count, every loop by 64, by the streams, or by the blob's end.

#define GROUP 32u
#define LANE gl_LocalInvocationIndex

shared uint group_error;
shared uint group_triangles[64];
shared uint group_values[MAX_LANES * 64u];
shared uint group_stream[MAX_STREAMS];     // see stream_field
shared uint scratch[256];                  // places of quotients' ends

#define SHARED shared
#define OR_MASK(target, mask) (atomicOr((target).x, (mask).x), atomicOr((target).y, (mask).y))
#define ADD(target, value) atomicAdd(target, value)
#define TRIANGLES group_triangles
#include "parallel_connectivity.glsl"

// ---- streams -------------------------------------------------------------------------------------------------------------------

#define STREAM_COMPONENTS 0, 3             // offset and width of fields in group_stream
#define STREAM_BITS 3, 6
#define STREAM_PREDICTOR 9, 2
#define STREAM_CHAIN_BASE 11, 5
#define STREAM_INTERIOR_BASE 16, 5
#define STREAM_LANE 21, 11
#define stream_field(s, field) bitfieldExtract(group_stream[s], field)

// Reads the stream table; streams [0, end) are decoded.
void group_streams(uint end) {
  stream_total = min((load_word(1u) >> 8) & 255u, MAX_STREAMS);
  stream_end = min(end, stream_total);
  meshlet_total = load_word(4u);
  byte_length = load_word(5u);
  data_offset = load_word(6u);
  group_table = 8u + 7u * stream_total;
  directory = group_table + 2u * ((meshlet_total + 31u) >> 5);
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

// ---- places of a meshlet's data for one stream (sections C to F) -------------------------------------------------------------------

struct Place {
  uint anchors;          // bit position of the first anchor,
  uint chain_code;       // Rice parameter or CODE_FIXED,
  uint chain_widths;     //   the widths of a fixed code,
  uint chain_low;        //   low bits of the first chain vertex,
  uint chain_unary;      // section F,
  uint chain_skipped;    //   and the quotients of earlier streams in it
  uint chain_total;      // inner vertices of all owned references
};

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

uint fixed_bits(uint widths, uint components) {
  uint sum = 0u;
  for (uint c = 0u; c < components; c++) sum += width_field(widths + 5u * c);
  return sum;
}

uint anchors_of(HEADER_IN h, uint s, uint loops) {
  return h.references == 0u ? loops : mask_count(stored_corners(h, seam_references(h, s)));
}

// `loops`: the meshlet's number of components, needed only where it has no references.
Place find_place(HEADER_IN h, uint stream, uint loops) {
  Place place = Place(0u, 0u, 0u, 0u, 0u, 0u, 0u);
  bool chains = mask_any(h.owned_refs);
  uint p = h.codes;
  uint low_before = 0u;                    // of the chains, per vertex
  uint low_all = 0u;
  for (uint s = 0u; s < stream_total; s++) {
    uint components = stream_field(s, STREAM_COMPONENTS);
    if (s == stream) low_before = low_all;
    if (chains) {
      uint widths = p + 3u;
      uint code = code_at(p, components, stream_field(s, STREAM_CHAIN_BASE));
      if (s < stream && code != CODE_FIXED) place.chain_skipped += components;
      if (s == stream) {
        place.chain_code = code;
        place.chain_widths = widths;
      }
      low_all += code == CODE_FIXED ? fixed_bits(widths, components) : code * components;
    }
    code_at(p, components, stream_field(s, STREAM_INTERIOR_BASE));
  }
  uint lengths = h.lengths;
  for (mask64 rest = h.sized_refs; mask_any(rest); rest = mask_clear_lsb(rest)) {
    if (mask_test(h.owned_refs, mask_lsb(rest))) place.chain_total += load_bits(lengths, h.length_width);
    lengths += h.length_width;
  }
  bool alike = (h.flags & FLAG_SEAMS) == 0u;
  uint count = anchors_of(h, 0u, loops);
  for (uint s = 0u; s < stream_total; s++) {
    uint bits = stream_field(s, STREAM_COMPONENTS) * stream_field(s, STREAM_BITS);
    if (s == stream) place.anchors = p;
    if (!alike && s > 0u) count = anchors_of(h, s, loops);
    if (count > 0u) p += bits;
    if (count > 1u) p += 5u + (count - 1u) * stream_field(s, STREAM_COMPONENTS) * width_field(p);
  }
  place.chain_low = p + place.chain_total * low_before;
  place.chain_unary = p + place.chain_total * low_all;
  place.chain_skipped *= place.chain_total;
  return place;
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

// ---- components, references --------------------------------------------------------------------------------------------------------

shared uint component_begin[65];           // first local id of a component; one more at the end
shared uint loop_ids[64];                  // boundary ids in loop order
shared uint reference_place[64];           // rank in loop_ids | length << 8
shared mask64 waiting_ids;                 // inner vertices of private references
shared uint first_apex[64];                // triangle that first has a waiting id as its apex
shared uint traversal[64];                 // packed triangles that introduce a vertex
shared uint seam_ids[64];                  // inner vertices of a stream's seams: v | r << 8

mask64 group_boundary;
uint group_components;

void find_components() {
  group_components = min(components_of_symbols(), 64u);
  for (uint t = LANE; t < triangle_count; t += GROUP) {
    if (t > 0u && !mask_test(closing_ends, t - 1u)) continue;
    mask64 before = mask_below(t);
    uint component = mask_count(closing_ends & before);
    uint ids = mask_count((symbol_r | symbol_e) & before) + mask_count(symbol_e & before) +
               mask_count(before & ~(symbol_r | symbol_e | symbol_c | symbol_s)) + component;
    component_begin[min(component, 64u)] = min(ids, 64u);
  }
  vertex_count = mask_count(symbol_r | symbol_e) + mask_count(symbol_e) +
                 mask_count(mask_below(triangle_count) & ~(symbol_r | symbol_e | symbol_c | symbol_s)) + group_components;
  if (vertex_count > 64u) {
    error = ERROR_VERTICES;
    vertex_count = 64u;
  }
  component_begin[group_components] = vertex_count;
  group_boundary = mask_below(vertex_count) & ~interior_ids;
  for (uint id = LANE; id < vertex_count; id += GROUP)
    if (mask_test(group_boundary, id)) loop_ids[mask_count(group_boundary & mask_below(id))] = id;
}

mask64 component_ids(uint component) {
  return mask_below(component_begin[component + 1u]) & ~mask_below(component_begin[component]);
}

// Owner and slot of foreign reference r of h, and the owner's header; `reference` is the owned one that the slot names.
Header owner_header(HEADER_IN h, uint r, out uint reference) {
  uint entry = entry_position(h, r);
  Header owner = read_header(entry_owner(h, entry));
  reference = slot_reference(owner, entry_slot(h, entry)) & 63u;
  return owner;
}

uint length_of_reference(HEADER_IN h, uint r) {
  if (mask_test(h.foreign_refs, r)) {
    uint reference;
    Header owner = owner_header(h, r, reference);
    return error == ERROR_NONE ? stored_length(owner, reference) : 1u;
  }
  if (mask_test(h.sized_refs, r)) return stored_length(h, r);
  uint component = min(mask_count(h.loop_ends & mask_below(r)), group_components - 1u);
  return mask_count(group_boundary & component_ids(component));
}

void place_group_references(HEADER_IN h) {
  if (LANE == 0u) waiting_ids = mask_none();
  for (uint r = LANE; r < h.references; r += GROUP) reference_place[r] = length_of_reference(h, r) << 8;
  barrier();
  if (h.references > 0u && mask_count(h.loop_ends) != group_components) error = ERROR_REFERENCES;
  for (uint r = LANE; r < h.references; r += GROUP) {
    uint rank = 0u;
    for (uint before = 0u; before < r; before++) rank += reference_place[before] >> 8;
    uint length = reference_place[r] >> 8;
    uint component = min(mask_count(h.loop_ends & mask_below(r)), group_components - 1u);
    uint begin = mask_count(group_boundary & mask_below(component_begin[component]));
    uint end = mask_count(group_boundary & mask_below(component_begin[component + 1u]));
    if (r == loop_begin(h, r) && rank != begin) error = ERROR_REFERENCES;
    if (mask_test(h.loop_ends, r) ? rank + length != end : rank + length > end) error = ERROR_REFERENCES;
    scratch[r] = rank & 63u;
  }
  barrier();
  for (uint r = LANE; r < h.references; r += GROUP) {
    reference_place[r] = scratch[r] | min(reference_place[r] >> 8, 64u) << 8;
    if (!mask_test(h.private_refs, r)) continue;
    mask64 inner = mask_none();
    for (uint i = 1u; i < reference_place[r] >> 8; i++) inner = inner | mask_bit(loop_ids[(scratch[r] + i) & 63u]);
    OR_MASK(waiting_ids, inner);
  }
  if (h.references == 0u && LANE == 0u) {
    mask64 firsts = mask_none();
    for (uint i = 0u; i < group_components; i++) firsts = firsts | mask_bit(component_begin[i] & 63u);
    waiting_ids = group_boundary & ~firsts;
  }
  barrier();
}

// The vertices that a reference joins: its first one, and the first one of the next.
uint first_id(uint r) { return loop_ids[reference_place[r] & 63u] & 63u; }

// ---- corners -----------------------------------------------------------------------------------------------------------------------

// Value of corner j of meshlet h for stream s, into the vertex `id` (spec, A.7).
void read_corner(Header h, uint j, uint s, uint id) {
  uint index = j;
  mask64 stored = mask_none();
  bool found = h.references == 0u;
  for (uint hop = 0u; hop <= MAX_HOPS && !found; hop++) {
    mask64 seams = seam_references(h, s);
    mask64 shared_refs = h.foreign_refs & ~seams;
    uint before = previous_reference(h, j) & 63u;
    bool from_j = mask_test(shared_refs, j);
    bool from_before = mask_test(shared_refs, before);
    found = !from_j && !from_before;
    if (found) {
      stored = stored_corners(h, seams);
      index = mask_count(stored & mask_below(j));
    } else {
      if (from_j && from_before)
        from_j = entry_owner(h, entry_position(h, before)) >= entry_owner(h, entry_position(h, j));
      uint reference;
      Header owner = owner_header(h, from_j ? j : before, reference);
      j = from_j ? next_reference(owner, reference) & 63u : reference;
      h = owner;
    }
    if (error != ERROR_NONE) return;
  }
  if (!found) {
    error = ERROR_HOPS;
    return;
  }
  uint p = find_place(h, s, group_components).anchors;
  uint n = stream_field(s, STREAM_COMPONENTS);
  uint bits = stream_field(s, STREAM_BITS);
  uint width = index > 0u ? width_field(p + n * bits) : 0u;
  uint deltas = p + n * bits + 5u + (index - 1u) * n * width;
  for (uint c = 0u; c < n; c++) {
    uint value = load_bits(p + c * bits, bits);
    if (index > 0u) value += unzigzag(load_bits(deltas + c * width, width));
    group_values[value_lane(s, c) + id] = value & bits_mask(s);
  }
}

void read_corners(HEADER_IN h) {
  uint corners = h.references == 0u ? group_components : h.references;
  for (uint item = LANE; item < corners * stream_end; item += GROUP) {
    uint j = item / stream_end;
    uint id = h.references == 0u ? component_begin[j] & 63u : first_id(j);
    read_corner(h, j, item - j * stream_end, id);
  }
  barrier();
}

// ---- chains ------------------------------------------------------------------------------------------------------------------------

// Inner vertices of reference r for stream s, where it is owned or shares s: the owner's residuals on the chord between the corners.
void read_chain(HEADER_IN h, uint r, uint s) {
  bool foreign = mask_test(h.foreign_refs, r);
  uint length = reference_place[r] >> 8;
  if (mask_test(h.private_refs, r) || (foreign && mask_test(seam_references(h, s), r)) || length < 2u) return;
  Header owner = h;
  uint reference = r;
  if (foreign) owner = owner_header(h, r, reference);
  if (error != ERROR_NONE) return;
  Place place = find_place(owner, s, 0u);
  uint first = 0u;
  for (mask64 rest = owner.owned_refs & mask_below(reference); mask_any(rest); rest = mask_clear_lsb(rest))
    first += stored_length(owner, mask_lsb(rest)) - 1u;

  uint n = stream_field(s, STREAM_COMPONENTS);
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  bool rice = place.chain_code != CODE_FIXED;
  uint step = rice ? place.chain_code * n : fixed_bits(place.chain_widths, n);
  uint low = place.chain_low + first * step;
  if (rice) unary = seek_unary(after_ones(place.chain_unary, place.chain_skipped + first * n));
  uint rank = reference_place[r] & 63u;
  uint from = loop_ids[rank] & 63u;
  uint to = first_id(next_reference(h, r) & 63u);
  for (uint i = 1u; i < length && error == ERROR_NONE; i++) {
    uint id = loop_ids[(rank + (foreign ? length - i : i)) & 63u] & 63u;
    for (uint c = 0u; c < n; c++) {
      uint lane = value_lane(s, c);
      uint width = rice ? place.chain_code : width_field(place.chain_widths + 5u * c);
      uint residual = load_bits(low, width);
      if (rice) residual |= next_quotient(unary) << width;
      low += width;
      uint a = group_values[lane + (foreign ? to : from)];
      uint b = group_values[lane + (foreign ? from : to)];
      uint point = predictor == PREDICT_COPY ? a : chord_point(a, b, i, length);
      group_values[lane + id] = (point + unzigzag(residual)) & bits_mask(s);
    }
  }
  if (max(low, unary.cursor) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

void read_chains(HEADER_IN h) {
  for (uint item = LANE; item < h.references * stream_end; item += GROUP) {
    uint r = item / stream_end;
    read_chain(h, r, item - r * stream_end);
  }
  barrier();
}

// ---- interior ----------------------------------------------------------------------------------------------------------------------

// Lists the triangles that introduce a vertex, in order (spec, A.7, "Traversed vertices").
void list_traversal() {
  traversed_count = mask_count(symbol_c);
  mask64 waiting = waiting_ids;
  if (!mask_any(waiting)) {
    for (uint t = LANE; t < triangle_count; t += GROUP)
      if (mask_test(symbol_c, t)) traversal[mask_count(symbol_c & mask_below(t))] = group_triangles[t];
    barrier();
    return;
  }
  for (uint i = LANE; i < 64u; i += GROUP) first_apex[i] = 64u;
  barrier();
  // A root gate's a comes before all triangles of its component.
  mask64 roots = mask_none();              // triangles whose gate introduces a
  mask64 starts = (mask_shl1(closing_ends) | mask_bit(0u)) & mask_below(triangle_count);
  for (mask64 rest = starts; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint t = mask_lsb(rest);
    uint a = group_triangles[t] & 63u;
    if (mask_test(waiting, a)) {
      roots = roots | mask_bit(t);
      waiting = waiting & ~mask_bit(a);
    }
  }
  for (uint t = LANE; t < triangle_count; t += GROUP) {
    uint v = (group_triangles[t] >> 16) & 63u;
    if (mask_test(waiting, v)) atomicMin(first_apex[v], t);
  }
  barrier();
  mask64 introducing = symbol_c;
  for (mask64 rest = waiting; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint t = first_apex[mask_lsb(rest)];
    if (t < 64u) introducing = introducing | mask_bit(t);
    else error = ERROR_CLERS;
  }
  traversed_count = mask_count(introducing) + mask_count(roots);
  if (traversed_count > 64u) {
    error = ERROR_CLERS;
    traversed_count = 0u;
  }
  for (uint t = LANE; t < triangle_count; t += GROUP) {
    uint place = mask_count(introducing & mask_below(t)) + mask_count(roots & mask_below(t));
    uint triangle = group_triangles[t];
    if (mask_test(roots, t)) {
      uint b = (triangle >> 8) & 255u;
      traversal[place & 63u] = pack4(b, b, triangle & 255u, b);
      place++;
    }
    if (mask_test(introducing, t)) traversal[place & 63u] = triangle;
  }
  barrier();
}

// Lists the inner vertices of the seams of stream s in reference order; returns their number.
uint list_seams(HEADER_IN h, uint s) {
  uint count = 0u;
  for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    uint length = reference_place[r] >> 8;
    for (uint i = 1u + LANE; i < length; i += GROUP) seam_ids[(count + i - 1u) & 63u] = loop_ids[((reference_place[r] & 63u) + i) & 63u] | r << 8 | i << 16;
    count += length - 1u;
  }
  barrier();
  return min(count, 64u);
}

// The places of the next n ones from bit p on, into `scratch`; returns the bit after the last. n <= 256.
uint list_ones(uint p, uint n) {
  uint found = 0u;
  uint empty = 0u;
  uint last = p;
  for (uint w = p >> 5; found < n; w++) {
    uint word = load_word(w);
    if (w == p >> 5) word &= ~word_below(p & 31u);
    empty = word == 0u ? empty + 1u : 0u;
    if (w >= blob_word_total || empty > (MAX_QUOTIENT >> 5) + 1u) {
      error = ERROR_UNARY;
      break;
    }
    for (uint i = LANE; i < 32u; i += GROUP) {
      uint rank = found + uint(bitCount(word & word_below(i)));
      if ((word >> i & 1u) != 0u && rank < n) scratch[rank] = (w << 5) + i;
    }
    found += uint(bitCount(word));
    last = w;
  }
  barrier();
  return error == ERROR_NONE && n > 0u ? scratch[n - 1u] + 1u : p;
}

// Residuals of the seams' and the traversed vertices of stream s, into the vertices' values. p: the first quotient, moved on.
void read_interior_residuals(uint s, uint code, uint widths, uint low, uint seams, inout uint p) {
  uint n = stream_field(s, STREAM_COMPONENTS);
  uint count = min((seams + traversed_count) * n, 256u);
  bool rice = code != CODE_FIXED;
  uint begin = p;
  if (rice) p = list_ones(p, count);
  uint step = rice ? code * n : fixed_bits(widths, n);
  for (uint item = LANE; item < count; item += GROUP) {
    uint i = n == 3u ? (item * 171u) >> 9 : n == 2u ? item >> 1 : item / n;
    uint c = item - i * n;
    uint id = i < seams ? seam_ids[i] & 63u : (traversal[i - seams] >> 16) & 63u;
    uint residual;
    if (rice) {
      uint before = item == 0u ? begin : scratch[item - 1u] + 1u;
      uint quotient = scratch[item] - before;
      if (quotient > MAX_QUOTIENT) error = ERROR_UNARY;
      residual = load_bits(low + item * code, code) | quotient << code;
    } else {
      uint at = low + i * step;
      for (uint k = 0u; k < c; k++) at += width_field(widths + 5u * k);
      residual = load_bits(at, width_field(widths + 5u * c));
    }
    group_values[value_lane(s, c) + id] = unzigzag(residual);
  }
  barrier();
}

// Adds the chord to the seams' residuals.
void predict_seams(HEADER_IN h, uint s, uint seams) {
  uint n = stream_field(s, STREAM_COMPONENTS);
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  for (uint item = LANE; item < seams; item += GROUP) {
    uint seam = seam_ids[item];
    uint r = (seam >> 8) & 63u;
    for (uint c = 0u; c < n; c++) {
      uint lane = value_lane(s, c);
      uint a = group_values[lane + first_id(r)];
      uint b = group_values[lane + first_id(next_reference(h, r) & 63u)];
      uint point = predictor == PREDICT_COPY ? a : chord_point(a, b, seam >> 16, reference_place[r] >> 8);
      group_values[lane + (seam & 63u)] = (point + group_values[lane + (seam & 63u)]) & bits_mask(s);
    }
  }
}

// Adds the predictions to the residuals of the traversed vertices, one lane of the workgroup per component of a stream.
void predict_traversal() {
  barrier();
  for (uint s = 0u; s < stream_end; s++) {
    uint c = LANE - stream_field(s, STREAM_LANE);
    if (c >= stream_field(s, STREAM_COMPONENTS)) continue;
    uint predictor = stream_field(s, STREAM_PREDICTOR);
    uint bits = bits_mask(s);
    uint lane = value_lane(s, c);
    for (uint i = 0u; i < traversed_count; i++) {
      uint triangle = traversal[i];
      uint a = group_values[lane + (triangle & 63u)];
      uint b = group_values[lane + ((triangle >> 8) & 63u)];
      uint o = group_values[lane + ((triangle >> 24) & 63u)];
      bool across = triangle >> 24 != NO_VERTEX;
      uint sum = a + b;
      uint point = sum >> 1;
      if (predictor == PREDICT_COPY) point = a;
      else if (predictor == PREDICT_PARALLELOGRAM && across) point = sum - o;
      else if (predictor == PREDICT_DAMPED && across) point = uint(int(3u * sum - 2u * o + 2u) >> 2);
      uint v = lane + ((triangle >> 16) & 63u);
      group_values[v] = (point + group_values[v]) & bits;
    }
  }
}

// Sections G and H.
void decode_group_interior(HEADER_IN h) {
  list_traversal();
  Place place = find_place(h, 0u, group_components);
  // Where section F ends: after the quotients of all chains.
  bool chains = mask_any(h.owned_refs);
  uint p = h.codes;
  uint quotients = 0u;
  uint low_bits_total = 0u;
  for (uint s = 0u; s < stream_total; s++) {
    uint n = stream_field(s, STREAM_COMPONENTS);
    if (chains && code_at(p, n, stream_field(s, STREAM_CHAIN_BASE)) != CODE_FIXED) quotients += n;
    uint widths = p + 3u;
    uint code = code_at(p, n, stream_field(s, STREAM_INTERIOR_BASE));
    uint seams = s == 0u || (h.flags & FLAG_SEAMS) == 0u ? 0u : list_seams(h, s);
    low_bits_total += (traversed_count + seams) * (code == CODE_FIXED ? fixed_bits(widths, n) : code * n);
  }
  uint low = after_ones(place.chain_unary, quotients * place.chain_total);
  uint unary_at = low + low_bits_total;
  p = h.codes;
  for (uint s = 0u; s < stream_end; s++) {
    uint n = stream_field(s, STREAM_COMPONENTS);
    if (chains) code_at(p, n, stream_field(s, STREAM_CHAIN_BASE));
    uint widths = p + 3u;
    uint code = code_at(p, n, stream_field(s, STREAM_INTERIOR_BASE));
    uint seams = s == 0u || (h.flags & FLAG_SEAMS) == 0u ? 0u : list_seams(h, s);
    read_interior_residuals(s, code, widths, low, seams, unary_at);
    predict_seams(h, s, seams);
    barrier();
    low += (traversed_count + seams) * (code == CODE_FIXED ? fixed_bits(widths, n) : code * n);
  }
  if (max(unary_at, low) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
  predict_traversal();
}

// ---- a whole meshlet ---------------------------------------------------------------------------------------------------------------

void decode_group_connectivity() {
  for (uint t = LANE; t < 64u; t += GROUP) parallel_step_0(t);
  barrier();
  for (uint t = LANE; t < 64u; t += GROUP) parallel_step_1(t);
  barrier();
  for (uint t = LANE; t < 64u; t += GROUP) parallel_step_2(t);
  barrier();
  for (uint t = LANE; t < 64u; t += GROUP) parallel_step_3(t);
  barrier();
  for (uint t = LANE; t < 64u; t += GROUP) parallel_step_4(t);
  barrier();
  for (uint t = LANE; t < 64u; t += GROUP) parallel_step_5(t);
  barrier();
  for (uint t = LANE; t < 64u; t += GROUP) parallel_step_6(t);
  barrier();
  for (uint t = LANE; t < 64u; t += GROUP) parallel_step_7(t);
  barrier();
}

// What a lane has found wrong is known to all after it. Returns whether the meshlet is sound so far.
bool agree() {
  if (error != ERROR_NONE) atomicMax(group_error, error);
  barrier();
  error = group_error;
  return error == ERROR_NONE;
}

void group_decode(uint m) {
  error = ERROR_NONE;
  if (LANE == 0u) group_error = ERROR_NONE;
  triangle_count = 0u;
  vertex_count = 0u;
  Header h = read_header(m);
  barrier();
  if (!agree()) return;
  read_symbols(h.begin, h.triangles);
  if (components_of_symbols() - 1u > 63u) error = ERROR_CLERS;
  if (agree()) decode_group_connectivity();
  if (agree()) find_components();
  if (agree()) place_group_references(h);
  if (agree()) read_corners(h);
  if (agree()) read_chains(h);
  if (agree()) decode_group_interior(h);
  if (!agree()) {
    triangle_count = 0u;
    vertex_count = 0u;
  }
}

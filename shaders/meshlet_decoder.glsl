// The single-lane meshlet decoder of EXT_meshlet_edgebreaker, written once for C++17 and GLSL (spec, appendix A).
//
// C++ includes this file inside a struct, so that its file-scope variables become members (gltf_ext/src/decoder.h); GLSL includes
// it at file scope. The includer provides, before the include:
//   small_uint                     an integer type that holds 0..255 (uint in GLSL)
//   HEADER_IN                      how a Header is passed: by value, or by reference where the language has it
//   mask64                         64 bits with & | ^ ~ (uvec2 in GLSL, x = low half), and
//   mask_none() mask_bit(i) mask_below(n <= 64) mask_test(m, i) mask_any(m) mask_count(m) mask_lsb(m) mask_msb(m) mask_shl1(m)
//                                  (mask_lsb and mask_msb of an empty mask give 64)
//   load_word(i)                   32-bit word i of the blob, 0 beyond its end
//   load_bits(p, n)                n <= 32 bits at bit p, 0 beyond the end
//   load_mask(p, n)                n <= 64 bits at bit p
//   load_inside(p, n)              the same, where the caller has made sure that the bits lie inside
//   mask_scatter(bits, m)          the lowest bits of `bits` at the places of m's ones
//   UnaryReader                    a reader of the unary planes, with its `cursor`, and
//   seek_unary(p), skip_unary(reader, n), next_quotient(reader)
//                                  past the blob's end, or after more than MAX_QUOTIENT zeros in a row, it delivers 0 and sets `error`
//   max(a, b)                      of two uints
//   FOREIGN_LENGTH(owner, slot)    read_foreign_length, or a table that holds the same
//   MAX_STREAMS, MAX_LANES         capacity: streams of the blob, and sum of their components
//
// Use: load_streams(first, end) once per blob, then decode_meshlet(m). Results: `triangle_count`, packed `triangles`,
// `vertex_count`, `values[lane * 64 + local id]`. `error` != 0 says that the meshlet is malformed; nothing else is then valid.
// Hostile bytes: every index below is bounded by a mask of 64 bits or by a count checked before use; no loop runs longer than
// 64 x MAX_LANES steps apart from the unary reader, which the includer bounds by the blob's end.

#define NO_VERTEX 255u
#define MAX_HOPS 8u
#define MAX_QUOTIENT 16383u

#define ERROR_NONE 0u
#define ERROR_OFFSET 1u        // a meshlet number or data offset lies outside the blob
#define ERROR_CLERS 2u         // the symbols do not describe disks
#define ERROR_VERTICES 3u      // more than 64 vertices
#define ERROR_REFERENCES 4u    // masks overlap, or lengths do not sum to the boundary loop
#define ERROR_OWNER 5u         // a reference leads to no owned reference of an earlier or the same meshlet
#define ERROR_HOPS 6u          // a corner needs more than MAX_HOPS hops
#define ERROR_CODE 7u          // Rice parameter above 31
#define ERROR_UNARY 8u         // data run past the end of the blob, or a quotient is above MAX_QUOTIENT

#define FLAG_LOOPS 1u
#define FLAG_PRIVATE 2u
#define FLAG_SEAMS 4u

#define PREDICT_PARALLELOGRAM 0u
#define PREDICT_MEAN 1u
#define PREDICT_COPY 2u
#define PREDICT_DAMPED 3u

#define CODE_FIXED 255u

uint error;

// ---- the blob -------------------------------------------------------------------------------------------------------------------

uint stream_total;                          // streams in the blob
uint stream_first;                          // streams [stream_first, stream_end) are decoded; the others are only skipped
uint stream_end;
uint meshlet_total;
uint byte_length;
uint data_offset;
uint group_table;                           // word index
uint directory;                             // word index
small_uint stream_components[MAX_STREAMS];
small_uint stream_predictor[MAX_STREAMS];
small_uint stream_chain_base[MAX_STREAMS];
small_uint stream_interior_base[MAX_STREAMS];
uint stream_mask[MAX_STREAMS];              // (1 << bits) - 1
small_uint stream_bits[MAX_STREAMS];
small_uint stream_lane[MAX_STREAMS];        // first lane of a decoded stream

// Reads header and stream table; the includer has checked them (validate_header), so that all tables lie inside the blob.
void load_streams(uint first, uint end) {
  stream_total = (load_word(1u) >> 8) & 255u;
  meshlet_total = load_word(4u);
  byte_length = load_word(5u);
  data_offset = load_word(6u);
  group_table = 8u + 7u * stream_total;
  directory = group_table + 2u * ((meshlet_total + 31u) >> 5);
  stream_first = first;
  stream_end = end;
  uint lane = 0u;
  for (uint s = 0u; s < stream_total; s++) {
    uint shape = load_word(8u + 7u * s);
    uint bases = load_word(9u + 7u * s);
    uint bits = (shape >> 16) & 255u;
    stream_components[s] = small_uint((shape >> 8) & 255u);
    stream_bits[s] = small_uint(bits);
    stream_mask[s] = bits >= 32u ? 0xFFFFFFFFu : (1u << bits) - 1u;
    stream_predictor[s] = small_uint(shape >> 24);
    stream_chain_base[s] = small_uint(bases & 255u);
    stream_interior_base[s] = small_uint((bases >> 8) & 255u);
    stream_lane[s] = small_uint(lane);
    if (s >= first && s < end) lane += (shape >> 8) & 255u;
  }
}

// ---- a meshlet's header and references (sections A and B) -------------------------------------------------------------------------

struct Header {
  uint meshlet;
  uint triangles;
  uint references;
  uint flags;
  uint begin;           // bit positions: section A,
  uint lengths;         //   the stored lengths,
  uint entries;         //   the foreign references' entries,
  uint codes;           //   section C
  uint length_width;
  uint delta_width;
  uint slot_width;
  uint entry_width;
  mask64 foreign_refs;
  mask64 private_refs;
  mask64 owned_refs;
  mask64 sized_refs;    // references whose length is stored
  mask64 loop_ends;
};

// References that are alone in their loop.
mask64 lone_references(mask64 loop_ends) {
  return loop_ends & (mask_shl1(loop_ends) | mask_bit(0u));
}

// The meshlet's header; sets `error` where it is malformed (the returned counts are bounded even so).
Header read_header(uint m) {
  Header h;
  uint group = group_table + 2u * (m >> 5);
  uint base = load_word(group);
  uint widths = load_word(group + 1u);
  uint entry = load_word(directory + m);
  uint offset = (entry & 0x1FFFFu) << ((widths >> 16) & 15u);
  if (m >= meshlet_total || base >= byte_length || offset >= byte_length - base ||
      data_offset >= byte_length - base - offset) {
    error = ERROR_OFFSET;
    base = 0u;
    offset = 0u;
  }
  h.meshlet = m;
  h.triangles = ((entry >> 17) & 63u) + 1u;
  h.references = (entry >> 23) & 63u;
  h.flags = entry >> 29;
  h.delta_width = widths & 31u;
  h.slot_width = (widths >> 8) & 7u;
  h.begin = 8u * (data_offset + base + offset);
  uint p = h.begin + 2u * h.triangles + mask_count(load_mask(h.begin, h.triangles) & load_mask(h.begin + h.triangles, h.triangles));
  uint r = h.references;
  mask64 all = mask_below(r);
  h.foreign_refs = mask_none();
  h.private_refs = mask_none();
  h.loop_ends = mask_none();
  h.length_width = 0u;
  if (r == 0u && h.flags != 0u) error = ERROR_REFERENCES;
  if (r > 0u) {
    h.foreign_refs = load_mask(p, r);
    p += r;
    h.loop_ends = mask_bit(r - 1u);
    if ((h.flags & FLAG_LOOPS) != 0u) {
      h.loop_ends = load_mask(p, r);
      p += r;
      if (!mask_test(h.loop_ends, r - 1u)) error = ERROR_REFERENCES;
    }
    if ((h.flags & FLAG_PRIVATE) != 0u) {
      h.private_refs = load_mask(p, r);
      p += r;
      if (mask_any(h.private_refs & h.foreign_refs)) error = ERROR_REFERENCES;
    }
    h.length_width = load_bits(p, 3u);
    p += 3u;
    if (h.length_width > 6u) error = ERROR_REFERENCES;
  }
  h.owned_refs = all & ~(h.foreign_refs | h.private_refs);
  h.sized_refs = h.owned_refs | (h.private_refs & ~lone_references(h.loop_ends));
  h.lengths = p;
  p += h.length_width * mask_count(h.sized_refs);
  h.entries = p;
  h.entry_width = h.delta_width + h.slot_width + ((h.flags & FLAG_SEAMS) != 0u ? stream_total - 1u : 0u);
  h.codes = p + h.entry_width * mask_count(h.foreign_refs);
  return h;
}

// Bit position of foreign reference r's entry: delta, slot, share bits.
uint entry_position(HEADER_IN h, uint r) {
  return h.entries + h.entry_width * mask_count(h.foreign_refs & mask_below(r));
}

// Does foreign reference r take stream s from its owner (rather than bring its own)?
bool shares(HEADER_IN h, uint r, uint s) {
  return s == 0u || (h.flags & FLAG_SEAMS) == 0u || load_bits(entry_position(h, r) + h.delta_width + h.slot_width + s - 1u, 1u) != 0u;
}

uint stored_length(HEADER_IN h, uint r) {
  return load_bits(h.lengths + h.length_width * mask_count(h.sized_refs & mask_below(r)), h.length_width) + 1u;
}

// First reference of the loop that r belongs to, and the neighbours of r in that loop.
uint loop_begin(HEADER_IN h, uint r) {
  mask64 before = h.loop_ends & mask_below(r);
  return mask_any(before) ? mask_msb(before) + 1u : 0u;
}
uint next_reference(HEADER_IN h, uint r) {
  return mask_test(h.loop_ends, r) ? loop_begin(h, r) : r + 1u;
}
uint previous_reference(HEADER_IN h, uint r) {
  return r == loop_begin(h, r) ? mask_lsb(h.loop_ends & ~mask_below(r)) : r - 1u;
}

// References that bring their own values for stream s, and the corners stored here for it: both neighbours are own.
mask64 own_references(HEADER_IN h, uint s) {
  mask64 own = mask_below(h.references) & ~h.foreign_refs;
  if ((h.flags & FLAG_SEAMS) != 0u && s > 0u)
    for (mask64 rest = h.foreign_refs; mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest)))
      if (!shares(h, mask_lsb(rest), s)) own = own | mask_bit(mask_lsb(rest));
  return own;
}
mask64 stored_corners(HEADER_IN h, uint s) {
  mask64 own = own_references(h, s);
  mask64 before = mask_shl1(own & ~h.loop_ends);     // bit j: reference j - 1 of the same loop is own
  uint first = 0u;
  for (mask64 rest = h.loop_ends; mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest))) {
    uint last = mask_lsb(rest);
    if (mask_test(own, last)) before = before | mask_bit(first);
    first = last + 1u;
  }
  return own & before;
}

// ---- a meshlet's codes and section positions (C to G) ------------------------------------------------------------------------------

small_uint chain_code[MAX_STREAMS];        // Rice parameter, or CODE_FIXED
small_uint interior_code[MAX_STREAMS];
uint chain_widths[MAX_STREAMS];            // bit position of the 5-bit widths of a fixed code
uint interior_widths[MAX_STREAMS];
uint anchor_position[MAX_STREAMS];
small_uint anchor_count[MAX_STREAMS];
uint chain_low[MAX_STREAMS];               // bit position of section E for the stream
uint chain_total;                          // inner vertices of all owned references
uint chain_unary;                          // bit position of section F

uint width_field(uint position) {
  uint w = load_bits(position, 5u);
  return w == 31u ? 32u : w;
}

uint code_cursor;                          // bit position, moved by read_code

uint read_code(uint s, uint base) {
  uint code = load_bits(code_cursor, 3u);
  code_cursor += 3u;
  if (code == 7u) {
    code_cursor += 5u * stream_components[s];
    return CODE_FIXED;
  }
  if (base + code > 31u) error = ERROR_CODE;
  return (base + code) & 31u;
}

// Low bits of one vertex of stream s under a code.
uint low_bits(uint s, uint code, uint widths) {
  if (code != CODE_FIXED) return code * stream_components[s];
  uint sum = 0u;
  for (uint c = 0u; c < stream_components[s]; c++) sum += width_field(widths + 5u * c);
  return sum;
}

// Finds all sections of the meshlet. `loops`: its number of components, needed only where it has no references.
void find_sections(HEADER_IN h, uint loops) {
  bool chains = mask_any(h.owned_refs);
  code_cursor = h.codes;
  for (uint s = 0u; s < stream_total; s++) {
    chain_code[s] = small_uint(0u);
    if (chains) {
      chain_widths[s] = code_cursor + 3u;
      chain_code[s] = small_uint(read_code(s, stream_chain_base[s]));
    }
    interior_widths[s] = code_cursor + 3u;
    interior_code[s] = small_uint(read_code(s, stream_interior_base[s]));
  }
  chain_total = 0u;
  for (mask64 rest = h.owned_refs; mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest)))
    chain_total += stored_length(h, mask_lsb(rest)) - 1u;
  uint p = code_cursor;
  uint count = loops;
  for (uint s = 0u; s < stream_total; s++) {
    if (h.references > 0u && (s == 0u || (h.flags & FLAG_SEAMS) != 0u)) count = mask_count(stored_corners(h, s));
    anchor_position[s] = p;
    anchor_count[s] = small_uint(count);
    if (count > 0u) p += stream_components[s] * stream_bits[s];
    if (count > 1u) p += 5u + (count - 1u) * stream_components[s] * width_field(p);
  }
  for (uint s = 0u; s < stream_total; s++) {
    chain_low[s] = p;
    if (chains) p += chain_total * low_bits(s, chain_code[s], chain_widths[s]);
  }
  chain_unary = p;
}

// ---- values --------------------------------------------------------------------------------------------------------------------

uint values[MAX_LANES * 64];               // values[lane * 64 + local id]

uint unzigzag(uint u) {
  return (u >> 1) ^ (0u - (u & 1u));
}

// Writes anchor `index` of every stream in [begin, end) as the value of `vertex`; find_sections has run for its meshlet.
void read_anchor(uint index, uint vertex, uint begin, uint end) {
  for (uint s = begin; s < end; s++) {
    uint p = anchor_position[s];
    uint n = stream_components[s];
    uint bits = stream_bits[s];
    uint width = index > 0u ? width_field(p + n * bits) : 0u;
    uint deltas = p + n * bits + 5u + (index - 1u) * n * width;
    for (uint c = 0u; c < n; c++) {
      uint value = load_bits(p + c * bits, bits);
      if (index > 0u) value += unzigzag(load_bits(deltas + c * width, width));
      values[(stream_lane[s] + c) * 64u + vertex] = value & stream_mask[s];
    }
  }
}

small_uint targets[64];                    // local ids that read_residuals writes to

UnaryReader unary;                         // where the next quotient is read

// Reads the residuals of stream s for the first `count` targets: low bits from bit position `low` on, quotients where the unary
// reader stands. The values are then residuals until a prediction is added.
void read_residuals(uint s, uint count, uint code, uint widths, uint low) {
  uint components = stream_components[s];
  uint lanes = stream_lane[s] * 64u;
  uint step = low_bits(s, code, widths);
  if (low + count * step > 8u * (byte_length - 8u)) { error = ERROR_UNARY; return; }
  if (code != CODE_FIXED) {
    UnaryReader reader = unary;            // a local copy stays in registers
    for (uint i = 0u; i < count; i++) {
      uint at = lanes + targets[i];
      for (uint c = 0u; c < components; c++) {
        values[at] = unzigzag((next_quotient(reader) << code) | load_inside(low, code));
        low += code;
        at += 64u;
      }
    }
    unary = reader;
  } else {
    for (uint c = 0u; c < components; c++) {
      uint width = width_field(widths + 5u * c);
      for (uint i = 0u; i < count; i++) values[lanes + targets[i] + 64u * c] = unzigzag(load_inside(low + i * step, width));
      low += width;
    }
  }
}

// ---- connectivity (section A) ----------------------------------------------------------------------------------------------------

mask64 symbol_r;
mask64 symbol_e;
mask64 symbol_c;
mask64 symbol_s;
uint triangle_count;
uint vertex_count;
uint component_count;
mask64 component_starts;                   // triangles that begin a component
mask64 boundary;                           // local ids on the boundary
small_uint apex[64];
small_uint component_first[65];            // first local id of a component; one more at the end
small_uint component_gate[64];             // the root gate's a
uint triangles[64];                        // packed local ids: gate a | b << 8 | apex v << 16 | o << 24; o: the vertex across the gate

void read_symbols(uint begin, uint count) {
  mask64 p0 = load_mask(begin, count);
  mask64 p1 = load_mask(begin + count, count);
  mask64 left_or_split = load_mask(begin + 2u * count, mask_count(p0 & p1));
  triangle_count = count;
  symbol_r = mask_below(count) & ~(p0 | p1);
  symbol_e = p0 & ~p1;
  symbol_c = p1 & ~p0;
  symbol_s = mask_scatter(left_or_split, p0 & p1);
}

// Decoder B, first half: the apex of every triangle from the symbols, with two masks in place of linked lists. A strip runs to the
// next E and pushes its vertices; then the triangles that waited for their right subtree resolve, latest first.
void decode_apexes() {
  mask64 alive = mask_none();
  mask64 pending = mask_none();
  bool fresh = true;
  uint count = 0u;                         // vertices so far
  uint t = 0u;
  component_starts = mask_none();
  component_count = 0u;
  vertex_count = 0u;
  boundary = mask_none();
  while (t < triangle_count) {
    if (fresh) {
      if (count >= 64u) { error = ERROR_VERTICES; return; }
      component_starts = component_starts | mask_bit(t);
      component_first[component_count] = small_uint(count);
      component_count++;
      alive = alive | mask_bit(count);
      count++;
    }
    fresh = true;
    mask64 ends = symbol_e & ~mask_below(t);
    if (!mask_any(ends)) { error = ERROR_CLERS; return; }
    uint q = mask_lsb(ends);
    mask64 strip = mask_below(q) & ~mask_below(t);
    mask64 pushes = strip & symbol_r;
    if (count + mask_count(pushes) + 2u > 64u) { error = ERROR_VERTICES; return; }
    pending = pending | (strip & ~symbol_r);
    for (; mask_any(pushes); pushes = pushes & ~mask_bit(mask_lsb(pushes))) {
      apex[mask_lsb(pushes)] = small_uint(count);
      alive = alive | mask_bit(count);
      count++;
    }
    apex[q] = small_uint(count);
    alive = alive | mask_bit(count) | mask_bit(count + 1u);
    count += 2u;
    t = q + 1u;
    while (mask_any(pending)) {
      uint u = mask_msb(pending);
      pending = pending & ~mask_bit(u);
      uint v = mask_msb(alive);
      if (v == 64u) { error = ERROR_CLERS; return; }
      apex[u] = small_uint(v);
      if (mask_test(symbol_c, u)) {
        alive = alive & ~mask_bit(v);
      } else if (mask_test(symbol_s, u)) {
        fresh = false;
        break;
      } else {
        if (count >= 64u) { error = ERROR_VERTICES; return; }
        alive = alive | mask_bit(count);
        count++;
      }
    }
    if (fresh) {
      uint a = mask_msb(alive);
      if (a == 64u) { error = ERROR_CLERS; return; }
      component_gate[component_count - 1u] = small_uint(a);
    }
  }
  if (!fresh) { error = ERROR_CLERS; return; }
  component_first[component_count] = small_uint(count);
  vertex_count = count;
  boundary = alive;
}

// The triangles that introduce a vertex v (interior or private), in residual order. Two special ones: o = NO_VERTEX: no triangle
// across the gate; a = NO_VERTEX: no triangle at all, v is predicted from b alone.
uint traversed_count;
uint traversed[65];                        // one more than can be: decode_triangles writes before it counts

uint pack4(uint x, uint y, uint z, uint w) {
  return x | y << 8 | z << 16 | w << 24;
}

// Decoder B, second half: all triangles in stream order, with the gate in registers. `known`: local ids that already have values.
void decode_triangles(mask64 known) {
  mask64 splits = mask_none();
  uint a = 0u;
  uint b = 0u;
  uint o = 0u;
  uint component = 0u;
  bool distinct = true;                    // the first C that pops too much, even from another component, has a == b
  traversed_count = 0u;
  for (uint t = 0u; t < triangle_count; t++) {
    if (mask_test(component_starts, t)) {
      a = component_gate[component];
      b = component_first[component];
      o = NO_VERTEX;
      component++;
      traversed[traversed_count] = pack4(NO_VERTEX, b, a, NO_VERTEX);
      traversed_count += mask_test(known, a) ? 0u : 1u;
      known = known | mask_bit(a);
    }
    uint v = apex[t];
    distinct = distinct && a != b;
    triangles[t] = pack4(a, b, v, o);
    traversed[traversed_count] = triangles[t];            // kept if new: a branch would be mispredicted often
    traversed_count += mask_test(known, v) ? 0u : 1u;
    known = known | mask_bit(v);
    bool right = mask_test(symbol_r, t);   // the next gate is (a, v) after R, (v, b) after C, L and S
    o = right ? b : a;
    b = right ? v : b;
    a = right ? a : v;
    splits = splits | (symbol_s & mask_bit(t));
    if (mask_test(symbol_e, t) && mask_any(splits)) {
      uint split = triangles[mask_msb(splits)];
      splits = splits & ~mask_bit(mask_msb(splits));
      a = split & 255u;
      o = (split >> 8) & 255u;
      b = (split >> 16) & 255u;
    }
  }
  if (!distinct || mask_count(known) != vertex_count) error = ERROR_CLERS;
}

// ---- boundaries ------------------------------------------------------------------------------------------------------------------

small_uint loop_vertex[64];                // boundary ids in loop order
small_uint reference_rank[64];             // a reference's first place in loop_vertex
small_uint reference_length[64];
small_uint reference_end[64];              // local id of a reference's last vertex
uint reference_owner[64];                  // foreign references: owner meshlet and
small_uint reference_slot[64];             //   index among its owned references

// Local id of inner vertex i (1 .. length - 1) of reference r.
uint inner_vertex(uint r, uint i) {
  return loop_vertex[reference_rank[r] + i];
}

// The owned reference in slot `slot`; 64 and `error` where there is none.
uint slot_reference(HEADER_IN h, uint slot) {
  mask64 rest = h.owned_refs;
  for (uint i = 0u; i < slot && mask_any(rest); i++) rest = rest & ~mask_bit(mask_lsb(rest));
  if (!mask_any(rest)) error = ERROR_OWNER;
  return mask_lsb(rest);
}

// Owner and slot of foreign reference r of h; the owner is the same meshlet or an earlier one.
uint entry_owner(HEADER_IN h, uint r) {
  uint delta = load_bits(entry_position(h, r), h.delta_width);
  if (delta > h.meshlet) error = ERROR_OWNER;
  return delta > h.meshlet ? 0u : h.meshlet - delta;
}
uint entry_slot(HEADER_IN h, uint r) {
  return load_bits(entry_position(h, r) + h.delta_width, h.slot_width);
}

// Length of owned reference `slot` of meshlet `owner`.
uint read_foreign_length(uint owner, uint slot) {
  Header h = read_header(owner);
  uint r = slot_reference(h, slot);
  return error == ERROR_NONE ? stored_length(h, r) : 1u;
}

// Places the references along the boundary loops.
void place_references(HEADER_IN h) {
  uint rank = 0u;
  uint r = 0u;
  mask64 rest = boundary;
  for (uint i = 0u; mask_any(rest); i++) {
    loop_vertex[i] = small_uint(mask_lsb(rest));
    rest = rest & ~mask_bit(mask_lsb(rest));
  }
  for (uint component = 0u; component < component_count; component++) {
    mask64 ids = mask_below(component_first[component + 1u]) & ~mask_below(component_first[component]);
    uint length = mask_count(boundary & ids);
    uint begin = rank;
    bool more = h.references > 0u;
    while (more) {
      if (r >= h.references || rank >= begin + length) { error = ERROR_REFERENCES; return; }
      uint n = length;
      if (mask_test(h.foreign_refs, r)) {
        reference_owner[r] = entry_owner(h, r);
        reference_slot[r] = small_uint(entry_slot(h, r));
        if (error != ERROR_NONE) return;
        n = FOREIGN_LENGTH(reference_owner[r], reference_slot[r]);
        if (error != ERROR_NONE) return;
      } else if (mask_test(h.sized_refs, r)) {
        n = stored_length(h, r);
      }
      reference_rank[r] = small_uint(rank);
      reference_length[r] = small_uint(n);
      rank += n;
      more = !mask_test(h.loop_ends, r);
      if (rank > begin + length) { error = ERROR_REFERENCES; return; }
      reference_end[r] = small_uint(more ? loop_vertex[rank & 63u] : loop_vertex[begin]);
      r++;
    }
    if (h.references > 0u && rank != begin + length) { error = ERROR_REFERENCES; return; }
    rank = begin + length;
  }
  if (r != h.references) error = ERROR_REFERENCES;
}

// Lists the inner vertices of reference r as targets from `at` on, backwards for a foreign one; returns the place after the last.
uint target_chain(uint r, bool backwards, uint at) {
  uint n = reference_length[r];
  for (uint i = 1u; i < n; i++) targets[(at + i - 1u) & 63u] = small_uint(inner_vertex(r, backwards ? n - i : i));
  return at + n - 1u;
}

// Residuals of owned reference `other` of `owner` (find_sections has run for it), for the streams that foreign reference r shares:
// the owner's first inner vertex is r's last.
void read_foreign_chain(HEADER_IN h, uint r, HEADER_IN owner, uint other) {
  uint first = 0u;
  for (mask64 rest = owner.owned_refs & mask_below(other); mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest)))
    first += stored_length(owner, mask_lsb(rest)) - 1u;
  uint count = target_chain(r, true, 0u);
  uint skipped = 0u;                       // unary codes up to the chain's next one
  unary = seek_unary(chain_unary);
  for (uint s = 0u; s < stream_end; s++) {
    uint components = stream_components[s];
    bool rice = chain_code[s] != CODE_FIXED;
    if (s >= stream_first && shares(h, r, s)) {
      if (rice) {
        skip_unary(unary, skipped + first * components);
        skipped = (chain_total - first - count) * components;
      }
      read_residuals(s, count, chain_code[s], chain_widths[s], chain_low[s] + first * low_bits(s, chain_code[s], chain_widths[s]));
    } else if (rice) {
      skipped += chain_total * components;
    }
  }
}

// Corner at the start (at_end: at the end) of owned reference `slot` of meshlet `owner`, for streams from `s` on: follows references
// to the meshlet that stores it and writes its values to `vertex`. Returns how many streams it served: all, or one where seams
// on the way may lead the streams apart.
uint fetch_corner(uint owner, uint slot, bool at_end, uint vertex, uint s, bool apart) {
  for (uint hop = 0u; hop < MAX_HOPS; hop++) {
    Header h = read_header(owner);
    uint r = slot_reference(h, slot);
    if (error != ERROR_NONE) return 1u;
    apart = apart || (h.flags & FLAG_SEAMS) != 0u;
    uint corner = at_end ? next_reference(h, r) : r;
    mask64 stored = stored_corners(h, s);
    if (mask_test(stored, corner)) {
      uint end = apart ? s + 1u : stream_end;
      find_sections(h, 0u);
      read_anchor(mask_count(stored & mask_below(corner)), vertex, s, end);
      return end - s;
    }
    uint onward = at_end ? corner : previous_reference(h, r);
    if (!mask_test(h.foreign_refs, onward) || !shares(h, onward, s)) { error = ERROR_OWNER; return 1u; }
    owner = entry_owner(h, onward);
    slot = entry_slot(h, onward);
    if (error != ERROR_NONE) return 1u;
  }
  error = ERROR_HOPS;
  return 1u;
}

// Which reference brings corner r (between r and the one before it) of stream s from elsewhere: r, the one before, or 64: stored here.
uint corner_source(HEADER_IN h, uint r, uint s) {
  uint before = previous_reference(h, r);
  bool from_r = mask_test(h.foreign_refs, r) && shares(h, r, s);
  bool from_before = mask_test(h.foreign_refs, before) && shares(h, before, s);
  if (from_r && from_before) return reference_owner[before] < reference_owner[r] ? before : r;
  return from_r ? r : from_before ? before : 64u;
}

mask64 provided_refs;                      // foreign references whose vertices the includer has already given their values

void read_foreign_corners(HEADER_IN h) {
  bool seams = (h.flags & FLAG_SEAMS) != 0u;
  for (uint r = 0u; r < h.references; r++) {
    uint vertex = loop_vertex[reference_rank[r]];
    uint s = stream_first;
    while (s < stream_end && error == ERROR_NONE) {
      uint source = corner_source(h, r, s);
      if (source == 64u || mask_test(provided_refs, source)) s = seams ? s + 1u : stream_end;
      else s += fetch_corner(reference_owner[source], reference_slot[source], source == r, vertex, s, seams);
    }
  }
}

// Prediction of inner vertex i of a chain of n edges from its ends: the point of the chord, rounded; 32 bits suffice up to 24-bit
// values (|(b - a) i| < 2^30), and the bias keeps the quotient's operands unsigned.
uint chord(uint a, uint b, uint i, uint n) {
  uint biased = (b - a) * i + (n >> 1) + (n << 25);
  return a + biased / n - (1u << 25);
}

uint chain_prediction(uint s, uint a, uint b, uint i, uint n) {
  return stream_predictor[s] == PREDICT_COPY ? a : chord(a, b, i, n);
}

// Turns the residuals of reference r's inner vertices for stream s into values. Backwards: a foreign chain is predicted in its
// owner's direction.
void add_chord(uint r, uint s, bool backwards) {
  uint n = reference_length[r];
  uint start = loop_vertex[reference_rank[r]];
  uint end = reference_end[r];
  for (uint c = 0u; c < stream_components[s]; c++) {
    uint lane = (stream_lane[s] + c) * 64u;
    uint a = values[lane + (backwards ? end : start)];
    uint b = values[lane + (backwards ? start : end)];
    for (uint i = 1u; i < n; i++) {
      uint at = lane + inner_vertex(r, backwards ? n - i : i);
      values[at] = (chain_prediction(s, a, b, i, n) + values[at]) & stream_mask[s];
    }
  }
}

// Foreign corners come first: they are the ends that foreign chains are predicted from.
void read_foreign_chains(HEADER_IN h) {
  for (mask64 rest = h.foreign_refs & ~provided_refs; mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest))) {
    uint r = mask_lsb(rest);
    if (reference_length[r] > 1u) {
      Header owner = read_header(reference_owner[r]);
      find_sections(owner, 0u);
      read_foreign_chain(h, r, owner, slot_reference(owner, reference_slot[r]));
      for (uint s = stream_first; s < stream_end; s++)
        if (shares(h, r, s)) add_chord(r, s, true);
    }
  }
}

void read_own_anchors(HEADER_IN h) {
  mask64 stored = mask_none();
  for (uint s = stream_first; s < stream_end; s++) {
    if (h.references == 0u)
      for (uint i = 0u; i < component_count; i++) read_anchor(i, component_first[i], s, s + 1u);
    else if (s == stream_first || (h.flags & FLAG_SEAMS) != 0u)
      stored = stored_corners(h, s);
    uint index = 0u;
    for (mask64 rest = stored; mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest))) {
      read_anchor(index, loop_vertex[reference_rank[mask_lsb(rest)]], s, s + 1u);
      index++;
    }
  }
}

// Residuals of the owned chains; the unary reader ends behind section F.
void read_own_chains(HEADER_IN h) {
  uint count = 0u;
  for (mask64 rest = h.owned_refs; mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest))) count = target_chain(mask_lsb(rest), false, count);
  unary = seek_unary(chain_unary);
  if (chain_total == 0u) return;
  for (uint s = 0u; s < stream_total; s++) {
    if (s >= stream_first && s < stream_end) read_residuals(s, count, chain_code[s], chain_widths[s], chain_low[s]);
    else if (chain_code[s] != CODE_FIXED) skip_unary(unary, count * stream_components[s]);
  }
}

// ---- interior (sections G and H) ---------------------------------------------------------------------------------------------------

// Prediction of a traversed vertex in the lane that begins at values[lane], from its packed triangle.
uint traversed_prediction(uint predictor, uint lane, uint triangle) {
  uint a = triangle & 255u;
  uint value_b = values[lane + ((triangle >> 8) & 255u)];
  if (a == NO_VERTEX) return value_b;
  uint value_a = values[lane + a];
  uint o = triangle >> 24;
  if (predictor == PREDICT_COPY) return value_a;
  if (predictor == PREDICT_MEAN || o == NO_VERTEX) return (value_a + value_b) >> 1;
  uint value_o = values[lane + o];
  if (predictor == PREDICT_DAMPED) return uint(int(3u * (value_a + value_b) - 2u * value_o + 2u) >> 2);
  return value_a + value_b - value_o;
}

void predict_traversed(uint s) {
  uint components = stream_components[s];
  uint lanes = stream_lane[s] * 64u;
  uint bits = stream_mask[s];
  uint predictor = stream_predictor[s];
  for (uint i = 0u; i < traversed_count; i++) {
    uint triangle = traversed[i];
    for (uint c = 0u; c < components; c++) {
      uint lane = lanes + 64u * c;
      uint at = lane + ((triangle >> 16) & 255u);
      values[at] = (traversed_prediction(predictor, lane, triangle) + values[at]) & bits;
    }
  }
}

// Inner vertices of the foreign references that bring their own values for stream s.
uint seam_vertices(HEADER_IN h, uint s) {
  uint count = 0u;
  if ((h.flags & FLAG_SEAMS) != 0u)
    for (mask64 rest = h.foreign_refs; mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest)))
      if (!shares(h, mask_lsb(rest), s)) count += reference_length[mask_lsb(rest)] - 1u;
  return count;
}

// Residuals and values of everything but the foreign vertices; the unary reader stands behind section F.
void decode_interior(HEADER_IN h) {
  uint low = unary.cursor;
  uint end = low;
  for (uint s = 0u; s < stream_total; s++)
    end += (traversed_count + seam_vertices(h, s)) * low_bits(s, interior_code[s], interior_widths[s]);
  unary = seek_unary(end);
  for (uint s = 0u; s < stream_total; s++) {
    uint step = low_bits(s, interior_code[s], interior_widths[s]);
    uint count = traversed_count + seam_vertices(h, s);
    if (s >= stream_first && s < stream_end) {
      uint at = 0u;
      for (mask64 rest = h.foreign_refs; (h.flags & FLAG_SEAMS) != 0u && mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest)))
        if (!shares(h, mask_lsb(rest), s)) at = target_chain(mask_lsb(rest), false, at);
      for (uint i = 0u; i < traversed_count; i++) targets[at + i] = small_uint((traversed[i] >> 16) & 255u);
      read_residuals(s, count, interior_code[s], interior_widths[s], low);
    } else if (interior_code[s] != CODE_FIXED) {
      skip_unary(unary, count * stream_components[s]);
    }
    low += count * step;
  }
  if (max(unary.cursor, low) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

void predict_own(HEADER_IN h) {
  for (uint s = stream_first; s < stream_end; s++) {
    for (mask64 rest = h.owned_refs; mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest)))
      if (reference_length[mask_lsb(rest)] > 1u) add_chord(mask_lsb(rest), s, false);
    for (mask64 rest = h.foreign_refs; (h.flags & FLAG_SEAMS) != 0u && mask_any(rest); rest = rest & ~mask_bit(mask_lsb(rest)))
      if (!shares(h, mask_lsb(rest), s)) add_chord(mask_lsb(rest), s, false);
    predict_traversed(s);
  }
}

// ---- a whole meshlet ---------------------------------------------------------------------------------------------------------------

// Boundary vertices that do not wait for the traversal: all but the inner vertices of private references.
mask64 known_vertices(HEADER_IN h) {
  mask64 known = mask_none();
  if (h.references == 0u)
    for (uint i = 0u; i < component_count; i++) known = known | mask_bit(component_first[i]);
  for (uint r = 0u; r < h.references; r++) {
    uint n = mask_test(h.private_refs, r) ? 1u : reference_length[r];
    for (uint i = 0u; i < n; i++) known = known | mask_bit(inner_vertex(r, i));
  }
  return known;
}

Header opened;                             // of the meshlet decoded last

// The meshlet in four steps. Before the third, an includer that has the owners' values at hand may put them in place and say so in
// provided_refs.
void open_meshlet(uint m) {
  error = ERROR_NONE;
  triangle_count = 0u;
  vertex_count = 0u;
  provided_refs = mask_none();
  opened = read_header(m);
  if (error != ERROR_NONE) return;
  read_symbols(opened.begin, opened.triangles);
  decode_apexes();
}

void connect_meshlet() {
  place_references(opened);
  if (error == ERROR_NONE) decode_triangles(known_vertices(opened));
}

void read_foreign() {
  read_foreign_corners(opened);
  if (error == ERROR_NONE) read_foreign_chains(opened);
}

void read_own() {
  find_sections(opened, component_count);
  if (error != ERROR_NONE) return;
  read_own_anchors(opened);
  read_own_chains(opened);
  decode_interior(opened);
  predict_own(opened);
}

void decode_meshlet(uint m) {
  open_meshlet(m);
  if (error == ERROR_NONE) connect_meshlet();
  if (error == ERROR_NONE) read_foreign();
  if (error == ERROR_NONE) read_own();
}

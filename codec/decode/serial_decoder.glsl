// The serial decoder: one meshlet of a blob with one thread (spec, appendix A). Written once for
// C++17 and GLSL.
//
// C++ includes this file inside the struct of decode/serial_decoder.h, so that file-scope variables
// become members; GLSL includes it at file scope. The includer defines before:
//
//   small_uint                  integer for 0 .. 255 (uint in GLSL)
//   index_uint                  integer for subscripts: as wide as an address in C++, uint in GLSL
//   INLINE                      before functions that must be compiled anew for every call
//   HEADER_IN                   how a Header is passed: by value, or by reference in C++
//   mask64                      64 bits with & | ^ ~ (uvec2 in GLSL, x is the low half)
//   mask_none() mask_bit(i) mask_below(n <= 64) mask_test(m, i) mask_any(m) mask_count(m)
//   mask_lsb(m) mask_msb(m)     64, and 64 or more, for an empty mask
//   mask_clear_lsb(m) mask_shl1(m)
//   mask_scatter(bits, m)       deposits the lowest bits of `bits` at the ones of m
//   load_word(i)                32-bit word i of the blob, 0 past its end
//   load_bits(p, n)             n <= 32 bits at bit p, 0 past the end
//   load_mask(p, n)             n <= 64 bits at bit p
//   load_inside(p, n)           load_bits without bounds check
//   UnaryReader                 position in a unary plane, with its bit position `cursor`
//   seek_unary(p), skip_unary(reader, n)
//   read_rice(n, k, low)        reads n Rice codes of parameter k into `residuals`, un-zigzagged:
//                               quotients from the UnaryReader `unary`, low bits from bit `low`,
//                               which the caller has checked. Sets `error` past the blob's end and
//                               after more than MAX_QUOTIENT zeros in a row.
//   choose(condition, a, b)     condition ? a : b for uint and mask64, without a branch: for
//                               conditions that no branch predictor learns
//   divide(x, n)                x / n for 0 < n <= 64 and x < n << 25
//   max(a, b)                   of two uints
//   FOREIGN_LENGTH(owner, slot) read_foreign_length, or a table with the same answers
//   MAX_STREAMS, MAX_ELEMENTS   capacity: streams of the blob, and the sum of their elements
//
// Optional: APEX(t), SET_APEX(t, v) and TRIANGLE(t) name storage for apices and packed triangles;
// otherwise this file declares arrays.
//
// Use: load_streams(first, end) once per blob, then decode_meshlet(m). Results: triangle_count,
// packed `triangles`, vertex_count, values[element * 64 + local id]. If `error` is not ERROR_NONE,
// the meshlet is malformed and nothing else is valid.
//
// Hostile bytes: every index is bounded by a 64-bit mask or a checked count. No loop runs longer
// than 64 x MAX_ELEMENTS steps, except the unary reader's, which ends at the blob's end.

#include "format/constants.h"

uint error;

// --- the blob ---

uint stream_total;  // streams in the blob
uint stream_first;  // streams [stream_first, stream_end) are decoded; the others are only skipped
uint stream_end;
uint meshlet_total;
uint byte_length;
uint data_offset;
uint group_table;  // word index
uint directory;    // word index
small_uint stream_elements[MAX_STREAMS];
small_uint stream_predictor[MAX_STREAMS];
small_uint stream_chain_base[MAX_STREAMS];
small_uint stream_interior_base[MAX_STREAMS];
uint stream_mask[MAX_STREAMS];  // (1 << bits) - 1
small_uint stream_bits[MAX_STREAMS];
small_uint stream_element[MAX_STREAMS];  // first element of a decoded stream

// Reads the header. read_blob_header has checked it: all tables lie inside the blob.
void load_tables() {
  stream_total = (load_word(BLOB_WORD_VERSION) >> 8) & 255u;
  meshlet_total = load_word(BLOB_WORD_MESHLETS);
  byte_length = load_word(BLOB_WORD_BYTES);
  data_offset = load_word(BLOB_WORD_DATA);
  group_table = BLOB_HEADER_WORDS + BLOB_STREAM_WORDS * stream_total;
  directory = group_table + BLOB_GROUP_WORDS * ((meshlet_total + 31u) >> 5);
}

#define STREAM_SHAPE_WORD(s) (BLOB_HEADER_WORDS + BLOB_STREAM_WORDS * (s))
#define STREAM_BASES_WORD(s) (BLOB_HEADER_WORDS + 1u + BLOB_STREAM_WORDS * (s))
#define OFFSET_MASK ((1u << BLOB_OFFSET_BITS) - 1u)
#define REFERENCES_SHIFT (BLOB_OFFSET_BITS + BLOB_TRIANGLE_BITS)
#define FLAGS_SHIFT (REFERENCES_SHIFT + BLOB_REFERENCE_BITS)

// Reads header and stream table.
void load_streams(uint first, uint end) {
  load_tables();
  stream_first = first;
  stream_end = end;
  uint element = 0u;
  for (uint s = 0u; s < stream_total; s++) {
    uint shape = load_word(STREAM_SHAPE_WORD(s));
    uint bases = load_word(STREAM_BASES_WORD(s));
    uint bits = (shape >> 16) & 255u;
    stream_elements[s] = small_uint((shape >> 8) & 255u);
    stream_bits[s] = small_uint(bits);
    stream_mask[s] = bits >= 32u ? 0xFFFFFFFFu : (1u << bits) - 1u;
    stream_predictor[s] = small_uint(shape >> 24);
    stream_chain_base[s] = small_uint(bases & 255u);
    stream_interior_base[s] = small_uint((bases >> 8) & 255u);
    stream_element[s] = small_uint(element);
    if (s >= first && s < end) element += (shape >> 8) & 255u;
  }
}

// --- a meshlet's header and references (sections A and B) ---

struct Header {
  uint meshlet;
  uint triangles;
  uint references;
  uint flags;
  uint begin;    // bit positions: section A,
  uint lengths;  //   the stored lengths,
  uint entries;  //   the foreign references' entries,
  uint codes;    //   section C
  uint length_width;
  uint delta_width;
  uint slot_width;
  uint entry_width;
  mask64 foreign_refs;
  mask64 private_refs;
  mask64 owned_refs;
  mask64 sized_refs;  // references whose length is stored
  mask64 loop_ends;
};

// References that are alone in their loop.
mask64 lone_references(mask64 loop_ends) {
  return loop_ends & (mask_shl1(loop_ends) | mask_bit(0u));
}

// Sets `error` if the header is malformed; the counts returned are bounded even then.
Header read_header(uint m) {
  Header h;
  uint group = group_table + BLOB_GROUP_WORDS * (m >> 5);
  uint base = load_word(group);
  uint widths = load_word(group + 1u);
  uint entry = load_word(directory + m);
  uint offset = (entry & OFFSET_MASK) << ((widths >> 16) & 15u);
  if (m >= meshlet_total || base >= byte_length || offset >= byte_length - base ||
      data_offset >= byte_length - base - offset) {
    error = ERROR_OFFSET;
    base = 0u;
    offset = 0u;
  }
  h.meshlet = m;
  h.triangles = ((entry >> BLOB_OFFSET_BITS) & 63u) + 1u;
  h.references = (entry >> REFERENCES_SHIFT) & 63u;
  h.flags = entry >> FLAGS_SHIFT;
  h.delta_width = widths & 31u;
  h.slot_width = (widths >> 8) & 7u;
  h.begin = 8u * (data_offset + base + offset);
  uint p =
      h.begin + 2u * h.triangles +
      mask_count(load_mask(h.begin, h.triangles) & load_mask(h.begin + h.triangles, h.triangles));
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
    h.length_width = load_bits(p, LENGTH_WIDTH_BITS);
    p += LENGTH_WIDTH_BITS;
    if (h.length_width > LENGTH_MAX_WIDTH) error = ERROR_REFERENCES;
  }
  h.owned_refs = all & ~(h.foreign_refs | h.private_refs);
  h.sized_refs = h.owned_refs | (h.private_refs & ~lone_references(h.loop_ends));
  h.lengths = p;
  p += h.length_width * mask_count(h.sized_refs);
  h.entries = p;
  h.entry_width =
      h.delta_width + h.slot_width + ((h.flags & FLAG_SEAMS) != 0u ? stream_total - 1u : 0u);
  h.codes = p + h.entry_width * mask_count(h.foreign_refs);
  return h;
}

// Bit position of foreign reference r's entry: delta, slot, share bits.
uint entry_position(HEADER_IN h, uint r) {
  return h.entries + h.entry_width * mask_count(h.foreign_refs & mask_below(r));
}

// The foreign references that store their own values for stream s instead of sharing the owner's.
mask64 seam_references(HEADER_IN h, uint s) {
  mask64 seams = mask_none();
  if (s == 0u || (h.flags & FLAG_SEAMS) == 0u) return seams;
  uint share = h.entries + h.delta_width + h.slot_width + s - 1u;
  for (mask64 rest = h.foreign_refs; mask_any(rest); rest = mask_clear_lsb(rest)) {
    if (load_bits(share, 1u) == 0u) seams = seams | mask_bit(mask_lsb(rest));
    share += h.entry_width;
  }
  return seams;
}

uint stored_length(HEADER_IN h, uint r) {
  return load_bits(h.lengths + h.length_width * mask_count(h.sized_refs & mask_below(r)),
                   h.length_width) +
         1u;
}

// The first reference of r's loop, and r's neighbours in it.
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

// The corners stored for a stream whose seam references are `seams`: both neighbours store their
// own values.
mask64 stored_corners(HEADER_IN h, mask64 seams) {
  mask64 own = (mask_below(h.references) & ~h.foreign_refs) | seams;
  mask64 before = mask_shl1(own & ~h.loop_ends);  // bit j: reference j - 1 of the same loop is own
  uint first = 0u;
  for (mask64 rest = h.loop_ends; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint last = mask_lsb(rest);
    if (mask_test(own, last)) before = before | mask_bit(first);
    first = last + 1u;
  }
  return own & before;
}

// --- a meshlet's codes and section positions (C to G) ---

small_uint chain_code[MAX_STREAMS];  // Rice parameter, or CODE_FIXED
small_uint interior_code[MAX_STREAMS];
uint chain_widths[MAX_STREAMS];  // bit position of the 5-bit widths of a fixed code
uint interior_widths[MAX_STREAMS];
uint anchor_position[MAX_STREAMS];
small_uint anchor_count[MAX_STREAMS];
uint chain_low[MAX_STREAMS];  // bit position of section E for the stream
uint chain_total;             // inner vertices of all owned references
uint chain_unary;             // bit position of section F

uint width_field(uint position) {
  uint w = load_bits(position, WIDTH_BITS);
  return w == WIDTH_ESCAPE ? 32u : w;
}

uint code_cursor;  // bit position, moved by read_code

uint read_code(uint s, uint base) {
  uint code = load_bits(code_cursor, CODE_BITS);
  code_cursor += CODE_BITS;
  if (code == CODE_ESCAPE) {
    code_cursor += WIDTH_BITS * stream_elements[s];
    return CODE_FIXED;
  }
  if (base + code > RICE_MAX) error = ERROR_CODE;
  return (base + code) & RICE_MAX;
}

// Low bits of one vertex of stream s under a code.
uint low_bits(uint s, uint code, uint widths) {
  if (code != CODE_FIXED) return code * stream_elements[s];
  uint sum = 0u;
  for (uint c = 0u; c < stream_elements[s]; c++) sum += width_field(widths + WIDTH_BITS * c);
  return sum;
}

// Finds all sections of the meshlet. `loops`: its number of disks; needed only if it has no
// references.
void find_sections(HEADER_IN h, uint loops) {
  bool chains = mask_any(h.owned_refs);
  code_cursor = h.codes;
  for (uint s = 0u; s < stream_total; s++) {
    chain_code[s] = small_uint(0u);
    if (chains) {
      chain_widths[s] = code_cursor + CODE_BITS;
      chain_code[s] = small_uint(read_code(s, stream_chain_base[s]));
    }
    interior_widths[s] = code_cursor + CODE_BITS;
    interior_code[s] = small_uint(read_code(s, stream_interior_base[s]));
  }
  chain_total = 0u;
  for (mask64 rest = h.owned_refs; mask_any(rest); rest = mask_clear_lsb(rest))
    chain_total += stored_length(h, mask_lsb(rest)) - 1u;
  uint p = code_cursor;
  uint count = loops;
  for (uint s = 0u; s < stream_total; s++) {
    if (h.references > 0u && (s == 0u || (h.flags & FLAG_SEAMS) != 0u))
      count = mask_count(stored_corners(h, seam_references(h, s)));
    anchor_position[s] = p;
    anchor_count[s] = small_uint(count);
    if (count > 0u) p += stream_elements[s] * stream_bits[s];
    if (count > 1u) p += WIDTH_BITS + (count - 1u) * stream_elements[s] * width_field(p);
  }
  for (uint s = 0u; s < stream_total; s++) {
    chain_low[s] = p;
    if (chains) p += chain_total * low_bits(s, chain_code[s], chain_widths[s]);
  }
  chain_unary = p;
}

// --- values ---

uint values[MAX_ELEMENTS * 64];  // values[element * 64 + local id]

uint unzigzag(uint u) { return (u >> 1) ^ (0u - (u & 1u)); }

// Writes anchor `index` of the streams [begin, end) as the values of `vertex`. Needs find_sections.
void read_anchor(uint index, uint vertex, uint begin, uint end) {
  for (uint s = begin; s < end; s++) {
    uint p = anchor_position[s];
    uint n = stream_elements[s];
    uint bits = stream_bits[s];
    uint width = index > 0u ? width_field(p + n * bits) : 0u;
    uint deltas = p + n * bits + WIDTH_BITS + (index - 1u) * n * width;
    for (uint c = 0u; c < n; c++) {
      uint value = load_bits(p + c * bits, bits);
      if (index > 0u) value += unzigzag(load_bits(deltas + c * width, width));
      values[(stream_element[s] + c) * 64u + vertex] = value & stream_mask[s];
    }
  }
}

UnaryReader unary;    // position of the next quotient
uint residuals[256];  // of one stream, vertex by vertex

// Reads the residuals of `count` <= 64 vertices of stream s: low bits from bit `low`, quotients
// from the unary reader.
void read_residuals(uint s, uint count, uint code, uint widths, uint low) {
  uint elements = stream_elements[s];
  uint step = low_bits(s, code, widths);
  if (low + count * step > 8u * (byte_length - 8u)) {
    error = ERROR_UNARY;
    return;
  }
  if (code != CODE_FIXED) {
    read_rice(count * elements, code, low);
    return;
  }
  for (uint c = 0u; c < elements; c++) {
    uint width = width_field(widths + WIDTH_BITS * c);
    for (uint i = 0u; i < count; i++)
      residuals[i * elements + c] = unzigzag(load_inside(low + i * step, width));
    low += width;
  }
}

// --- connectivity (section A) ---

mask64 symbol_r;
mask64 symbol_e;
mask64 symbol_c;
mask64 symbol_s;
uint triangle_count;
uint vertex_count;
uint disk_count;
mask64 disk_starts;  // triangles that begin a disk
mask64 boundary;     // local ids on the boundary
#ifndef APEX
#define APEX(t) apex[t]
#define SET_APEX(t, v) apex[t] = small_uint(v)
small_uint apex[64];
#endif
small_uint disk_first[65];  // first local id of each disk; one more at the end
small_uint disk_gate[64];   // the root gate's a
#ifndef TRIANGLE
#define TRIANGLE(t) triangles[t]
uint triangles[64];
#endif
// TRIANGLE(t): packed local ids, gate a | b << 8 | apex v << 16 | vertex across the gate o << 24.

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

// First half: the apex of every triangle from the symbols, with two masks instead of linked lists.
// A strip runs to the next E and pushes its vertices; then the triangles that waited for their
// right subtree resolve, latest first.
void decode_apexes() {
  mask64 alive = mask_none();
  mask64 pushed = mask_none();  // by R
  mask64 pending = mask_none();
  bool fresh = true;
  uint count = 0u;  // vertices so far
  uint t = 0u;
  disk_starts = mask_none();
  disk_count = 0u;
  vertex_count = 0u;
  boundary = mask_none();
  while (t < triangle_count) {
    if (fresh) {
      if (count >= 64u) {
        error = ERROR_VERTICES;
        return;
      }
      disk_starts = disk_starts | mask_bit(t);
      disk_first[disk_count] = small_uint(count);
      disk_count++;
      alive = alive | mask_bit(count);
      count++;
    }
    fresh = true;
    mask64 ends = symbol_e & ~mask_below(t);
    if (!mask_any(ends)) {
      error = ERROR_CLERS;
      return;
    }
    uint q = mask_lsb(ends);
    mask64 strip = mask_below(q) & ~mask_below(t);
    mask64 pushes = strip & symbol_r;
    if (count + mask_count(pushes) + 2u > 64u) {
      error = ERROR_VERTICES;
      return;
    }
    pending = pending | (strip & ~symbol_r);
    uint after = count + mask_count(pushes);
    mask64 ids = mask_below(after) & ~mask_below(count);
    pushed = pushed | ids;
    alive = alive | ids;
    count = after;
    SET_APEX(q, count);
    alive = alive | mask_bit(count) | mask_bit(count + 1u);
    count += 2u;
    t = q + 1u;
    mask64 splits = pending & symbol_s;
    fresh = !mask_any(splits);
    uint split = mask_msb(splits);
    mask64 resolved = fresh ? pending : pending & ~mask_below(split + 1u);
    pending = pending & ~resolved;
    bool empty = false;
    while (mask_any(resolved)) {
      uint u = mask_msb(resolved);
      uint v = mask_msb(alive);
      bool closes = mask_test(symbol_c, u);
      SET_APEX(u, v);
      empty = empty || v >= 64u;
      alive = choose(closes, alive & ~mask_bit(v), alive | mask_bit(count));
      count += choose(closes, 0u, 1u);
      resolved = resolved & ~mask_bit(u);
    }
    uint last = mask_msb(alive);
    if (empty || last >= 64u) {
      error = ERROR_CLERS;
      return;
    }
    if (count > 64u) {
      error = ERROR_VERTICES;
      return;
    }
    if (fresh) {
      disk_gate[disk_count - 1u] = small_uint(last);
    } else {
      SET_APEX(split, last);
      pending = pending & ~mask_bit(split);
    }
  }
  if (!fresh) {
    error = ERROR_CLERS;
    return;
  }
  for (mask64 rest = symbol_r; mask_any(rest); rest = mask_clear_lsb(rest)) {
    SET_APEX(mask_lsb(rest), mask_lsb(pushed));
    pushed = mask_clear_lsb(pushed);
  }
  disk_first[disk_count] = small_uint(count);
  vertex_count = count;
  boundary = alive;
}

uint pack4(uint x, uint y, uint z, uint w) { return x | y << 8 | z << 16 | w << 24; }

// The triangles that introduce a vertex (interior or private), in the order of their residuals.
uint traversed_count;
uint traversed[65];  // one more than 64: list_with_private writes before it counts

// Every C introduces a vertex.
void list_interior() {
  uint count = 0u;
  bool distinct = true;  // the first C that pops too much, even from another disk, has a == b
  for (mask64 rest = symbol_c; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint triangle = TRIANGLE(mask_lsb(rest));
    traversed[count] = triangle;
    count++;
    distinct = distinct && ((triangle ^ (triangle >> 8)) & 255u) != 0u;
  }
  traversed_count = count;
  if (!distinct) error = ERROR_CLERS;
}

// Triangles other than C introduce only `waiting` boundary ids. So does a root gate: its a is
// predicted from b alone, written as a triangle whose other vertices are all b.
void list_with_private(mask64 waiting) {
  uint count = 0u;
  for (uint t = 0u; t < triangle_count; t++) {
    uint triangle = TRIANGLE(t);
    uint a = triangle & 255u;
    uint b = (triangle >> 8) & 255u;
    uint v = (triangle >> 16) & 255u;
    if (mask_test(disk_starts, t) && mask_test(waiting, a)) {
      traversed[count] = pack4(b, b, a, b);
      count++;
      waiting = waiting & ~mask_bit(a);
    }
    traversed[count] = triangle;
    count += mask_test(symbol_c, t) || mask_test(waiting, v) ? 1u : 0u;
    waiting = waiting & ~mask_bit(v);
  }
  traversed_count = count;
  if (mask_any(waiting)) error = ERROR_CLERS;
}

// `known`: boundary ids that already have values.
void list_traversed(mask64 known) {
  list_interior();
  if (mask_any(boundary & ~known)) list_with_private(boundary & ~known);
}

// Second half: all triangles in stream order, strip by strip, with the gate in registers.
void decode_triangles() {
  mask64 splits = symbol_s;  // their left subtrees are still to come
  uint a = 0u;
  uint b = 0u;
  uint o = 0u;
  uint disk = 0u;
  uint t = 0u;
  while (t < triangle_count) {
    if (mask_test(disk_starts, t)) {
      a = disk_gate[disk];
      b = disk_first[disk];
      o = NO_VERTEX;
      disk++;
    }
    uint end = mask_lsb(symbol_e & ~mask_below(t));  // exists: decode_apexes checked
    for (; t <= end; t++) {
      uint v = APEX(t);
      TRIANGLE(t) = pack4(a, b, v, o);
      bool right =
          mask_test(symbol_r, t);  // the next gate is (a, v) after R, (v, b) after C, L and S
      o = choose(right, b, a);
      b = choose(right, v, b);
      a = choose(right, a, v);
    }
    uint last = mask_msb(splits & mask_below(t));
    if (last < 64u) {
      uint split = TRIANGLE(last);
      splits = splits & ~mask_bit(last);
      a = split & 255u;
      o = (split >> 8) & 255u;
      b = (split >> 16) & 255u;
    }
  }
}

// --- boundaries ---

small_uint loop_vertex[64];     // boundary ids in loop order
small_uint reference_rank[64];  // a reference's first place in loop_vertex
small_uint reference_length[64];
small_uint reference_end[64];   // local id of a reference's last vertex
uint reference_owner[64];       // foreign references: owner meshlet and
small_uint reference_slot[64];  //   index among its owned references

// Local id of inner vertex i (1 .. length - 1) of reference r.
uint inner_vertex(uint r, uint i) { return loop_vertex[reference_rank[r] + i]; }

// The owned reference in slot `slot`. Returns 64 and sets `error` if there is none.
uint slot_reference(HEADER_IN h, uint slot) {
  mask64 rest = h.owned_refs;
  for (uint i = 0u; i < slot && mask_any(rest); i++) rest = mask_clear_lsb(rest);
  if (!mask_any(rest)) error = ERROR_OWNER;
  return mask_lsb(rest);
}

// Owner and slot of the entry at bit `entry` of h. The owner is an earlier meshlet, or the same.
uint entry_owner(HEADER_IN h, uint entry) {
  uint delta = load_bits(entry, h.delta_width);
  if (delta > h.meshlet) error = ERROR_OWNER;
  return delta > h.meshlet ? 0u : h.meshlet - delta;
}
uint entry_slot(HEADER_IN h, uint entry) { return load_bits(entry + h.delta_width, h.slot_width); }

// The owner visited last, to look up foreign vertices: its header and, if `located` names it, its
// sections.
Header visited;
uint located;

void visit(uint m) {
  if (visited.meshlet != m) visited = read_header(m);
}

void locate_visited() {
  if (located != visited.meshlet) find_sections(visited, 0u);
  located = visited.meshlet;
}

// Length of owned reference `slot` of meshlet `owner`.
uint read_foreign_length(uint owner, uint slot) {
  visit(owner);
  uint r = slot_reference(visited, slot);
  return error == ERROR_NONE ? stored_length(visited, r) : 1u;
}

// Places the references along the boundary loops.
void place_references(HEADER_IN h) {
  uint lengths = h.lengths;
  uint entry = h.entries;
  uint rank = 0u;
  uint r = 0u;
  uint places = 0u;
  for (mask64 rest = boundary; mask_any(rest); rest = mask_clear_lsb(rest)) {
    loop_vertex[places] = small_uint(mask_lsb(rest));
    places++;
  }
  for (uint disk = 0u; disk < disk_count; disk++) {
    mask64 ids = mask_below(disk_first[disk + 1u]) & ~mask_below(disk_first[disk]);
    uint length = mask_count(boundary & ids);
    uint begin = rank;
    bool more = h.references > 0u;
    while (more) {
      if (r >= h.references || rank >= begin + length) {
        error = ERROR_REFERENCES;
        return;
      }
      uint n = length;
      if (mask_test(h.foreign_refs, r)) {
        reference_owner[r] = entry_owner(h, entry);
        reference_slot[r] = small_uint(entry_slot(h, entry));
        entry += h.entry_width;
        if (error != ERROR_NONE) return;
        n = FOREIGN_LENGTH(reference_owner[r], reference_slot[r]);
        if (error != ERROR_NONE) return;
      } else if (mask_test(h.sized_refs, r)) {
        n = load_bits(lengths, h.length_width) + 1u;
        lengths += h.length_width;
      }
      reference_rank[r] = small_uint(rank);
      reference_length[r] = small_uint(n);
      rank += n;
      more = !mask_test(h.loop_ends, r);
      if (rank > begin + length) {
        error = ERROR_REFERENCES;
        return;
      }
      reference_end[r] = small_uint(more ? loop_vertex[rank & 63u] : loop_vertex[begin]);
      r++;
    }
    if (h.references > 0u && rank != begin + length) {
      error = ERROR_REFERENCES;
      return;
    }
    rank = begin + length;
  }
  if (r != h.references) error = ERROR_REFERENCES;
}

// Foreign references of the opened meshlet that store their own values: per stream, and for any.
mask64 seam_refs[MAX_STREAMS];
mask64 seamed_refs;

void find_seams(HEADER_IN h) {
  seamed_refs = mask_none();
  for (uint s = 0u; s < stream_total; s++) {
    seam_refs[s] = seam_references(h, s);
    seamed_refs = seamed_refs | seam_refs[s];
  }
}

// The foreign references that share stream s with their owner.
mask64 shared_references(HEADER_IN h, uint s) { return h.foreign_refs & ~seam_refs[s]; }

// Chain vertices in the order of their residuals. chain_ends: vertex v | chain's ends a << 8 |
// b << 16; chain_place: place i | length n << 8.
uint chain_count;
uint chain_ends[64];
small_uint chain_place[64];

// Lists the inner vertices of reference r. A foreign chain runs backwards, in its owner's
// direction.
void list_chain(uint r, bool backwards) {
  uint n = reference_length[r];
  uint rank = reference_rank[r];
  uint a = loop_vertex[rank];
  uint b = reference_end[r];
  uint ends = backwards ? pack4(0u, b, a, 0u) : pack4(0u, a, b, 0u);
  for (uint i = 1u; i < n && chain_count < 64u; i++) {
    chain_ends[chain_count] = ends | loop_vertex[rank + (backwards ? n - i : i)];
    chain_place[chain_count] = small_uint(i | n << 8);
    chain_count++;
  }
}

void list_chains(mask64 refs) {
  chain_count = 0u;
  for (; mask_any(refs); refs = mask_clear_lsb(refs)) list_chain(mask_lsb(refs), false);
}

// Point i of n on the chord from a to b, rounded. a and b have up to 24 bits: the bias keeps the
// dividend positive.
INLINE uint chord(uint a, uint b, uint i, uint n) {
  return a + divide((b - a) * i + (n >> 1) + (n << 24), n) - (1u << 24);
}

// Values of the listed chain vertices for stream s: the chord's point, or a (COPY), plus residual.
INLINE void predict_chain_elements(uint s, bool copies, uint elements) {
  index_uint base = stream_element[s] * 64u;
  index_uint from = 0u;
  uint bits = stream_mask[s];
  uint count = chain_count;
  for (uint j = 0u; j < count; j++) {
    index_uint v = base + (chain_ends[j] & 255u);
    index_uint a = base + ((chain_ends[j] >> 8) & 255u);
    index_uint b = base + (chain_ends[j] >> 16);
    uint i = chain_place[j] & 255u;
    uint n = chain_place[j] >> 8;
    for (index_uint c = 0u; c < elements; c++) {
      uint point = values[a + 64u * c];
      if (!copies) point = chord(point, values[b + 64u * c], i, n);
      values[v + 64u * c] = (point + residuals[from + c]) & bits;
    }
    from += elements;
  }
}

void predict_chains(uint s) {
  bool copies = stream_predictor[s] == PREDICT_COPY;
  uint elements = stream_elements[s];
  if (!copies && elements == 3u)
    predict_chain_elements(s, false, 3u);
  else if (!copies && elements == 2u)
    predict_chain_elements(s, false, 2u);
  else
    predict_chain_elements(s, copies, elements);
}

// The chain of the visited owner's reference `other`, for the streams that foreign reference r
// shares. The owner's first inner vertex is r's last.
void read_foreign_chain(HEADER_IN h, uint r, uint other) {
  uint first = 0u;
  for (mask64 rest = visited.owned_refs & mask_below(other); mask_any(rest);
       rest = mask_clear_lsb(rest))
    first += stored_length(visited, mask_lsb(rest)) - 1u;
  uint count = reference_length[r] - 1u;
  chain_count = 0u;
  list_chain(r, true);
  uint skipped = 0u;  // unary codes up to the chain's next one
  unary = seek_unary(chain_unary);
  for (uint s = 0u; s < stream_end; s++) {
    uint elements = stream_elements[s];
    uint code = chain_code[s];
    if (s >= stream_first && mask_test(shared_references(h, s), r)) {
      if (code != CODE_FIXED) {
        skip_unary(unary, skipped + first * elements);
        skipped = (chain_total - first - count) * elements;
      }
      read_residuals(s, count, code, chain_widths[s],
                     chain_low[s] + first * low_bits(s, code, chain_widths[s]));
      predict_chains(s);
    } else if (code != CODE_FIXED) {
      skipped += chain_total * elements;
    }
  }
}

// Fetches the corner at the start (at_end: at the end) of owned reference `slot` of meshlet `owner`
// for the streams from `s` on: follows references to the meshlet that stores it and writes its
// values to `vertex`. Returns the number of streams served: all, or one if seams on the way may
// lead the streams to different meshlets.
uint fetch_corner(uint owner, uint slot, bool at_end, uint vertex, uint s, bool apart) {
  for (uint hop = 0u; hop < MAX_HOPS; hop++) {
    visit(owner);
    uint r = slot_reference(visited, slot);
    if (error != ERROR_NONE) return 1u;
    apart = apart || (visited.flags & FLAG_SEAMS) != 0u;
    uint corner = at_end ? next_reference(visited, r) : r;
    mask64 seams = seam_references(visited, s);
    mask64 stored = stored_corners(visited, seams);
    if (mask_test(stored, corner)) {
      uint end = apart ? s + 1u : stream_end;
      locate_visited();
      read_anchor(mask_count(stored & mask_below(corner)), vertex, s, end);
      return end - s;
    }
    uint onward = at_end ? corner : previous_reference(visited, r);
    if (!mask_test(visited.foreign_refs & ~seams, onward)) {
      error = ERROR_OWNER;
      return 1u;
    }
    uint entry = entry_position(visited, onward);
    owner = entry_owner(visited, entry);
    slot = entry_slot(visited, entry);
    if (error != ERROR_NONE) return 1u;
  }
  error = ERROR_HOPS;
  return 1u;
}

// The reference that leads to the stored value of stream s of the corner between `before` and r:
// one of the two, or 64 if this meshlet stores it.
uint corner_source(HEADER_IN h, uint r, uint before, uint s) {
  mask64 shared_refs = shared_references(h, s);
  bool from_r = mask_test(shared_refs, r);
  bool from_before = mask_test(shared_refs, before);
  if (from_r && from_before) return reference_owner[before] < reference_owner[r] ? before : r;
  return from_r ? r : from_before ? before : 64u;
}

mask64 provided_refs;  // foreign references whose vertices already have values, by the includer

void read_foreign_corners(HEADER_IN h) {
  bool seams = mask_any(seamed_refs);
  for (uint r = 0u; r < h.references; r++) {
    uint before = previous_reference(h, r);
    uint vertex = loop_vertex[reference_rank[r]];
    uint s = stream_first;
    while (s < stream_end && error == ERROR_NONE) {
      uint source = corner_source(h, r, before, s);
      if (source == 64u || mask_test(provided_refs, source))
        s = seams ? s + 1u : stream_end;
      else
        s += fetch_corner(reference_owner[source], reference_slot[source], source == r, vertex, s,
                          seams);
    }
  }
}

// After the foreign corners: foreign chains are predicted from them.
void read_foreign_chains(HEADER_IN h) {
  for (mask64 rest = h.foreign_refs & ~provided_refs; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    if (reference_length[r] > 1u) {
      visit(reference_owner[r]);
      locate_visited();
      read_foreign_chain(h, r, slot_reference(visited, reference_slot[r]));
    }
  }
}

void read_own_anchors(HEADER_IN h) {
  mask64 stored = mask_none();
  for (uint s = stream_first; s < stream_end; s++) {
    if (h.references == 0u)
      for (uint i = 0u; i < disk_count; i++) read_anchor(i, disk_first[i], s, s + 1u);
    else if (s == stream_first || (h.flags & FLAG_SEAMS) != 0u)
      stored = stored_corners(h, seam_refs[s]);
    uint index = 0u;
    for (mask64 rest = stored; mask_any(rest); rest = mask_clear_lsb(rest)) {
      read_anchor(index, loop_vertex[reference_rank[mask_lsb(rest)]], s, s + 1u);
      index++;
    }
  }
}

// Leaves the unary reader behind section F.
void read_own_chains(HEADER_IN h) {
  unary = seek_unary(chain_unary);
  if (chain_total == 0u) return;
  list_chains(h.owned_refs);
  for (uint s = 0u; s < stream_total; s++) {
    if (s >= stream_first && s < stream_end) {
      read_residuals(s, chain_total, chain_code[s], chain_widths[s], chain_low[s]);
      predict_chains(s);
    } else if (chain_code[s] != CODE_FIXED) {
      skip_unary(unary, chain_total * stream_elements[s]);
    }
  }
}

// --- interior (sections G and H) ---

// Predicts one element of a traversed vertex from the gate's vertices a and b and, if there is a
// triangle across the gate, from that triangle's vertex o.
INLINE uint traversed_prediction(uint predictor, uint a, uint b, uint o, bool across) {
  if (predictor == PREDICT_COPY) return a;
  uint sum = a + b;
  if (predictor == PREDICT_MEAN || !across) return sum >> 1;
  if (predictor == PREDICT_DAMPED) return uint(int(3u * sum - 2u * o + 2u) >> 2);
  return sum - o;
}

// `from`: index of the first traversed vertex's residual.
INLINE void predict_elements(uint s, uint from, uint predictor, uint elements) {
  index_uint base = stream_element[s] * 64u;
  index_uint at = from;
  uint bits = stream_mask[s];
  uint count = traversed_count;
  for (uint i = 0u; i < count; i++) {
    uint triangle = traversed[i];
    index_uint a = base + (triangle & 255u);
    index_uint b = base + ((triangle >> 8) & 255u);
    index_uint v = base + ((triangle >> 16) & 255u);
    index_uint o = base + (triangle >> 24);
    bool across = triangle >> 24 != NO_VERTEX;
    for (index_uint c = 0u; c < elements; c++) {
      uint beyond = across ? values[o + 64u * c] : 0u;
      uint prediction =
          traversed_prediction(predictor, values[a + 64u * c], values[b + 64u * c], beyond, across);
      values[v + 64u * c] = (prediction + residuals[at + c]) & bits;
    }
    at += elements;
  }
}

// Constants instead of variables for the common cases.
void predict_traversed(uint s, uint first) {
  uint predictor = stream_predictor[s];
  uint elements = stream_elements[s];
  uint from = first * elements;
  if (predictor == PREDICT_PARALLELOGRAM && elements == 3u)
    predict_elements(s, from, PREDICT_PARALLELOGRAM, 3u);
  else if (predictor == PREDICT_DAMPED && elements == 3u)
    predict_elements(s, from, PREDICT_DAMPED, 3u);
  else if (predictor == PREDICT_PARALLELOGRAM && elements == 2u)
    predict_elements(s, from, PREDICT_PARALLELOGRAM, 2u);
  else if (predictor == PREDICT_DAMPED && elements == 2u)
    predict_elements(s, from, PREDICT_DAMPED, 2u);
  else
    predict_elements(s, from, predictor, elements);
}

// Number of inner vertices of the foreign references that store their own values for stream s.
uint seam_vertices(uint s) {
  uint count = 0u;
  for (mask64 rest = seam_refs[s]; mask_any(rest); rest = mask_clear_lsb(rest))
    count += reference_length[mask_lsb(rest)] - 1u;
  return count;
}

// Everything but the foreign vertices and the owned chains. Expects the unary reader behind section
// F.
void decode_interior() {
  uint low = unary.cursor;
  uint end = low;
  for (uint s = 0u; s < stream_total; s++)
    end += (traversed_count + seam_vertices(s)) * low_bits(s, interior_code[s], interior_widths[s]);
  unary = seek_unary(end);
  for (uint s = 0u; s < stream_total; s++) {
    uint count = traversed_count + seam_vertices(s);
    if (s >= stream_first && s < stream_end) {
      read_residuals(s, count, interior_code[s], interior_widths[s], low);
      list_chains(seam_refs[s]);
      predict_chains(s);
      predict_traversed(s, chain_count);
    } else if (interior_code[s] != CODE_FIXED) {
      skip_unary(unary, count * stream_elements[s]);
    }
    low += count * low_bits(s, interior_code[s], interior_widths[s]);
  }
  if (max(unary.cursor, low) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

// --- a whole meshlet ---

// Boundary vertices with values before the traversal: all but the inner ones of private references.
mask64 known_vertices(HEADER_IN h) {
  mask64 known = boundary;
  if (h.references == 0u) {
    known = mask_none();
    for (uint i = 0u; i < disk_count; i++) known = known | mask_bit(disk_first[i]);
  }
  for (mask64 rest = h.private_refs; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    for (uint i = 1u; i < reference_length[r]; i++) known = known & ~mask_bit(inner_vertex(r, i));
  }
  return known;
}

Header opened;  // of the meshlet decoded last

// A meshlet in four steps. Before the third, an includer that has the owners' values may put them
// in place and list them in provided_refs.
void open_meshlet(uint m) {
  error = ERROR_NONE;
  triangle_count = 0u;
  vertex_count = 0u;
  provided_refs = mask_none();
  visited.meshlet = NO_MESHLET;
  located = NO_MESHLET;
  opened = read_header(m);
  if (error != ERROR_NONE) return;
  read_symbols(opened.begin, opened.triangles);
  decode_apexes();
}

void connect_meshlet() {
  find_seams(opened);
  place_references(opened);
  if (error != ERROR_NONE) return;
  decode_triangles();
  list_traversed(known_vertices(opened));
}

void read_foreign() {
  if (!mask_any(opened.foreign_refs & ~provided_refs)) return;
  read_foreign_corners(opened);
  if (error == ERROR_NONE) read_foreign_chains(opened);
}

void read_own() {
  find_sections(opened, disk_count);
  if (error != ERROR_NONE) return;
  read_own_anchors(opened);
  read_own_chains(opened);
  decode_interior();
}

void decode_meshlet(uint m) {
  open_meshlet(m);
  if (error == ERROR_NONE) connect_meshlet();
  if (error == ERROR_NONE) read_foreign();
  if (error == ERROR_NONE) read_own();
}

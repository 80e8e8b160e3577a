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
//   seek_unary(p)               a reader at bit p
//   skip_unary(n)               moves the UnaryReader `unary` behind its next n ones
//   read_codes(n, code)         reads the n codes at the UnaryReader `unary` and, for their low
//                               bits, at bit `low_cursor` into `residuals`, un-zigzagged, and moves
//                               both behind them. `code`: a parameter k, + CODE_EXPONENTIAL. Sets
//                               `error` past the blob's end, after more than MAX_QUOTIENT zeros in
//                               a row, and if an exp-Golomb value has more than
//                               EXPONENTIAL_MAX_QUOTIENT zeros or EXPONENTIAL_MAX_BITS low bits.
//   choose(condition, a, b)     condition ? a : b for uint and mask64, without a branch: for
//                               conditions that no branch predictor learns
//   ends_after(p, n, end)       p + n > end, without wrapping
//   divide(x, n)                x / n for 0 < n <= 64 and x < n << 25
//   bit_length(x)               position of a uint's highest one, from 1; 0 for 0
//   max(a, b), min(a, b)        of two uints
//   FOREIGN_LENGTH(owner, slot) read_foreign_length, or a table with the same answers
//   MAX_STREAMS, MAX_ELEMENTS   capacity: streams of the blob, and the sum of their elements
//
// Optional: with OWN_VALUES the includer defines read_own_anchors(h, s, stored), predict_chains(s),
// predict_traversed(s, first) and finish_positions(), which runs once stream 0 is decoded, before
// the other interiors.
//
// Optional: APEX(t), SET_APEX(t, v), TRIANGLE(t), VALUES(i), RESIDUAL(i) and NORMALS(i) name
// storage for apices, packed triangles, values, residuals and sums of normals; otherwise this file
// declares arrays.
//
// Optional: VERTEX_STEP, ELEMENT_STEP and STREAM_ROOM(elements) give another order of `values`;
// ALIGNED stands before their declaration.
//
// Use: load_streams(first, end) once per blob, then decode_meshlet(m). Results: triangle_count,
// packed `triangles`, vertex_count, and `values`: element c of stream s of a local id at
// 64 * stream_element[s] + VERTEX_STEP * id + ELEMENT_STEP * c. If `error` is not ERROR_NONE,
// the meshlet is malformed and nothing else is valid.
//
// Hostile bytes: every index is bounded by a 64-bit mask or a checked count. No loop runs longer
// than 64 x MAX_ELEMENTS steps, except the unary reader's, which ends at the blob's end.
//
// needs: decoders/serial_prologue.glsl, decoders/serial_epilogue.glsl
// optional: APEX, TRIANGLE, VALUES, RESIDUAL, RESIDUALS, NORMALS
// optional: OWN_VALUES, OWN_GRID_POSITION, VERTEX_STEP

#include "format/constants.h"

#ifndef RESIDUALS
#define RESIDUALS 256u  // of a list; 4 are enough if nothing calls read_residuals
#endif

#ifndef VERTEX_STEP
#define ALIGNED
#define VERTEX_STEP 1u
#define ELEMENT_STEP 64u
#define STREAM_ROOM(elements) (elements)
#endif

uint error;

// --- the blob ---

uint stream_total;  // streams in the blob
uint stream_first;  // streams [stream_first, stream_end) are decoded; the others are only skipped
uint stream_end;
bool needs_positions;  // a decoded stream is predicted from stream 0, which is decoded for it
bool needs_normals;    // a decoded stream has the GEO predictor
uint meshlet_total;
uint byte_length;
uint group_table;  // word index
small_uint stream_elements[MAX_STREAMS];
small_uint stream_predictor[MAX_STREAMS];
small_uint stream_chain_base[MAX_STREAMS];
small_uint stream_interior_base[MAX_STREAMS];
small_uint stream_anchor_base[MAX_STREAMS];
uint stream_mask[MAX_STREAMS];  // (1 << bits) - 1
small_uint stream_bits[MAX_STREAMS];
small_uint stream_element[MAX_STREAMS];  // in `values`, of a decoded stream's first

// Reads the header. read_blob_header has checked it: all tables lie inside the blob.
void load_tables() {
  stream_total = (load_word(BLOB_WORD_VERSION) >> 8) & 255u;
  meshlet_total = load_word(BLOB_WORD_MESHLETS);
  byte_length = load_word(BLOB_WORD_BYTES);
  group_table = BLOB_HEADER_WORDS + BLOB_STREAM_WORDS * stream_total;
}

#define STREAM_SHAPE_WORD(s) (BLOB_HEADER_WORDS + BLOB_STREAM_WORDS * (s))
#define STREAM_BASES_WORD(s) (BLOB_HEADER_WORDS + 1u + BLOB_STREAM_WORDS * (s))

bool is_decoded(uint s) {
  return s < stream_end && (s >= stream_first || (s == 0u && needs_positions));
}

// Reads header and stream table.
void load_streams(uint first, uint end) {
  load_tables();
  stream_first = first;
  stream_end = end;
  needs_positions = false;
  needs_normals = false;
  for (uint s = first; s < end; s++) {
    uint predictor = load_word(STREAM_SHAPE_WORD(s)) >> 24;
    needs_positions = needs_positions || predictor >= PREDICT_GEO;
    needs_normals = needs_normals || predictor == PREDICT_GEO;
  }
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
    stream_anchor_base[s] = small_uint((bases >> 16) & 255u);
    stream_element[s] = small_uint(element);
    if (is_decoded(s)) element += STREAM_ROOM((shape >> 8) & 255u);
  }
}

// Byte offset of meshlet m's data, modulo 2^32.
uint meshlet_start(uint m) {
  uint group = group_table + BLOB_GROUP_WORDS * (m / BLOB_GROUP_MESHLETS);
  uint base = load_word(group);
  uint line = load_word(group + 1u);  // stride | bias << 16
  uint width = load_word(group + 2u) & 31u;
  uint i = m % BLOB_GROUP_MESHLETS;
  uint rest = meshlet_total - (m - i);
  uint count = rest < BLOB_GROUP_MESHLETS ? rest : BLOB_GROUP_MESHLETS;
  return base + ((count * width + 7u) >> 3) + (line & 0xFFFFu) * i - (line >> 16) +
         load_bits(8u * base + i * width, width);
}

// --- a meshlet's header and references (sections A and B) ---

struct Header {
  uint meshlet;
  uint triangles;
  uint references;
  uint flags;
  uint table;    // the connectivity table
  uint begin;    // bit positions: the symbols,
  uint lengths;  //   the stored lengths,
  uint entries;  //   the foreign references' entries,
  uint codes;    //   the codes
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

// The planes of section A: bit t of p0 says whether triangle t is no R; each later plane has a bit
// for every one of the plane before.
struct Planes {
  mask64 p0;
  mask64 p1;
  mask64 p2;
  mask64 p3;
  uint end;  // bit position of section B
};

Planes load_planes(uint begin, uint triangles) {
  Planes planes;
  uint p = begin;
  uint count = triangles - 1u;  // the last symbol is E
  planes.p0 = load_mask(p, count);
  p += count;
  count = mask_count(planes.p0);
  planes.p1 = load_mask(p, count);
  p += count;
  count = mask_count(planes.p1);
  planes.p2 = load_mask(p, count);
  p += count;
  count = mask_count(planes.p2);
  planes.p3 = load_mask(p, count);
  planes.end = p + count;
  return planes;
}

// The triangles of each symbol; all others are L.
struct SymbolMasks {
  mask64 r;
  mask64 e;
  mask64 c;
  mask64 s;
};

SymbolMasks symbol_masks(Planes planes, uint triangles, uint table) {
  mask64 rest = planes.p0;
  mask64 after_first = mask_scatter(planes.p1, rest);
  mask64 after_second = mask_scatter(planes.p2, after_first);
  mask64 last = mask_bit(triangles - 1u);
  mask64 first = rest & ~after_first;
  mask64 second = after_first & ~after_second;
  SymbolMasks y;
  y.s = mask_scatter(planes.p3, after_second);
  y.r = mask_below(triangles - 1u) & ~rest;
  y.c = choose(table == 0u, first, second);
  y.e = choose(table == 0u, second, after_second & ~y.s) | last;
  return y;
}

// Sets `error` if the header is malformed; the counts returned are bounded even then.
Header read_header(uint m) {
  Header h;
  uint fields = load_word(group_table + BLOB_GROUP_WORDS * (m / BLOB_GROUP_MESHLETS) + 2u);
  uint start = meshlet_start(m);
  if (m >= meshlet_total || start >= byte_length - BLOB_PADDING_BYTES) {
    error = ERROR_OFFSET;
    start = 0u;
  }
  uint p = 8u * start;
  uint bits = load_bits(p, BLOB_TRIANGLE_BITS + BLOB_REFERENCE_BITS + 4u);
  uint reference_width = (fields >> GROUP_REFERENCE_SHIFT) & 7u;
  h.meshlet = m;
  h.triangles = (bits & (MESHLET_TRIANGLES - 1u)) + 1u;
  h.references = (bits >> BLOB_TRIANGLE_BITS) & ((1u << reference_width) - 1u) & 63u;
  bits = bits >> (BLOB_TRIANGLE_BITS + reference_width);
  p += BLOB_TRIANGLE_BITS + reference_width;
  h.flags = 0u;
  for (uint flag = FLAG_LOOPS; flag <= FLAG_SEAMS; flag += flag) {
    uint stored = (fields >> GROUP_FLAGS_SHIFT) & flag;
    if (stored != 0u) {
      if ((bits & 1u) != 0u) h.flags = h.flags | flag;
      bits = bits >> 1;
      p++;
    }
  }
  h.delta_width = (fields >> GROUP_DELTA_SHIFT) & 31u;
  h.slot_width = (fields >> GROUP_SLOT_SHIFT) & 7u;
  h.table = (fields >> GROUP_TABLE_SHIFT) & 1u;
  h.begin = p;
  p = load_planes(p, h.triangles).end;
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

uint unzigzag(uint u) { return (u >> 1) ^ (0u - (u & 1u)); }

// --- a meshlet's lists ---

// Each stream has three lists: anchors, chains (of owned references) and interior. After the codes
// come the anchors of all streams, the low bits and then the unary parts of all chains, unary parts
// and low bits of stream 0's interior, and those of all other interiors.

small_uint chain_code[MAX_STREAMS];     // a Rice parameter, or CODE_FIXED
small_uint interior_code[MAX_STREAMS];  // a parameter, + CODE_EXPONENTIAL; or CODE_FIXED
uint chain_widths[MAX_STREAMS];         // bit position of the 5-bit widths of a fixed code
uint interior_widths[MAX_STREAMS];
uint anchor_position[MAX_STREAMS];  // bit position of the first anchor
small_uint anchor_count[MAX_STREAMS];
uint chain_total;             // inner vertices of all owned references
uint chain_low[MAX_STREAMS];  // bit position of the chains' low bits
uint chain_unary;             // bit position of the unary parts of all chains

UnaryReader unary;  // the next list's unary parts
uint low_cursor;    // and bit position of its low bits
#ifndef RESIDUAL
#define RESIDUAL(i) residuals[i]
uint residuals[RESIDUALS];  // of one list, vertex by vertex
#endif

uint width_field(uint position) {
  uint w = load_bits(position, WIDTH_BITS);
  return w == WIDTH_ESCAPE ? 32u : w;
}

// Moves low_cursor past n bits. Sets `error` and returns false if they do not lie inside the blob.
bool take_low_bits(uint n) {
  bool inside = !ends_after(low_cursor, n, 8u * (byte_length - BLOB_PADDING_BYTES));
  if (!inside) error = ERROR_UNARY;
  low_cursor += n;
  return inside;
}

uint code_cursor;  // bit position, moved by read_code

// is_chain: a chain's code, which is never exp-Golomb.
uint read_code(uint s, uint base, bool is_chain) {
  uint field = load_bits(code_cursor, CODE_BITS);
  code_cursor += CODE_BITS;
  if (field == CODE_ESCAPE) {
    code_cursor += WIDTH_BITS * stream_elements[s];
    return CODE_FIXED;
  }
  bool exponential = field >= CODE_FIRST_EXPONENTIAL && !is_chain;
  uint k = base + field;
  if (exponential) k = max(base, 1u) - 1u + field - CODE_FIRST_EXPONENTIAL;
  if (k > CODE_MAX_PARAMETER) error = ERROR_CODE;
  return (k & CODE_MAX_PARAMETER) + (exponential ? CODE_EXPONENTIAL : 0u);
}

// Bits of one vertex of stream s under a fixed code.
uint fixed_bits(uint s, uint widths) {
  uint sum = 0u;
  for (uint c = 0u; c < stream_elements[s]; c++) sum += width_field(widths + WIDTH_BITS * c);
  return sum;
}

// Low bits of one vertex of stream s under a code without exp-Golomb.
uint low_bits(uint s, uint code, uint widths) {
  return code == CODE_FIXED ? fixed_bits(s, widths) : code * stream_elements[s];
}

// Bits of element c of the further anchors of stream s, whose width fields begin at bit `fields`.
uint anchor_width(uint s, uint fields, uint c) {
  uint field = load_bits(fields + ANCHOR_WIDTH_BITS * c, ANCHOR_WIDTH_BITS);
  uint bits = stream_bits[s];
  return field == ANCHOR_WIDTH_FULL ? bits : min(stream_anchor_base[s] + field, bits);
}

// Bits of the first anchor of stream s.
uint first_anchor_bits(uint s) { return stream_elements[s] * stream_bits[s]; }

// Bits of one further anchor of stream s.
uint further_anchor_bits(uint s) {
  uint fields = anchor_position[s] + first_anchor_bits(s);
  uint sum = 0u;
  for (uint c = 0u; c < stream_elements[s]; c++) sum += anchor_width(s, fields, c);
  return sum;
}

// Bits of all anchors of stream s.
uint anchor_bits(uint s) {
  uint count = anchor_count[s];
  if (count <= 1u) return count * first_anchor_bits(s);
  return first_anchor_bits(s) + ANCHOR_WIDTH_BITS * stream_elements[s] +
         (count - 1u) * further_anchor_bits(s);
}

// Reads the residuals of `count` <= 64 vertices of stream s, and moves behind them.
void read_residuals(uint s, uint count, uint code, uint widths) {
  uint elements = stream_elements[s];
  if (code != CODE_FIXED) {
    read_codes(count * elements, code);
    return;
  }
  uint step = fixed_bits(s, widths);
  uint low = low_cursor;
  if (!take_low_bits(count * step)) return;
  for (uint c = 0u; c < elements; c++) {
    uint width = width_field(widths + WIDTH_BITS * c);
    for (uint i = 0u; i < count; i++)
      RESIDUAL(i * elements + c) = unzigzag(load_inside(low + i * step, width));
    low += width;
  }
}

void skip_residuals(uint s, uint count, uint code, uint widths) {
  if (code == CODE_FIXED) {
    low_cursor += count * fixed_bits(s, widths);
    return;
  }
  uint before = unary.cursor;
  uint n = count * stream_elements[s];
  skip_unary(n);
  low_cursor += n * (code & CODE_MAX_PARAMETER);
  if ((code & CODE_EXPONENTIAL) != 0u) low_cursor += unary.cursor - before - n;
}

// Number of unary parts of `count` vertices of stream s.
uint unary_count(uint s, uint count, uint code) {
  return code == CODE_FIXED ? 0u : count * stream_elements[s];
}

// Begins to read lists at bit p whose unary parts are n ones: `unary` there, `low_cursor` behind
// them.
void open_lists(uint p, uint n) {
  unary = seek_unary(p);
  skip_unary(n);
  low_cursor = unary.cursor;
  unary = seek_unary(p);
}

// Reads the codes of all streams at bit p. Returns the bit behind them.
uint read_list_codes(uint p, bool chains) {
  code_cursor = p;
  for (uint s = 0u; s < stream_total; s++) {
    chain_code[s] = small_uint(0u);
    if (chains) {
      chain_widths[s] = code_cursor + CODE_BITS;
      chain_code[s] = small_uint(read_code(s, stream_chain_base[s], true));
    }
    interior_widths[s] = code_cursor + CODE_BITS;
    interior_code[s] = small_uint(read_code(s, stream_interior_base[s], false));
  }
  return code_cursor;
}

// Finds the lists of the meshlet of h. `loops`: its number of disks; needed only if it has no
// references.
void find_lists(HEADER_IN h, uint loops) {
  bool chains = mask_any(h.owned_refs);
  uint p = read_list_codes(h.codes, chains);
  chain_total = 0u;
  for (mask64 rest = h.owned_refs; mask_any(rest); rest = mask_clear_lsb(rest))
    chain_total += stored_length(h, mask_lsb(rest)) - 1u;
  uint count = loops;
  for (uint s = 0u; s < stream_total; s++) {
    if (h.references > 0u && (s == 0u || (h.flags & FLAG_SEAMS) != 0u))
      count = mask_count(stored_corners(h, seam_references(h, s)));
    anchor_position[s] = p;
    anchor_count[s] = small_uint(count);
    p += anchor_bits(s);
  }
  for (uint s = 0u; s < stream_total; s++) {
    chain_low[s] = p;
    if (chains) p += chain_total * low_bits(s, chain_code[s], chain_widths[s]);
  }
  chain_unary = p;
}

// Begins to read the chains.
void open_chains() {
  unary = seek_unary(chain_unary);
  low_cursor = chain_low[0];
}

void skip_chains(HEADER_IN h, uint s) {
  if (mask_any(h.owned_refs)) skip_residuals(s, chain_total, chain_code[s], chain_widths[s]);
}

// --- values ---

#ifndef VALUES
#define VALUES(i) values[i]
ALIGNED uint values[MAX_ELEMENTS * 64];
#endif

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

void read_symbols(HEADER_IN h) {
  SymbolMasks y = symbol_masks(load_planes(h.begin, h.triangles), h.triangles, h.table);
  triangle_count = h.triangles;
  symbol_r = y.r;
  symbol_e = y.e;
  symbol_c = y.c;
  symbol_s = y.s;
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
    uint popped = 0u;  // of all vertices that are popped: 64 or more if there was none
    while (mask_any(resolved)) {
      uint u = mask_msb(resolved);
      uint v = mask_msb(alive);
      bool closes = mask_test(symbol_c, u);
      SET_APEX(u, v);
      popped = popped | v;
      alive = choose(closes, alive & ~mask_bit(v), alive | mask_bit(count));
      count += uint(!closes);
      resolved = resolved & ~mask_bit(u);
    }
    uint last = mask_msb(alive);
    if (popped >= 64u || last >= 64u) {
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
  uint gate = 0u;            // a | b << 8 | o << 24
  uint disk = 0u;
  uint t = 0u;
  while (t < triangle_count) {
    if (mask_test(disk_starts, t)) {
      gate = pack4(disk_gate[disk], disk_first[disk], 0u, NO_VERTEX);
      disk++;
    }
    uint end = mask_lsb(symbol_e & ~mask_below(t));  // exists: decode_apexes checked
    for (; t <= end; t++) {
      uint v = APEX(t);
      TRIANGLE(t) = gate | v << 16;
      // The next gate is (a, v) across from b after R, (v, b) across from a after C, L and S.
      uint place = mask_test(symbol_r, t) ? 8u : 0u;
      gate = (gate & (0xFF00u >> place)) | v << place | (gate >> place) << 24;
    }
    uint last = mask_msb(splits & mask_below(t));
    if (last < 64u) {
      uint split = TRIANGLE(last);
      splits = splits & ~mask_bit(last);
      gate = pack4(split & 255u, (split >> 16) & 255u, 0u, (split >> 8) & 255u);
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
// lists.
Header visited;
uint located;

void visit(uint m) {
  if (visited.meshlet != m) visited = read_header(m);
}

void locate_visited() {
  if (located == visited.meshlet) return;
  find_lists(visited, 0u);
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

// --- prediction from positions: GEO and AFFINE ---

// All arithmetic is modulo 2^32. Signed numbers are uints too: int only where the sign matters.

uint magnitude(uint x) { return int(x) < 0 ? 0u - x : x; }
uint shift_right(uint x, uint n) { return uint(int(x) >> n); }  // keeps the sign
// x / d toward zero, for d > 0.
uint signed_quotient(uint x, uint d) {
  uint quotient = magnitude(x) / d;
  return int(x) < 0 ? 0u - quotient : quotient;
}

struct Triple {
  uint x;
  uint y;
  uint z;
};

// Stream 0's integers of a vertex of the meshlet.
#ifdef OWN_GRID_POSITION
Triple grid_position(uint id);  // defined by the includer
#else
Triple grid_position(uint id) {
  Triple p;
  p.x = VALUES(VERTEX_STEP * id);
  p.y = VALUES(VERTEX_STEP * id + ELEMENT_STEP);
  p.z = VALUES(VERTEX_STEP * id + 2u * ELEMENT_STEP);
  return p;
}
#endif

INLINE Triple shifted(Triple v, uint n) {
  v.x = shift_right(v.x, n);
  v.y = shift_right(v.y, n);
  v.z = shift_right(v.z, n);
  return v;
}

INLINE Triple difference(Triple to, Triple from) {
  to.x -= from.x;
  to.y -= from.y;
  to.z -= from.z;
  return to;
}

INLINE uint dot3(Triple v, Triple w) { return v.x * w.x + v.y * w.y + v.z * w.z; }

// A number whose bit length is that of the largest magnitude.
INLINE uint magnitudes(Triple v) { return magnitude(v.x) | magnitude(v.y) | magnitude(v.z); }

// max(x - y, 0)
uint excess(uint x, uint y) { return x > y ? x - y : 0u; }

#ifndef NORMALS
#define NORMALS(i) normals[i]
uint normals[256];  // the sum at a vertex of its triangles' normals: normals[4 * local id + axis]
#endif

// Cross product of a packed triangle's edges. h: low bits of the positions that it ignores.
INLINE Triple triangle_normal(uint triangle, uint h) {
  Triple a = shifted(grid_position(triangle & 63u), h);
  Triple e = difference(shifted(grid_position((triangle >> 8) & 63u), h), a);
  Triple f = difference(shifted(grid_position((triangle >> 16) & 63u), h), a);
  Triple n;
  n.x = e.y * f.z - e.z * f.y;
  n.y = e.z * f.x - e.x * f.z;
  n.z = e.x * f.y - e.y * f.x;
  return n;
}

// Fills `normals`. Needs the values of stream 0.
void sum_normals() {
  uint h = excess(stream_bits[0], GEO_POSITION_BITS);
  for (uint i = 0u; i < 4u * vertex_count; i++) NORMALS(i) = 0u;
  for (uint t = 0u; t < triangle_count; t++) {
    uint triangle = TRIANGLE(t);
    Triple n = triangle_normal(triangle, h);
    for (uint k = 0u; k < 3u; k++) {
      uint i = 4u * ((triangle >> (8u * k)) & 255u);
      NORMALS(i) += n.x;
      NORMALS(i + 1u) += n.y;
      NORMALS(i + 2u) += n.z;
    }
  }
}

struct OctPair {
  uint u;
  uint v;
};

// The octahedral integers of a normal (x, y, z), for a stream of `bits` bits.
OctPair octahedral_prediction(uint normal_x, uint normal_y, uint normal_z, uint bits) {
  Triple n;
  n.x = normal_x;
  n.y = normal_y;
  n.z = normal_z;
  uint k = excess(bit_length(magnitudes(n)), 13u);
  uint limit = (1u << bits) - 2u;
  uint x = magnitude(n.x) >> k;
  uint y = magnitude(n.y) >> k;
  uint z = magnitude(n.z) >> k;
  uint sum = x + y + z;
  OctPair q;
  q.u = limit >> 1;
  q.v = limit >> 1;
  if (sum == 0u) return q;
  bool below = int(n.z) < 0;
  uint u = below ? sum - y : x;
  uint v = below ? sum - x : y;
  u = int(n.x) < 0 ? sum - u : sum + u;
  v = int(n.y) < 0 ? sum - v : sum + v;
  q.u = (u * limit + sum) / (2u * sum);
  q.v = (v * limit + sum) / (2u * sum);
  return q;
}

// A vertex as a + s (b - a) + u (o - a), s and u in 1/256.
struct Weights {
  bool exist;
  uint s;
  uint u;
};

// The weights by which the position of v follows from those of a, b and o; none if these are
// almost collinear.
Weights affine_weights(uint a, uint b, uint o, uint v) {
  Triple origin = grid_position(a);
  Triple e = difference(grid_position(b), origin);
  Triple f = difference(grid_position(o), origin);
  Triple r = difference(grid_position(v), origin);
  uint h = excess(bit_length(magnitudes(e) | magnitudes(f) | magnitudes(r)), 14u);
  e = shifted(e, h);
  f = shifted(f, h);
  r = shifted(r, h);
  uint ee = dot3(e, e);
  uint ef = dot3(e, f);
  uint ff = dot3(f, f);
  uint re = dot3(r, e);
  uint rf = dot3(r, f);
  uint n = bit_length(ee | ff | magnitude(re) | magnitude(rf));
  uint up = excess(15u, n);
  uint down = excess(n, 15u);
  ee = shift_right(ee << up, down);
  ef = shift_right(ef << up, down);
  ff = shift_right(ff << up, down);
  re = shift_right(re << up, down);
  rf = shift_right(rf << up, down);
  uint product = ee * ff;
  uint determinant = product - ef * ef;
  uint d = determinant >> 8;
  Weights w;
  w.exist = int(determinant) > (int(product) >> 5) && d != 0u;
  w.s = 0u;
  w.u = 0u;
  if (!w.exist) return w;
  w.s = signed_quotient(re * ff - rf * ef, d);
  w.u = signed_quotient(rf * ee - re * ef, d);
  w.exist = magnitude(w.s) < AFFINE_WEIGHT_LIMIT && magnitude(w.u) < AFFINE_WEIGHT_LIMIT;
  return w;
}

// The position of v projected onto the line from a to b: weights without o.
Weights line_weights(uint a, uint b, uint v) {
  Triple origin = grid_position(a);
  Triple e = difference(grid_position(b), origin);
  Triple r = difference(grid_position(v), origin);
  uint h = excess(bit_length(magnitudes(e) | magnitudes(r)), 10u);
  e = shifted(e, h);
  r = shifted(r, h);
  uint ee = dot3(e, e);
  uint re = dot3(r, e);
  Weights w;
  w.exist = int(ee) > 0 && int(re) >= 0 && int(re) <= int(ee);
  w.s = 0u;
  w.u = 0u;
  if (w.exist) w.s = (re * 256u + (ee >> 1)) / ee;
  return w;
}

uint affine_point(Weights w, uint a, uint b, uint o) {
  return a + shift_right(w.s * (b - a) + w.u * (o - a) + 128u, 8u);
}

// --- chains ---

// Chain vertices in the order of their residuals. chain_step: vertex | the one before << 8 | the
// chain's last << 16 | the one before the one before, or NO_VERTEX << 24.
uint chain_count;
uint chain_step[64];
small_uint chain_left[64];  // edges from the vertex before to the last

// Lists the inner vertices of reference r. A foreign chain runs backwards, in its owner's
// direction.
void list_chain(uint r, bool backwards) {
  uint n = reference_length[r];
  uint rank = reference_rank[r];
  uint before = backwards ? reference_end[r] : loop_vertex[rank];
  uint end = backwards ? loop_vertex[rank] : reference_end[r];
  uint earlier = NO_VERTEX;
  for (uint i = 1u; i < n && chain_count < 64u; i++) {
    uint v = loop_vertex[(rank + (backwards ? n - i : i)) & 63u];
    chain_step[chain_count] = pack4(v, before, end, earlier);
    chain_left[chain_count] = small_uint(n - i + 1u);
    chain_count++;
    earlier = before;
    before = v;
  }
}

void list_chains(mask64 refs) {
  chain_count = 0u;
  for (; mask_any(refs); refs = mask_clear_lsb(refs)) list_chain(mask_lsb(refs), false);
}

// The next point on the way from a to b, n edges away, rounded. a and b have up to 24 bits: the
// bias keeps the dividend positive.
INLINE uint toward(uint a, uint b, uint n) {
  return a + divide(b - a + (n >> 1) + (n << 24), n) - (1u << 24);
}

// AFFINE: the weights of the vertex of a chain step.
Weights chain_weights(uint step) {
  uint v = step & 255u;
  uint before = (step >> 8) & 255u;
  uint end = (step >> 16) & 255u;
  Weights w;
  w.exist = false;
  w.s = 0u;
  w.u = 0u;
  if (step >> 24 != NO_VERTEX) w = affine_weights(before, end, step >> 24, v);
  if (!w.exist) w = line_weights(before, end, v);
  return w;
}

// AFFINE: one element of a chain vertex from those of the steps' vertices.
uint affine_chain_point(Weights w, uint before, uint end, uint earlier, uint left) {
  return w.exist ? affine_point(w, before, end, earlier) : toward(before, end, left);
}

#ifndef OWN_VALUES

void predict_affine_chains(uint s) {
  index_uint base = stream_element[s] * 64u;
  uint elements = stream_elements[s];
  uint from = 0u;
  for (uint j = 0u; j < chain_count; j++) {
    uint step = chain_step[j];
    Weights w = chain_weights(step);
    index_uint v = base + VERTEX_STEP * (step & 255u);
    index_uint before = base + VERTEX_STEP * ((step >> 8) & 255u);
    index_uint end = base + VERTEX_STEP * ((step >> 16) & 255u);
    index_uint earlier = step >> 24 == NO_VERTEX ? before : base + VERTEX_STEP * (step >> 24);
    for (index_uint c = 0u; c < elements; c++) {
      uint point =
          affine_chain_point(w, VALUES(before + ELEMENT_STEP * c), VALUES(end + ELEMENT_STEP * c),
                             VALUES(earlier + ELEMENT_STEP * c), chain_left[j]);
      VALUES(v + ELEMENT_STEP * c) = (point + RESIDUAL(from + c)) & stream_mask[s];
    }
    from += elements;
  }
}

// Values of the listed chain vertices for stream s: the next point, or the vertex before (COPY),
// plus residual.
INLINE void predict_chain_elements(uint s, bool copies, uint elements) {
  index_uint base = stream_element[s] * 64u;
  index_uint from = 0u;
  uint bits = stream_mask[s];
  uint count = chain_count;
  for (uint j = 0u; j < count; j++) {
    uint step = chain_step[j];
    index_uint v = base + VERTEX_STEP * (step & 255u);
    index_uint before = base + VERTEX_STEP * ((step >> 8) & 255u);
    index_uint end = base + VERTEX_STEP * ((step >> 16) & 255u);
    uint left = chain_left[j];
    for (index_uint c = 0u; c < elements; c++) {
      uint point = VALUES(before + ELEMENT_STEP * c);
      if (!copies) point = toward(point, VALUES(end + ELEMENT_STEP * c), left);
      VALUES(v + ELEMENT_STEP * c) = (point + RESIDUAL(from + c)) & bits;
    }
    from += elements;
  }
}

void predict_chains(uint s) {
  bool copies = stream_predictor[s] == PREDICT_COPY;
  uint elements = stream_elements[s];
  if (stream_predictor[s] == PREDICT_AFFINE)
    predict_affine_chains(s);
  else if (!copies && elements == 3u)
    predict_chain_elements(s, false, 3u);
  else if (!copies && elements == 2u)
    predict_chain_elements(s, false, 2u);
  else
    predict_chain_elements(s, copies, elements);
}

#endif

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
  locate_visited();
  open_chains();
  for (uint s = 0u; s < stream_end; s++) {
    if (is_decoded(s) && mask_test(shared_references(h, s), r)) {
      skip_residuals(s, first, chain_code[s], chain_widths[s]);
      read_residuals(s, count, chain_code[s], chain_widths[s]);
      predict_chains(s);
      skip_residuals(s, excess(chain_total, first + count), chain_code[s], chain_widths[s]);
    } else {
      skip_chains(visited, s);
    }
  }
}

// Writes anchor `index` of stream s as the value of `vertex`. Needs find_lists.
void read_anchor(uint s, uint index, uint vertex) {
  uint elements = stream_elements[s];
  uint bits = stream_bits[s];
  uint first = anchor_position[s];
  uint fields = first + elements * bits;
  uint further = fields + ANCHOR_WIDTH_BITS * elements;
  if (index > 1u) further += (index - 1u) * further_anchor_bits(s);
  for (uint c = 0u; c < elements; c++) {
    uint value = load_bits(first + c * bits, bits);
    if (index > 0u) {
      uint width = anchor_width(s, fields, c);
      value += unzigzag(load_bits(further, width));
      further += width;
    }
    VALUES(64u * stream_element[s] + VERTEX_STEP * vertex + ELEMENT_STEP * c) =
        value & stream_mask[s];
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
      uint index = mask_count(stored & mask_below(corner));
      for (uint i = s; i < end; i++)
        if (is_decoded(i)) read_anchor(i, index, vertex);
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

void read_foreign_corners(HEADER_IN h) {
  bool seams = mask_any(seamed_refs);
  for (uint r = 0u; r < h.references; r++) {
    uint before = previous_reference(h, r);
    uint vertex = loop_vertex[reference_rank[r]];
    uint s = needs_positions ? 0u : stream_first;
    while (s < stream_end && error == ERROR_NONE) {
      uint source = corner_source(h, r, before, s);
      if (!is_decoded(s))
        s++;
      else if (source == 64u)
        s = seams ? s + 1u : stream_end;
      else
        s += fetch_corner(reference_owner[source], reference_slot[source], source == r, vertex, s,
                          seams);
    }
  }
}

// After the foreign corners: foreign chains are predicted from them.
void read_foreign_chains(HEADER_IN h) {
  for (mask64 rest = h.foreign_refs; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    if (reference_length[r] > 1u) {
      visit(reference_owner[r]);
      read_foreign_chain(h, r, slot_reference(visited, reference_slot[r]));
    }
  }
}

#ifndef OWN_VALUES

// The anchors of stream s are those of the corners `stored`, or of the first vertex of each disk.
void read_own_anchors(HEADER_IN h, uint s, mask64 stored) {
  uint elements = stream_elements[s];
  uint bits = stream_bits[s];
  uint count = anchor_count[s];
  uint fields = anchor_position[s] + elements * bits;
  uint first = anchor_position[s];
  uint step = count > 1u ? further_anchor_bits(s) : 0u;
  uint further = fields + ANCHOR_WIDTH_BITS * elements;
  for (uint c = 0u; c < elements; c++) {
    uint width = anchor_width(s, fields, c);
    uint base = load_bits(first, bits);
    uint at = further;
    mask64 corners = stored;
    for (uint i = 0u; i < count; i++) {
      uint vertex = disk_first[i];
      if (h.references > 0u) vertex = loop_vertex[reference_rank[mask_lsb(corners) & 63u]];
      corners = mask_clear_lsb(corners);
      uint value = base;
      if (i > 0u) {
        value += unzigzag(load_bits(at, width));
        at += step;
      }
      VALUES(64u * stream_element[s] + VERTEX_STEP * vertex + ELEMENT_STEP * c) =
          value & stream_mask[s];
    }
    first += bits;
    further += width;
  }
}

#endif

// Reads the anchors of all streams.
void read_anchors(HEADER_IN h) {
  mask64 stored = stored_corners(h, mask_none());  // of stream 0, and of all without seams
  bool seams = mask_any(seamed_refs);
  for (uint s = 0u; s < stream_end; s++) {
    if (seams) stored = stored_corners(h, seam_refs[s]);
    if (is_decoded(s)) read_own_anchors(h, s, stored);
  }
}

// Reads the chains of all streams. Needs the corners.
void read_chains(HEADER_IN h) {
  list_chains(h.owned_refs);
  open_chains();
  for (uint s = 0u; s < stream_total; s++) {
    if (chain_total > 0u && is_decoded(s)) {
      read_residuals(s, chain_total, chain_code[s], chain_widths[s]);
      predict_chains(s);
    } else {
      skip_chains(h, s);
    }
  }
}

// --- interior ---

// Predicts one element of a traversed vertex from the gate's vertices a and b and, if there is a
// triangle across the gate, from that triangle's vertex o.
INLINE uint traversed_prediction(uint predictor, uint a, uint b, uint o, bool across) {
  if (predictor == PREDICT_COPY) return a;
  uint sum = a + b;
  if (predictor == PREDICT_MEAN || !across) return sum >> 1;
  if (predictor == PREDICT_DAMPED) return uint(int(3u * sum - 2u * o + 2u) >> 2);
  return sum - o;
}

// AFFINE: the weights of a traversed vertex.
Weights traversed_weights(uint triangle) {
  Weights w;
  w.exist = false;
  w.s = 0u;
  w.u = 0u;
  if (triangle >> 24 != NO_VERTEX)
    w = affine_weights(triangle & 255u, (triangle >> 8) & 255u, triangle >> 24,
                       (triangle >> 16) & 255u);
  return w;
}

#ifndef OWN_VALUES

// `from`: index of the first traversed vertex's residual.
INLINE void predict_elements(uint s, uint from, uint predictor, uint elements) {
  index_uint base = stream_element[s] * 64u;
  index_uint at = from;
  uint bits = stream_mask[s];
  uint count = traversed_count;
  for (uint i = 0u; i < count; i++) {
    uint triangle = traversed[i];
    index_uint a = base + VERTEX_STEP * (triangle & 255u);
    index_uint b = base + VERTEX_STEP * ((triangle >> 8) & 255u);
    index_uint v = base + VERTEX_STEP * ((triangle >> 16) & 255u);
    index_uint o = base + VERTEX_STEP * (triangle >> 24);
    bool across = triangle >> 24 != NO_VERTEX;
    for (index_uint c = 0u; c < elements; c++) {
      uint beyond = across ? VALUES(o + ELEMENT_STEP * c) : 0u;
      uint prediction = traversed_prediction(predictor, VALUES(a + ELEMENT_STEP * c),
                                             VALUES(b + ELEMENT_STEP * c), beyond, across);
      VALUES(v + ELEMENT_STEP * c) = (prediction + RESIDUAL(at + c)) & bits;
    }
    at += elements;
  }
}

// `first`: number of residuals of vertices before the first traversed one.
void predict_geo(uint s, uint first) {
  index_uint base = stream_element[s] * 64u;
  uint at = 2u * first;
  uint bits = stream_mask[s];
  for (uint i = 0u; i < traversed_count; i++) {
    uint v = (traversed[i] >> 16) & 255u;
    OctPair q = octahedral_prediction(NORMALS(4u * v), NORMALS(4u * v + 1u), NORMALS(4u * v + 2u),
                                      stream_bits[s]);
    index_uint to = base + VERTEX_STEP * v;
    VALUES(to) = (q.u + RESIDUAL(at)) & bits;
    VALUES(to + ELEMENT_STEP) = (q.v + RESIDUAL(at + 1u)) & bits;
    at += 2u;
  }
}

INLINE void predict_affine_elements(uint s, uint first, uint elements) {
  index_uint base = stream_element[s] * 64u;
  index_uint at = elements * first;
  uint bits = stream_mask[s];
  uint count = traversed_count;
  for (uint i = 0u; i < count; i++) {
    uint triangle = traversed[i];
    bool across = triangle >> 24 != NO_VERTEX;
    Weights w = traversed_weights(triangle);
    index_uint a = base + VERTEX_STEP * (triangle & 255u);
    index_uint b = base + VERTEX_STEP * ((triangle >> 8) & 255u);
    index_uint v = base + VERTEX_STEP * ((triangle >> 16) & 255u);
    index_uint o = across ? base + VERTEX_STEP * (triangle >> 24) : a;
    for (index_uint c = 0u; c < elements; c++) {
      uint at_a = VALUES(a + ELEMENT_STEP * c);
      uint at_b = VALUES(b + ELEMENT_STEP * c);
      uint at_o = VALUES(o + ELEMENT_STEP * c);
      uint parallelogram = traversed_prediction(PREDICT_PARALLELOGRAM, at_a, at_b, at_o, across);
      uint point = choose(w.exist, affine_point(w, at_a, at_b, at_o), parallelogram);
      VALUES(v + ELEMENT_STEP * c) = (point + RESIDUAL(at + c)) & bits;
    }
    at += elements;
  }
}

void predict_affine(uint s, uint first) {
  if (stream_elements[s] == 2u)
    predict_affine_elements(s, first, 2u);
  else
    predict_affine_elements(s, first, stream_elements[s]);
}

// Constants instead of variables for the common cases.
void predict_traversed(uint s, uint first) {
  uint predictor = stream_predictor[s];
  uint elements = stream_elements[s];
  uint from = first * elements;
  if (predictor == PREDICT_GEO)
    predict_geo(s, first);
  else if (predictor == PREDICT_AFFINE)
    predict_affine(s, first);
  else if (predictor == PREDICT_PARALLELOGRAM && elements == 3u)
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

void finish_positions() {
  if (needs_normals) sum_normals();
}

#endif

// Number of inner vertices of the foreign references that store their own values for stream s.
uint seam_vertices(uint s) {
  uint count = 0u;
  for (mask64 rest = seam_refs[s]; mask_any(rest); rest = mask_clear_lsb(rest))
    count += reference_length[mask_lsb(rest)] - 1u;
  return count;
}

uint interior_vertices(uint s) { return traversed_count + seam_vertices(s); }

// Reads the interiors of the streams [first, end), whose unary parts begin at bit p.
void read_own_interior(uint p, uint first, uint end) {
  uint codes = 0u;
  for (uint s = first; s < end; s++)
    codes += unary_count(s, interior_vertices(s), interior_code[s]);
  open_lists(p, codes);
  for (uint s = first; s < end; s++) {
    uint count = interior_vertices(s);
    if (is_decoded(s)) {
      read_residuals(s, count, interior_code[s], interior_widths[s]);
      list_chains(seam_refs[s]);
      predict_chains(s);
      predict_traversed(s, chain_count);
    } else {
      skip_residuals(s, count, interior_code[s], interior_widths[s]);
    }
  }
  if (low_cursor > 8u * (byte_length - BLOB_PADDING_BYTES)) error = ERROR_UNARY;
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

// A meshlet in six steps. An includer that has the owners' values may leave out read_foreign: it
// puts foreign corners in place before read_chains and all foreign vertices before read_interiors.
void open_meshlet(uint m) {
  error = ERROR_NONE;
  unary = seek_unary(0u);  // forget what the includer may know of the last meshlet's lists
  triangle_count = 0u;
  vertex_count = 0u;
  visited.meshlet = NO_MESHLET;
  located = NO_MESHLET;
  opened = read_header(m);
  if (error != ERROR_NONE) return;
  read_symbols(opened);
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
  if (!mask_any(opened.foreign_refs)) return;
  read_foreign_corners(opened);
  if (error == ERROR_NONE) read_foreign_chains(opened);
}

// Finds the lists and reads the anchors.
void read_corners() {
  find_lists(opened, disk_count);
  if (error == ERROR_NONE) read_anchors(opened);
}

// Leaves low_cursor behind the last list that is decoded.
void read_interiors() {
  read_own_interior(unary.cursor, 0u, 1u);
  if (error != ERROR_NONE || stream_end <= 1u) return;
  finish_positions();
  read_own_interior(low_cursor, 1u, stream_total);
}

void decode_meshlet(uint m) {
  open_meshlet(m);
  if (error == ERROR_NONE) connect_meshlet();
  if (error == ERROR_NONE) read_foreign();
  if (error == ERROR_NONE) read_corners();
  if (error == ERROR_NONE) read_chains(opened);
  if (error == ERROR_NONE) read_interiors();
}

// The streams of a blob and small steps of reading a meshlet's sections, for shaders that decode a
// meshlet's values with several threads (team_values.glsl, passes.glsl). Include after
// serial_epilogue.glsl.

#define THREAD gl_LocalInvocationIndex
shared uint group_stream[MAX_STREAMS];  // see stream_field

// --- streams ---

// Offset and width of fields in group_stream.
#define STREAM_ELEMENTS 0, 3
#define STREAM_BITS 3, 6
#define STREAM_PREDICTOR 9, 2
#define STREAM_CHAIN_BASE 11, 5
#define STREAM_INTERIOR_BASE 16, 5
#define STREAM_ELEMENT 21, 11
#define stream_field(s, field) bitfieldExtract(group_stream[s], field)

// Reads the stream table; streams [0, end) are decoded.
void group_streams(uint end) {
  load_tables();
  stream_total = min(stream_total, MAX_STREAMS);
  stream_end = min(end, stream_total);
  for (uint s = THREAD; s < stream_total; s += gl_WorkGroupSize.x) {
    uint shape = load_word(STREAM_SHAPE_WORD(s));
    uint bases = load_word(STREAM_BASES_WORD(s));
    uint element = 0u;
    for (uint before = 0u; before < s; before++)
      element += (load_word(STREAM_SHAPE_WORD(before)) >> 8) & 7u;
    group_stream[s] = ((shape >> 8) & 7u) | ((shape >> 16) & 63u) << 3 | ((shape >> 24) & 3u) << 9 |
                      (bases & 31u) << 11 | ((bases >> 8) & 31u) << 16 |
                      min(element, MAX_ELEMENTS) << 21;
  }
  barrier();
}

uint bits_mask(uint s) { return word_below(stream_field(s, STREAM_BITS)); }

// Index of the first value of element c of stream s. The host makes sure that all elements fit;
// one that does not maps to the first.
uint value_element(uint s, uint c) {
  uint element = stream_field(s, STREAM_ELEMENT) + c;
  return (element < MAX_ELEMENTS ? element : 0u) * 64u;
}

// --- small parts ---

// Reads the code at bit p and moves p past it.
uint code_at(inout uint p, uint elements, uint base) {
  uint code = load_bits(p, CODE_BITS);
  p += CODE_BITS;
  if (code == CODE_ESCAPE) {
    p += WIDTH_BITS * elements;
    return CODE_FIXED;
  }
  if (base + code > RICE_MAX) error = ERROR_CODE;
  return (base + code) & RICE_MAX;
}

// Low bits of one vertex under a code. `widths`: bit position of the widths of a fixed code.
uint low_width(uint code, uint elements, uint widths) {
  if (code != CODE_FIXED) return code * elements;
  uint sum = 0u;
  for (uint c = 0u; c < elements; c++) sum += width_field(widths + WIDTH_BITS * c);
  return sum;
}

// The bit position after the n-th one from bit p.
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

// Number of vertices that the symbols of some triangles push, without the first of each disk: one
// for R and L, two for E.
uint pushed_vertices(mask64 some) {
  mask64 ends = symbol_e & some;
  mask64 lefts = mask_below(triangle_count) & some & ~(symbol_r | symbol_e | symbol_c | symbol_s);
  return mask_count((symbol_r & some) | lefts) + 2u * mask_count(ends);
}

uint owner_of(HEADER_IN h, uint r) { return entry_owner(h, entry_position(h, r)); }

// The streams of a blob, and small parts of reading a meshlet's sections, for shaders in which a
// meshlet's values are decoded by several invocations (team_values.glsl, passes.glsl). To be
// included after serial_epilogue.glsl.

#define THREAD gl_LocalInvocationIndex
shared uint group_stream[MAX_STREAMS];  // see stream_field

// --- streams ---

#define STREAM_ELEMENTS 0, 3  // offset and width of fields in group_stream
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
    uint shape = load_word(8u + 7u * s);
    uint bases = load_word(9u + 7u * s);
    uint element = 0u;
    for (uint before = 0u; before < s; before++) element += (load_word(8u + 7u * before) >> 8) & 7u;
    group_stream[s] = ((shape >> 8) & 7u) | ((shape >> 16) & 63u) << 3 | ((shape >> 24) & 3u) << 9 |
                      (bases & 31u) << 11 | ((bases >> 8) & 31u) << 16 |
                      min(element, MAX_ELEMENTS) << 21;
  }
  barrier();
}

uint bits_mask(uint s) { return word_below(stream_field(s, STREAM_BITS)); }

// Where a component's values begin; a element that there is no room for, which the host rules out,
// is the first.
uint value_element(uint s, uint c) {
  uint element = stream_field(s, STREAM_ELEMENT) + c;
  return (element < MAX_ELEMENTS ? element : 0u) * 64u;
}

// --- small parts ---

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

// Vertices that the symbols of some triangles push, their components' first ones left out: one for
// R and L, two for E.
uint pushed_vertices(mask64 some) {
  mask64 ends = symbol_e & some;
  mask64 lefts = mask_below(triangle_count) & some & ~(symbol_r | symbol_e | symbol_c | symbol_s);
  return mask_count((symbol_r & some) | lefts) + 2u * mask_count(ends);
}

uint owner_of(HEADER_IN h, uint r) { return entry_owner(h, entry_position(h, r)); }

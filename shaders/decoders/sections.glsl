// The streams of a blob and small steps of reading a meshlet's sections, for shaders that decode a
// meshlet's values with several threads (team_values.glsl, passes.glsl).
//
// needs: WORKGROUP
#ifndef SECTIONS_GLSL
#define SECTIONS_GLSL

#include "decoders/serial.glsl"

#define THREAD gl_LocalInvocationIndex

// Shared words that several threads change at once. web/wgsl.glsl has the same for WGSL.
#ifndef WGSL
#define ATOMIC_UINT uint
#define ATOMIC_LOAD(place) (place)
#define ATOMIC_STORE(place, value) place = value
#define ATOMIC_OR(place, value) atomicOr(place, value)
#define ATOMIC_MAX(place, value) atomicMax(place, value)
#define ATOMIC_ADD(place, value) atomicAdd(place, value)
#endif

// --- streams ---

shared uint shared_stream[MAX_STREAMS];  // see stream_field
shared uint shared_bases[MAX_STREAMS];   // see stream_base

// Offset and width of fields in shared_stream.
#define STREAM_ELEMENTS 0, 3
#define STREAM_BITS 3, 6
#define STREAM_PREDICTOR 9, 3
#define STREAM_ELEMENT 12, 11
#define stream_field(s, field) bitfieldExtract(shared_stream[s], field)
// In shared_bases: parameters of codes.
#define BASE_CHAIN 0, 5
#define BASE_INTERIOR 8, 5
#define BASE_ANCHOR 16, 5
#define stream_base(s, field) bitfieldExtract(shared_bases[s], field)

// In conditions around barriers: a word, and facts of streams, that are the same in all threads.
// web/wgsl.glsl has the same for WGSL, which demands a proof.
#ifndef WGSL
#define UNIFORM(word) (word)
#define uniform_streams() stream_end
#define uniform_elements(s) stream_field(s, STREAM_ELEMENTS)
#define uniform_predictor(s) stream_field(s, STREAM_PREDICTOR)
#endif

// Reads the stream table; streams [0, end) are decoded.
void share_streams(uint end) {
  load_tables();
  stream_total = min(stream_total, MAX_STREAMS);
  stream_end = min(end, stream_total);
  for (uint s = THREAD; s < stream_total; s += WORKGROUP) {
    uint shape = load_word(STREAM_SHAPE_WORD(s));
    uint element = 0u;
    for (uint before = 0u; before < s; before++)
      element += (load_word(STREAM_SHAPE_WORD(before)) >> 8) & 7u;
    shared_stream[s] = ((shape >> 8) & 7u) | ((shape >> 16) & 63u) << 3 |
                       ((shape >> 24) & 7u) << 9 | min(element, MAX_ELEMENTS) << 12;
    shared_bases[s] = load_word(STREAM_BASES_WORD(s));
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

// Whether any of the decoded streams has one of these predictors (a bit each).
bool any_stream_predicts(uint predictors) {
  uint found = 0u;
  for (uint s = 0u; s < uniform_streams(); s++) found |= 1u << uniform_predictor(s);
  return (found & predictors) != 0u;
}

// --- small parts ---

// A code: a Rice parameter, CODE_EXPONENTIAL + exp-Golomb parameter, or CODE_FIXED.
bool is_exponential(uint code) { return (code & ~CODE_MAX_PARAMETER) == CODE_EXPONENTIAL; }

// Reads the code of stream s's chains or interior at bit p and moves p past it.
uint code_at(inout uint p, uint s, bool of_chains) {
  uint field = load_bits(p, CODE_BITS);
  p += CODE_BITS;
  if (field == CODE_ESCAPE) {
    p += WIDTH_BITS * stream_field(s, STREAM_ELEMENTS);
    return CODE_FIXED;
  }
  uint base = of_chains ? stream_base(s, BASE_CHAIN) : stream_base(s, BASE_INTERIOR);
  bool rice = of_chains || field < CODE_FIRST_EXPONENTIAL;
  uint k = rice ? base + field : max(base, 1u) - 1u + field - CODE_FIRST_EXPONENTIAL;
  if (k > CODE_MAX_PARAMETER) error = ERROR_CODE;
  return (k & CODE_MAX_PARAMETER) | (rice ? 0u : CODE_EXPONENTIAL);
}

// Low bits of one vertex under fixed widths that begin at bit `widths`.
uint fixed_width(uint elements, uint widths) {
  uint sum = 0u;
  for (uint c = 0u; c < elements; c++) sum += width_field(widths + WIDTH_BITS * c);
  return sum;
}

// Low bits of one vertex under a Rice or fixed code.
uint low_width(uint code, uint elements, uint widths) {
  return code == CODE_FIXED ? fixed_width(elements, widths) : code * elements;
}

// Size of the low part of n values (a multiple of `elements`) whose unary parts have `zeros` zeros.
uint low_size(uint code, uint elements, uint widths, uint n, uint zeros) {
  if (code == CODE_FIXED) return n / elements * fixed_width(elements, widths);
  return n * (code & CODE_MAX_PARAMETER) + (is_exponential(code) ? zeros : 0u);
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

// --- anchors ---

// Bit position of the anchors of all streams.
uint anchors_begin(HEADER_IN h) {
  uint p = h.codes;
  bool chains = mask_any(h.owned_refs);
  for (uint s = 0u; s < stream_total; s++) {
    if (chains) code_at(p, s, true);
    code_at(p, s, false);
  }
  return p;
}

// The widths of the elements of stream s's further anchors, whose fields begin at bit p: six bits
// each.
uint anchor_widths(uint s, uint p) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint bits = stream_field(s, STREAM_BITS);
  uint fields = load_bits(p, ANCHOR_WIDTH_BITS * n);
  uint widths = 0u;
  for (uint c = 0u; c < n; c++) {
    uint field = bitfieldExtract(fields, int(ANCHOR_WIDTH_BITS * c), int(ANCHOR_WIDTH_BITS));
    uint width = field == ANCHOR_WIDTH_FULL ? bits : min(stream_base(s, BASE_ANCHOR) + field, bits);
    widths |= width << 6u * c;
  }
  return widths;
}

uint width_sum(uint widths) {
  return (widths & 63u) + ((widths >> 6) & 63u) + ((widths >> 12) & 63u) + (widths >> 18);
}

// anchor_widths of the `count` anchors of stream s that begin at bit p; 0 if there is only one.
uint further_widths(uint p, uint s, uint count) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  return count > 1u ? anchor_widths(s, p + n * stream_field(s, STREAM_BITS)) : 0u;
}

// The bit position after these anchors. widths: further_widths.
uint after_anchors(uint p, uint s, uint count, uint widths) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  if (count > 0u) p += n * stream_field(s, STREAM_BITS);
  if (count > 1u) p += ANCHOR_WIDTH_BITS * n + (count - 1u) * width_sum(widths);
  return p;
}

// Element c of anchor `index` of stream s, whose anchors begin at bit p. widths: further_widths,
// if index > 0.
uint anchor_value(uint s, uint p, uint index, uint widths, uint c) {
  uint n = stream_field(s, STREAM_ELEMENTS);
  uint bits = stream_field(s, STREAM_BITS);
  uint value = load_bits(p + c * bits, bits);
  if (index > 0u) {
    uint before = width_sum(widths & ((1u << 6u * c) - 1u));
    uint at = p + n * (bits + ANCHOR_WIDTH_BITS) + (index - 1u) * width_sum(widths) + before;
    value += unzigzag(load_bits(at, bitfieldExtract(widths, int(6u * c), 6)));
  }
  return value & bits_mask(s);
}

// --- connectivity ---

// Number of vertices that the symbols of some triangles push, without the first of each disk: one
// for R and L, two for E.
uint pushed_vertices(mask64 some) {
  return mask_count(some & ~(symbol_c | symbol_s)) + mask_count(some & symbol_e);
}

uint owner_of(HEADER_IN h, uint r) { return entry_owner(h, entry_position(h, r)); }

// Weights of AFFINE in one word: 12 bits each, or 0 if there are none.
#define WEIGHTS_EXIST 0x80000000u
uint pack_weights(Weights w) {
  return w.exist ? (w.s & 0xFFFu) | (w.u & 0xFFFu) << 12 | WEIGHTS_EXIST : 0u;
}
Weights unpack_weights(uint word) {
  return Weights(true, uint(bitfieldExtract(int(word), 0, 12)),
                 uint(bitfieldExtract(int(word), 12, 12)));
}
uint geo_shift() { return excess(stream_field(0u, STREAM_BITS), GEO_POSITION_BITS); }

#endif

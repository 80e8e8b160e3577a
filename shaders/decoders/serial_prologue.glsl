// The GLSL primitives that serial_decoder.glsl asks for and that stand before it: serial.glsl has
// the order. Unless the includer defines BLOB_WORD and blob_word_total, the shader calls open_blob
// first, and needs GL_EXT_buffer_reference and GL_EXT_buffer_reference_uvec2.
//
// needs: decode/serial_decoder.glsl, decoders/serial_epilogue.glsl
// optional: MAX_STREAMS, MAX_ELEMENTS, BLOB_WORD

// Capacities, set by the host: the most streams of a blob in the scene, and the most elements of
// those that are decoded.
#ifndef MAX_STREAMS
layout(constant_id = 0) const uint MAX_STREAMS = 8u;
#endif
#ifndef MAX_ELEMENTS
layout(constant_id = 1) const uint MAX_ELEMENTS = 20u;
#endif

#ifndef BLOB_WORD  // the includer may have words and their number elsewhere
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Words { uint at[]; };

Words blob_words;
#define BLOB_WORD(i) blob_words.at[i]
uint blob_word_total;

// The host has checked the header. words: length of the blob. Its last word is 0.
void open_blob(uvec2 address, uint words) {
  blob_words = Words(address);
  blob_word_total = words;
}
#endif

#define small_uint uint
#define index_uint uint
#define mask64 uvec2  // x: the low half
#define INLINE
#define HEADER_IN Header
#define FOREIGN_LENGTH read_foreign_length

uvec2 mask_none() { return uvec2(0u); }
uvec2 mask_bit(uint i) {
  return (i & 32u) == 0u ? uvec2(1u << (i & 31u), 0u) : uvec2(0u, 1u << (i & 31u));
}
uint word_below(uint n) { return n >= 32u ? 0xFFFFFFFFu : (1u << n) - 1u; }
uvec2 mask_below(uint n) { return uvec2(word_below(n), n <= 32u ? 0u : word_below(n - 32u)); }
bool mask_test(uvec2 m, uint i) {
  return ((((i & 32u) == 0u ? m.x : m.y) >> (i & 31u)) & 1u) != 0u;
}
bool mask_any(uvec2 m) { return (m.x | m.y) != 0u; }
uint mask_count(uvec2 m) { return uint(bitCount(m.x) + bitCount(m.y)); }
uint mask_lsb(uvec2 m) {
  return m.x != 0u ? uint(findLSB(m.x)) : m.y != 0u ? 32u + uint(findLSB(m.y)) : 64u;
}
uint mask_msb(uvec2 m) {
  return m.y != 0u ? 32u + uint(findMSB(m.y)) : m.x != 0u ? uint(findMSB(m.x)) : 64u;
}
uvec2 mask_clear_lsb(uvec2 m) {
  return m.x != 0u ? uvec2(m.x & (m.x - 1u), m.y) : uvec2(0u, m.y & (m.y - 1u));
}
uvec2 mask_shl1(uvec2 m) { return uvec2(m.x << 1, (m.y << 1) | (m.x >> 31)); }
// Deposits the lowest bits of `bits` at the ones of a word.
uint scatter_word(uint bits, uint m) {
  uint scattered = 0u;
  for (; m != 0u; m &= m - 1u) {
    scattered |= m & (0u - m) & (0u - (bits & 1u));
    bits >>= 1;
  }
  return scattered;
}
uvec2 mask_scatter(uvec2 bits, uvec2 m) {
  uint low = uint(bitCount(m.x));
  uint next = low == 0u ? bits.x : low == 32u ? bits.y : (bits.x >> low) | (bits.y << (32u - low));
  return uvec2(scatter_word(bits.x, m.x), scatter_word(next, m.y));
}

uint bit_length(uint x) { return uint(findMSB(x) + 1); }
uint choose(bool condition, uint a, uint b) { return condition ? a : b; }
uvec2 choose(bool condition, uvec2 a, uvec2 b) { return condition ? a : b; }
bool ends_after(uint p, uint n, uint end) { return p > end || n > end - p; }
uint divide(uint x, uint n) { return x / n; }

uint load_memory(uint i) { return BLOB_WORD(min(i, blob_word_total - 1u)); }
uint load_word(uint i) { return load_memory(i); }
uvec2 load_words2(uint i) { return uvec2(load_memory(i), load_memory(i + 1u)); }
uvec3 load_words3(uint i) {
  return uvec3(load_memory(i), load_memory(i + 1u), load_memory(i + 2u));
}
// The 32 bits from bit `shift` < 32 of two words.
uint funnel(uint low, uint high, uint shift) {
  return (low >> shift) | ((high << 1) << (31u - shift));
}
uint load_bits(uint p, uint n) {
  uvec2 words = load_words2(p >> 5);
  return funnel(words.x, words.y, p & 31u) & word_below(n);
}
uint load_inside(uint p, uint n) { return load_bits(p, n); }
uvec2 load_mask(uint p, uint n) {
  uvec3 words = load_words3(p >> 5);
  return uvec2(funnel(words.x, words.y, p & 31u), funnel(words.y, words.z, p & 31u)) &
         mask_below(n);
}

// `window`: ones not read yet; its bit 0 is the blob's bit `base`. `cursor`: the bit after the last
// one read.
struct UnaryReader {
  uint window;
  uint base;
  uint cursor;
};

UnaryReader seek_unary(uint p) {
  return UnaryReader(load_word(p >> 5) & ~word_below(p & 31u), p & ~31u, p);
}

// Defined in the epilogue: they set `error`, which serial_decoder.glsl declares.
void skip_unary(uint n);
void read_codes(uint n, uint code);

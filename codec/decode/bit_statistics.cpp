#include "decode/bit_statistics.h"

namespace meshlet {
namespace {

uint64_t anchor_bits(SerialDecoder& d, uint32_t s) {
  uint64_t n = d.anchor_count[s];
  uint64_t first = d.stream_elements[s] * d.stream_bits[s];
  if (n <= 1) return n * first;
  return first + WIDTH_BITS +
         (n - 1) * d.stream_elements[s] * d.width_field(uint32_t(d.anchor_position[s] + first));
}

// Bits of the low and unary parts of `count` vertices. Moves the unary reader from the stream's
// first code past its last.
uint64_t residual_bits(SerialDecoder& d, uint32_t s, uint32_t code, uint32_t widths,
                       uint32_t count) {
  uint64_t bits = uint64_t(count) * d.low_bits(s, code, widths);
  uint32_t begin = d.unary.cursor;
  if (code != CODE_FIXED) d.skip_unary(d.unary, count * d.stream_elements[s]);
  return bits + (d.unary.cursor - begin);
}

void add_meshlet(SerialDecoder& d, BitStatistics& out) {
  SerialDecoder::Header h = d.opened;
  uint32_t splits = d.mask_count(d.symbol_s), r = d.mask_count(d.symbol_r),
           e = d.mask_count(d.symbol_e), c = d.mask_count(d.symbol_c);
  uint32_t lefts = d.triangle_count - r - e - c - splits;
  const uint32_t counts[5] = {c, lefts, e, r, splits};
  for (int i = 0; i < 5; i++) out.symbols[i] += counts[i];
  out.connectivity += 2 * d.triangle_count + lefts + splits;
  out.disks += d.disk_count;
  out.owned_references += d.mask_count(h.owned_refs);
  out.private_references += h.references ? d.mask_count(h.private_refs) : d.disk_count;
  out.foreign_references += d.mask_count(h.foreign_refs);
  uint32_t low = 0;
  d.unary = d.seek_unary(d.chain_unary);
  for (uint32_t s = 0; s < d.stream_total; s++) {
    out.streams[s] += anchor_bits(d, s);
    if (d.mask_any(h.owned_refs))
      out.streams[s] += residual_bits(d, s, d.chain_code[s], d.chain_widths[s], d.chain_total);
    low += (d.traversed_count + d.seam_vertices(s)) *
           d.low_bits(s, d.interior_code[s], d.interior_widths[s]);
  }
  d.unary = d.seek_unary(d.unary.cursor + low);
  for (uint32_t s = 0; s < d.stream_total; s++)
    out.streams[s] += residual_bits(d, s, d.interior_code[s], d.interior_widths[s],
                                    d.traversed_count + d.seam_vertices(s));
}

}  // namespace

BitStatistics count_bits(const uint8_t* data, size_t size) {
  DecoderContext decoder(data, size);
  BitStatistics out;
  out.streams.assign(decoder.header().streams.size(), 0);
  for (uint32_t m = 0; m < decoder.header().meshlet_count; m++)
    add_meshlet(decoder.meshlet(m), out);
  out.references = 8 * uint64_t(size) - out.connectivity;
  for (uint64_t bits : out.streams) out.references -= bits;
  return out;
}

}  // namespace meshlet

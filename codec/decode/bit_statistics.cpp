#include "decode/bit_statistics.h"

#include <memory>

#include "decode/decoder.h"
#include "decode/serial_decoder.h"

namespace gltf_meshlet_codec {
namespace {

// Bits that the decoder moves over in `skip`.
template <class Skip>
uint64_t bits_of(SerialDecoder& d, Skip skip) {
  const uint64_t before = uint64_t(d.unary.cursor) + d.low_cursor;
  skip();
  return uint64_t(d.unary.cursor) + d.low_cursor - before;
}

// Adds the interiors of the streams [first, end), which begin at bit p.
void add_interiors(SerialDecoder& d, uint32_t p, uint32_t first, uint32_t end, BitStatistics& out) {
  uint32_t codes = 0;
  for (uint32_t s = first; s < end; s++)
    codes += d.unary_count(s, d.interior_vertices(s), d.interior_code[s]);
  d.open_lists(p, codes);
  for (uint32_t s = first; s < end; s++)
    out.streams[s] += bits_of(d, [&] {
      d.skip_residuals(s, d.interior_vertices(s), d.interior_code[s], d.interior_widths[s]);
    });
}

// Adds all lists of the meshlet.
void add_lists(SerialDecoder& d, BitStatistics& out) {
  d.find_lists(d.opened, d.disk_count);
  d.open_chains();
  for (uint32_t s = 0; s < d.stream_total; s++)
    out.streams[s] += d.anchor_bits(s) + bits_of(d, [&] { d.skip_chains(d.opened, s); });
  add_interiors(d, d.unary.cursor, 0, 1, out);
  add_interiors(d, d.low_cursor, 1, d.stream_total, out);
}

void add_meshlet(SerialDecoder& d, BitStatistics& out) {
  SerialDecoder::Header h = d.opened;
  uint32_t splits = d.mask_count(d.symbol_s), r = d.mask_count(d.symbol_r),
           e = d.mask_count(d.symbol_e), c = d.mask_count(d.symbol_c);
  uint32_t lefts = d.triangle_count - r - e - c - splits;
  const uint32_t counts[5] = {c, lefts, e, r, splits};
  for (int i = 0; i < 5; i++) out.symbols[i] += counts[i];
  out.connectivity += d.load_planes(h.begin, h.triangles).end - h.begin;
  out.disks += d.disk_count;
  out.owned_references += d.mask_count(h.owned_refs);
  out.private_references += h.references ? d.mask_count(h.private_refs) : d.disk_count;
  out.foreign_references += d.mask_count(h.foreign_refs);
  add_lists(d, out);
}

}  // namespace

Problem count_bits(const uint8_t* data, size_t size, BitStatistics& out) {
  struct Counter : SerialDecoder, Allocated {};  // not for the stack
  out = {};
  const std::unique_ptr<Counter> decoder(new Counter);
  if (!decoder) return {kNoMemory};
  decoder->data = data;
  decoder->size = uint32_t(size);
  decoder->load_tables();
  decoder->load_streams(0, decoder->stream_total);
  for (uint32_t m = 0; m < decoder->meshlet_total; m++) {
    decoder->decode_meshlet(m);
    if (decoder->error != ERROR_NONE) return {error_text(decoder->error), 0, m};
    add_meshlet(*decoder, out);
  }
  out.references = 8 * uint64_t(size) - out.connectivity;
  for (uint64_t bits : out.streams) out.references -= bits;
  return {};
}

}  // namespace gltf_meshlet_codec

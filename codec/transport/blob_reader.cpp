#include "transport/blob_reader.h"

#include <memory>

namespace meshlet {
inline namespace MESHLET_BUILD {
namespace transport {
namespace {

uint32_t page_bytes(const uint8_t* blob) {
  uint32_t bytes;
  std::memcpy(&bytes, blob + 4 * BLOB_WORD_BYTES, 4);
  return bytes;
}

// Takes the references of the meshlet that the decoder has decoded.
void take_references(const SerialDecoder& d, Page& page, MeshletRow& m) {
  const SerialDecoder::Header& h = d.opened;
  const uint32_t number = page.meshlets.size() - 1;
  m.stored_references = uint8_t(h.references);
  m.references = uint8_t(h.references ? h.references : d.disk_count);
  if (h.references) m.owned = h.owned_refs;
  for (uint32_t j = 0; j < m.references; j++) {
    Reference r = {0, kNone, number, kPrivate, 1, 0, 0, 0, 0, 0, 0, 0};
    if (h.references) {
      r.loop_end = h.loop_ends >> j & 1;
      r.length = uint8_t(d.reference_length[j]);
      if (h.owned_refs >> j & 1) r.kind = kOwned;
    }
    if (h.foreign_refs >> j & 1) {
      r.kind = kForeign;
      for (uint32_t s = 0; s < page.stream_count(); s++)
        r.shares |= uint64_t(~d.seam_refs[s] >> j & 1) << s;
      r.slot = uint8_t(d.reference_slot[j]);
    }
    page.references.push(r);
  }
  for (uint64_t foreign = h.foreign_refs; foreign; foreign &= foreign - 1) {
    const uint32_t j = lowest(foreign);
    Reference& r = page.references[m.reference + j];
    const MeshletRow& owner = page.meshlets[d.reference_owner[j]];
    r.partner = owner.reference + nth(owner.owned, r.slot);
  }
}

}  // namespace

void read_blob(const uint8_t* blob, Page& page) {
  const auto decoder = std::make_unique<SerialDecoder>();
  SerialDecoder& d = *decoder;
  d.data = blob;
  d.size = page_bytes(blob);
  d.load_tables();
  d.load_streams(0, d.stream_total);
  page.clear();
  std::memcpy(page.rows.grow(d.stream_total), blob + BLOB_HEADER_BYTES,
              BLOB_STREAM_BYTES * d.stream_total);
  for (uint32_t number = 0; number < d.meshlet_total; number++) {
    d.decode_meshlet(number);
    MeshletRow& m = page.begin_meshlet();
    m.triangles = uint8_t(d.triangle_count);
    m.symbols[kC] = d.symbol_c;
    m.symbols[kE] = d.symbol_e;
    m.symbols[kR] = d.symbol_r;
    m.symbols[kS] = d.symbol_s;
    m.symbols[kL] = below(m.triangles) & ~(d.symbol_c | d.symbol_e | d.symbol_r | d.symbol_s);
    page.decode_connectivity(m);
    take_references(d, page, m);
    page.place_references(m);
    for (uint32_t s = 0; s < page.stream_count(); s++) {
      Stream& stream = page.streams[s];
      page.number_vertices(m, s);
      stream.values.grow(4 * size_t(stream.vertices) - stream.values.size());
      for (uint32_t v = 0; v < m.vertices; v++)
        store(stream.values.data(), stream.id[m.vertex + v], load(d.vertex(s, v), 0));
    }
  }
}

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace meshlet

#include <algorithm>
#include <cstring>

#include "common/parallel.h"
#include "decode/view.h"
#include "transport/encoder.h"
#include "transport/transport.h"

namespace gltf_meshlet_codec {
namespace {

using namespace transport;

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

// Fills `page` from a valid blob.
void read_blob(const ViewBlob& blob, Page& page) {
  const auto decoder = std::make_unique<SerialDecoder>();
  SerialDecoder& d = *decoder;
  d.data = blob.data;
  d.size = uint32_t(blob.size);
  d.load_tables();
  d.load_streams(0, d.stream_total);
  page.clear();
  std::memcpy(page.rows.grow(d.stream_total), blob.data + BLOB_HEADER_BYTES,
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
      transport::Stream& stream = page.streams[s];
      const uint32_t before = stream.vertices;
      page.number_vertices(m, s);
      stream.values.grow(4 * uint64_t(stream.vertices - before));
      for (uint32_t v = 0; v < m.vertices; v++)
        store(stream.values.data(), stream.id[m.vertex + v], load(d.vertex(s, v), 0));
    }
  }
}

// Tries settings and keeps those that save bits. What normals take does not depend on settings of
// positions.
std::vector<uint8_t> encode(const Page& page) {
  const uint32_t triangles = page.triangles.size(), meshlets = page.meshlets.size();
  Page known;
  PageCoder<Encoder> coder(known);
  uint64_t cost[kParts], before[kParts];
  const auto attempt = [&](const Settings& settings) {
    coder.coder.reset();
    coder.settings = settings;
    bool valid = coder.begin(&page, triangles, meshlets);
    for (uint32_t s = 0; valid && s < page.stream_count(); s++) valid = coder.code_stream(s);
    if (coder.no_memory) out_of_memory();
    std::copy(cost, cost + kParts, before);
    std::copy(coder.cost, coder.cost + kParts, cost);
    return valid;
  };
  Settings best, last;
  if (!attempt(best)) return {};
  last.choices = last.angles = true;
  if (!attempt(last)) return {};
  best.choices = cost[kPositionPart] < before[kPositionPart];
  // Angles take time when unpacking.
  best.angles = cost[kNormalPart] + coder.coder.cost() / 32 < before[kNormalPart];
  if (!best.choices) cost[kPositionPart] = before[kPositionPart];
  last = best;
  last.smooth = true;
  if (!attempt(last)) return {};
  best.smooth = cost[kPositionPart] < before[kPositionPart];
  if (!best.smooth && !attempt(best)) return {};
  return coder.coder.finish(triangles, meshlets);
}

// The packed page of a valid blob; empty if it has to travel as it is.
std::vector<uint8_t> pack_blob(const ViewBlob& blob) {
  Page page;
  read_blob(blob, page);
  std::vector<uint8_t> packed = encode(page);
  if (packed.empty() || packed.size() >= blob.size ||
      blob.size > kFreeBytes + kMostExpansion * packed.size())
    return {};
  std::vector<uint8_t> resident(blob.size);
  const PackedPage whole = {0, packed.size(), 0, blob.size, false};
  const std::unique_ptr<PageUnpacker> unpacker = make_page_unpacker();
  const Problem problem =
      unpacker ? unpacker->unpack(packed.data(), whole, resident.data()) : Problem{kNoMemory};
  if (problem.text == kNoMemory) out_of_memory();
  if (problem || std::memcmp(resident.data(), blob.data, blob.size) != 0)
    return {};  // not in canonical form
  return packed;
}

}  // namespace

Problem pack_view(const uint8_t* data, size_t size, int threads, std::vector<uint8_t>& packed) {
  View view;
  if (const Problem problem = view.open(data, size)) return problem;
  const size_t count = view.blobs.size();
  if (const Problem problem = view.validate(threads)) return problem;
  std::vector<std::vector<uint8_t>> pages(count);
  parallel_for(threads, count, [&](size_t b) { pages[b] = pack_blob(view.blobs[b]); });
  packed.clear();
  const auto put = [&](uint32_t word) {
    for (int i = 0; i < 4; i++) packed.push_back(uint8_t(word >> 8 * i));
  };
  put(uint32_t(count) << 8 | kTransportVersion);
  for (size_t b = 0; b < count; b++) {
    put(uint32_t(view.blobs[b].size));
    put(uint32_t(pages[b].size()));
  }
  for (size_t b = 0; b < count; b++) {
    const ViewBlob& blob = view.blobs[b];
    if (pages[b].empty())
      packed.insert(packed.end(), blob.data, blob.data + blob.size);
    else
      packed.insert(packed.end(), pages[b].begin(), pages[b].end());
  }
  return {};
}

}  // namespace gltf_meshlet_codec

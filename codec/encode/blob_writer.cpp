#include "encode/blob_writer.h"

#include <algorithm>
#include <stdexcept>

#include "common/bits.h"
#include "common/parallel.h"

namespace gltf_meshlet_codec {
namespace {

class BlobWriter {
 public:
  BlobWriter(std::vector<PlanChunk>& chunks, const std::vector<Stream>& streams,
             const Boundaries& boundaries, int threads)
      : chunks_(chunks), streams_(streams), owners_{boundaries, {}}, threads_(threads) {}

  WrittenBlob write() {
    owners_.slot_of_place.assign(owners_.boundaries.half_edge.size(), 0);
    groups_.resize(chunks_.size() * kChunkGroups);
    statistics_.resize(chunks_.size());
    vertices_.assign(chunks_.size(), 0);
    for_chunks([&](size_t c) { number_slots(chunks_[c]); });
    for_chunks([&](size_t c) {
      measure_groups(c);
      count(c);
      write_chunk(c);
    });
    WrittenBlob out;
    for (size_t c = 0; c < chunks_.size(); c++) {
      out.meshlets += uint32_t(chunks_[c].plans.size());
      out.vertices += vertices_[c];
      out.bits.add(statistics_[c]);
    }
    out.bytes = assemble(out.meshlets, out.vertices);
    out.bits.disks = owners_.boundaries.loops.size();
    out.bits.references = 8 * uint64_t(out.bytes.size()) - out.bits.connectivity;
    for (uint64_t bits : out.bits.streams) out.bits.references -= bits;
    return out;
  }

 private:
  static constexpr uint32_t kChunkGroups = kChunkMeshlets / BLOB_GROUP_MESHLETS;

  template <class Body>
  void for_chunks(Body&& body) {
    parallel_for(threads_, chunks_.size(), body);
  }
  Group& group_of(size_t c, size_t i) {
    return groups_[c * kChunkGroups + i / BLOB_GROUP_MESHLETS];
  }

  void number_slots(const PlanChunk& chunk);
  void measure_groups(size_t c);
  void count(size_t c);
  void write_chunk(size_t c);
  std::vector<uint8_t> assemble(uint32_t meshlets, uint32_t vertices) const;

  std::vector<PlanChunk>& chunks_;
  const std::vector<Stream>& streams_;
  Owners owners_;
  const int threads_;
  std::vector<Group> groups_;
  // Per chunk.
  std::vector<BitStatistics> statistics_;
  std::vector<uint32_t> vertices_;
};

void BlobWriter::number_slots(const PlanChunk& chunk) {
  for (const Plan& plan : chunk.plans) {
    uint8_t slot = 0;
    for (const PlannedReference& r : chunk.references_of(plan))
      if (r.owned()) owners_.slot_of_place[r.reference.start] = slot++;
  }
}

void BlobWriter::measure_groups(size_t c) {
  const PlanChunk& chunk = chunks_[c];
  int64_t gains[kChunkGroups] = {};  // bits that table 1 saves
  for (size_t i = 0; i < chunk.plans.size(); i++) {
    Group& group = group_of(c, i);
    const Symbols& y = chunk.plans[i].symbols;
    gains[i / BLOB_GROUP_MESHLETS] +=
        2 * int64_t(count_of(y.lefts())) - count_of(y.c) - (count_of(y.e) - 1);
    const PlannedReferences references = chunk.references_of(chunk.plans[i]);
    group.flags |= references.flags();
    group.reference_width = std::max(group.reference_width, bit_length(references.stored_count()));
    const uint32_t m = uint32_t(c * kChunkMeshlets + i);
    for (const PlannedReference& r : references) {
      if (!r.foreign()) continue;
      group.delta_width =
          std::max(group.delta_width, bit_length(m - owners_.meshlet_of(r.reference)));
      group.slot_width = std::max(group.slot_width, bit_length(owners_.slot_of(r.reference)));
    }
  }
  for (uint32_t g = 0; g < kChunkGroups; g++) groups_[c * kChunkGroups + g].table = gains[g] > 0;
}

void BlobWriter::count(size_t c) {
  const PlanChunk& chunk = chunks_[c];
  BitStatistics& bits = statistics_[c];
  for (size_t i = 0; i < chunk.plans.size(); i++) {
    const Symbols& y = chunk.plans[i].symbols;
    const uint32_t counts[5] = {count_of(y.c), count_of(y.lefts()), count_of(y.e), count_of(y.r),
                                count_of(y.s)};
    for (int k = 0; k < 5; k++) bits.symbols[k] += counts[k];
    // 1 bit for R, 2 to 4 for the others, none for the last E.
    const auto [n, l, e, r, s] = counts;
    bits.connectivity += group_of(c, i).table ? r + 2 * l + 3 * n + 4 * (e - 1 + s)
                                              : r + 2 * n + 3 * (e - 1) + 4 * (l + s);
    // Decoded vertices: all local ones except those of other meshlets (spec, appendix A.8).
    uint32_t vertices = chunk.plans[i].vertex_count;
    const PlannedReferences references = chunk.references_of(chunk.plans[i]);
    for (uint32_t k = 0; k < references.count; k++) {
      const PlannedReference& reference = references.data[k];
      if (reference.alias()) vertices -= reference.reference.length - 1;
      vertices -= reference.alias() || references.before(k).alias();
      bits.owned_references += reference.owned();
      bits.private_references += reference.is_private();
      bits.foreign_references += reference.foreign();
    }
    vertices_[c] += vertices;
  }
}

void BlobWriter::write_chunk(size_t c) {
  PlanChunk& chunk = chunks_[c];
  MeshletWriter writer(streams_, owners_, chunk.out, statistics_[c].streams);
  for (size_t i = 0; i < chunk.plans.size(); i++) {
    const size_t before = chunk.out.bytes().size();
    writer.write(chunk, i, uint32_t(c * kChunkMeshlets + i), group_of(c, i));
    chunk.plans[i].bytes = uint32_t(chunk.out.bytes().size() - before);
  }
  std::vector<uint32_t>().swap(chunk.residuals);
}

std::vector<uint8_t> BlobWriter::assemble(uint32_t meshlets, uint32_t vertices) const {
  BlobHeader header;
  header.vertex_count = vertices;
  header.meshlet_count = meshlets;
  header.data_offset = data_offset(uint32_t(streams_.size()), meshlets);
  header.streams = streams_;
  header.triangle_count = uint32_t(owners_.boundaries.place_of.size());
  std::vector<uint8_t> blob;
  write_blob_header(header, blob);
  size_t row = blob.size();  // of the group table
  size_t size = header.data_offset;
  for (const PlanChunk& chunk : chunks_) size += chunk.out.bytes().size();
  blob.reserve(size + size / 64);
  blob.resize(header.data_offset);
  const auto put_word = [&](size_t at, uint32_t w) {
    for (int i = 0; i < 4; i++) blob[at + i] = uint8_t(w >> 8 * i);
  };
  for (size_t g = 0; g * BLOB_GROUP_MESHLETS < meshlets; g++) {
    const PlanChunk& chunk = chunks_[g / kChunkGroups];
    const size_t begin = g % kChunkGroups * BLOB_GROUP_MESHLETS,
                 end = std::min<size_t>(begin + BLOB_GROUP_MESHLETS, chunk.plans.size());
    std::vector<uint32_t> starts;
    size_t from = 0;  // in the chunk
    for (size_t i = 0; i < begin; i++) from += chunk.plans[i].bytes;
    uint64_t length = 0;
    for (size_t i = begin; i < end; i++) {
      starts.push_back(uint32_t(length));
      length += chunk.plans[i].bytes;
    }
    const GroupEntries entries =
        entries_of(starts.data(), uint32_t(starts.size()), uint32_t(length));
    BitWriter bits;
    for (uint32_t i = 0; i < starts.size(); i++)
      bits.put(entries.entry(i, starts[i]), entries.width);
    bits.align();
    if (blob.size() + bits.bytes().size() + length > BLOB_MAX_BYTES - BLOB_PADDING_BYTES)
      throw std::length_error(
          "the primitive is too large: its blob would exceed 448 MiB; split it");
    const Group& group = groups_[g];
    put_word(row, uint32_t(blob.size()));
    put_word(row + 4, entries.stride | entries.bias << 16);
    put_word(row + 8, entries.width << GROUP_ENTRY_SHIFT | group.delta_width << GROUP_DELTA_SHIFT |
                          group.slot_width << GROUP_SLOT_SHIFT |
                          group.reference_width << GROUP_REFERENCE_SHIFT |
                          group.flags << GROUP_FLAGS_SHIFT | group.table << GROUP_TABLE_SHIFT);
    row += BLOB_GROUP_BYTES;
    blob.insert(blob.end(), bits.bytes().begin(), bits.bytes().end());
    const uint8_t* bytes = chunk.out.bytes().data() + from;
    blob.insert(blob.end(), bytes, bytes + length);
  }
  blob.resize((blob.size() + BLOB_PADDING_BYTES + 3) / 4 * 4, 0);
  put_word(4 * BLOB_WORD_BYTES, uint32_t(blob.size()));
  return blob;
}

}  // namespace

WrittenBlob write_blob(std::vector<PlanChunk>& chunks, const std::vector<Stream>& streams,
                       const Boundaries& boundaries, int threads) {
  return BlobWriter(chunks, streams, boundaries, threads).write();
}

}  // namespace gltf_meshlet_codec

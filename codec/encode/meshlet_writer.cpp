#include "encode/meshlet_writer.h"

#include <algorithm>
#include <utility>

#include "decode/serial_decoder.h"

namespace gltf_meshlet_codec {

void MeshletWriter::write(const PlanChunk& chunk, size_t i, uint32_t m, const Group& group) {
  const Plan& plan = chunk.plans[i];
  const PlannedReferences references = chunk.references_of(plan);
  chunk.lists_of(i, lists_);
  write_header(plan.symbols, references, group);
  write_symbols(plan.symbols, group);
  if (!references.all_private()) write_references(references, m, group);
  write_lists(std::any_of(references.begin(), references.end(),
                          [](const PlannedReference& r) { return r.owned(); }));
  out_.align();
}

void MeshletWriter::write_header(const Symbols& symbols, PlannedReferences references,
                                 const Group& group) {
  out_.put(symbols.count - 1, BLOB_TRIANGLE_BITS);
  out_.put(references.stored_count(), group.reference_width);
  for (uint32_t flag : {FLAG_LOOPS, FLAG_PRIVATE, FLAG_SEAMS})
    if (group.flags & flag) out_.put((references.flags() & flag) != 0, 1);
}

// All symbols but the last as a prefix code, a plane for each of its bits.
void MeshletWriter::write_symbols(const Symbols& y, const Group& group) {
  const uint64_t first = group.table ? y.lefts() : y.c, second = group.table ? y.c : y.e;
  uint64_t rest = SerialDecoder::mask_below(y.count - 1);
  for (uint64_t plane : {~y.r, ~first, ~second, y.s}) {
    for (uint64_t left = rest; left; left &= left - 1)
      out_.put(plane >> SerialDecoder::mask_lsb(left) & 1, 1);
    rest &= plane;
  }
}

void MeshletWriter::write_references(PlannedReferences references, uint32_t m, const Group& group) {
  const uint32_t flags = references.flags();
  for (const PlannedReference& r : references) out_.put(r.foreign(), 1);
  if (flags & FLAG_LOOPS)
    for (const PlannedReference& r : references) out_.put(r.loop_end, 1);
  if (flags & FLAG_PRIVATE)
    for (const PlannedReference& r : references) out_.put(r.is_private(), 1);
  uint32_t width = 0;
  for (const PlannedReference& r : references)
    if (r.sized()) width = std::max(width, bit_length(r.reference.length - 1));
  out_.put(width, LENGTH_WIDTH_BITS);
  for (const PlannedReference& r : references)
    if (r.sized()) out_.put(r.reference.length - 1, width);
  for (const PlannedReference& r : references) {
    if (!r.foreign()) continue;
    out_.put(m - owners_.meshlet_of(r.reference), group.delta_width);
    out_.put(owners_.slot_of(r.reference), group.slot_width);
    if (flags & FLAG_SEAMS)
      for (uint32_t s = 1; s < streams_.size(); s++) out_.put(r.reference.shared >> s & 1, 1);
  }
}

// Chooses the cheapest code and writes it.
Code MeshletWriter::write_code(CodedList list, Residuals residuals, uint32_t elements,
                               uint32_t base) {
  const uint32_t field = best_field(residuals, elements, list, base);
  out_.put(field, CODE_BITS);
  if (field != CODE_ESCAPE) return code_of_field(list, field, base);
  const Code code = fixed_code(residuals, elements);
  for (uint32_t c = 0; c < elements; c++)
    out_.put(std::min(code.widths[c], WIDTH_ESCAPE), WIDTH_BITS);
  return code;
}

void MeshletWriter::write_anchors(uint32_t s) {
  const Stream& stream = streams_[s];
  const Residuals& all = lists_[s].of[kAnchors];
  if (all.count == 0) return;
  for (uint32_t c = 0; c < stream.elements; c++) out_.put(all.data[c], stream.bits);
  const Residuals further = lists_[s].further_anchors(stream.elements);
  if (further.count == 0) return;
  const Code fixed = fixed_code(further, stream.elements);
  uint32_t widths[STREAM_MAX_ELEMENTS];
  for (uint32_t c = 0; c < stream.elements; c++) {
    const uint32_t field = anchor_field(fixed.widths[c], stream.bits, stream.anchor_base);
    out_.put(field, ANCHOR_WIDTH_BITS);
    widths[c] = anchor_width(field, stream.bits, stream.anchor_base);
  }
  for (size_t i = 0; i < further.count; i++) out_.put(further.data[i], widths[i % stream.elements]);
}

// chains: the meshlet has owned references.
void MeshletWriter::write_lists(bool chains) {
  const uint32_t count = uint32_t(streams_.size());
  for (uint32_t s = 0; s < count; s++) {
    const Stream& stream = streams_[s];
    if (chains)
      codes_[s].chain =
          write_code(CodedList::kChain, lists_[s].of[kChains], stream.elements, stream.chain_base);
    codes_[s].interior = write_code(CodedList::kInterior, lists_[s].of[kInteriors], stream.elements,
                                    stream.interior_base);
  }
  const auto for_streams = [&](uint32_t first, uint32_t end, auto write) {
    for (uint32_t s = first; s < end; s++) {
      const uint64_t before = out_.bit_count();
      write(s);
      stream_bits_[s] += out_.bit_count() - before;
    }
  };
  for_streams(0, count, [&](uint32_t s) { write_anchors(s); });
  if (chains) {
    for_streams(0, count, [&](uint32_t s) {
      write_low(out_, lists_[s].of[kChains], codes_[s].chain, streams_[s].elements);
    });
    for_streams(0, count,
                [&](uint32_t s) { write_unary(out_, lists_[s].of[kChains], codes_[s].chain); });
  }
  for (const auto& [first, end] : {std::pair(0u, 1u), std::pair(1u, count)}) {
    for_streams(first, end, [&](uint32_t s) {
      write_unary(out_, lists_[s].of[kInteriors], codes_[s].interior);
    });
    for_streams(first, end, [&](uint32_t s) {
      write_low(out_, lists_[s].of[kInteriors], codes_[s].interior, streams_[s].elements);
    });
  }
}

}  // namespace gltf_meshlet_codec

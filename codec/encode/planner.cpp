#include "encode/planner.h"

#include <algorithm>
#include <iterator>

namespace gltf_meshlet_codec {
namespace {

// Bits of the symbols that depend on the gate: table 0 writes L and S with one bit more than C and
// E, and these are as many from every gate.
uint32_t symbol_bits(const Symbols& y) { return uint32_t(__builtin_popcountll(y.lefts() | y.s)); }

}  // namespace

Plan Planner::plan(uint32_t m, std::vector<PlannedReference>& references) {
  meshlet_.clear();
  std::fill(std::begin(known_), std::end(known_), 0);
  introductions_.clear();
  triangles_.clear();
  loop_vertices_.clear();
  Plan plan;
  plan.first_reference = uint32_t(references.size());
  for (uint32_t k = input_.meshlets.meshlet_begin[m]; k < input_.meshlets.meshlet_begin[m + 1]; k++)
    plan_disk(k, plan, references);
  plan.vertex_count = meshlet_.vertex_count();
  plan.reference_count = uint32_t(references.size()) - plan.first_reference;
  values_.place({references.data() + plan.first_reference, plan.reference_count}, loop_vertices_);
  return plan;
}

// Tries gates in front of the disk's references, or all around a private loop, and takes the
// cheapest.
void Planner::plan_disk(uint32_t disk, Plan& plan, std::vector<PlannedReference>& references) {
  meshlet_.add_disk(disk);
  values_.add_disk(meshlet_);
  const DiskReferences refs = boundaries_.references_of(disk);
  const uint32_t begin = boundaries_.loops[disk].begin, length = meshlet_.loop_length(),
                 first_vertex = meshlet_.first_vertex();
  const bool free = refs.size() == 1 && refs[0].kind == ReferenceKind::kPrivate;
  const uint32_t choices = free ? length : uint32_t(refs.size());
  const uint32_t tries = std::min(choices, options_.gates);
  // GEO's residuals are the same from every gate, unless another vertex becomes the anchor.
  const uint64_t counted = options_.positions_only ? 1
                           : free                  ? all_streams_
                                                   : all_streams_ & ~geo_streams_;
  uint64_t waiting = 0;
  for (const Reference& r : refs) {
    if (r.kind != ReferenceKind::kPrivate) continue;
    for (uint32_t n = 1, p = r.start; n < r.length; n++) {
      p = boundaries_.next(p);
      waiting |= 1ull << (first_vertex + p - begin);
    }
  }
  Traversal best, traversal;
  uint32_t best_choice = 0, best_start = 0;
  uint64_t least = ~0ull;
  for (uint32_t i = 0; i < tries; i++) {
    const uint32_t choice = i * choices / tries;
    const uint32_t gate =
        free ? choice : boundaries_.previous(refs[choice].start) - begin;  // place in the loop
    const uint32_t start = gate + 1 == length ? 0 : gate + 1;
    if (free) {  // all but the anchor
      waiting = SerialDecoder::mask_below(length) << first_vertex;
      waiting &= ~(1ull << (first_vertex + start));
    }
    traverse(meshlet_, gate, waiting, traversal);
    const uint64_t bits = tries > 1 ? cost(traversal, counted) : 0;
    if (bits >= least) continue;
    least = bits;
    best = traversal;
    best_choice = free ? 0 : choice;
    best_start = start;
  }
  plan.symbols.append(best.symbols);
  for (uint32_t i = 0; i < best.count; i++) {
    introductions_.push_back(best.introductions[i]);
    triangles_.push_back(packed_triangle(meshlet_, best.introductions[i]));
  }
  add_references(disk, best_choice, best_start, references);
}

// Appends the disk's references from its `first` on, which starts at place `start` of the loop.
void Planner::add_references(uint32_t disk, uint32_t first, uint32_t start,
                             std::vector<PlannedReference>& references) {
  const DiskReferences refs = boundaries_.references_of(disk);
  const uint32_t length = meshlet_.loop_length();
  for (uint32_t n = 0; n < length; n++)
    loop_vertices_.push_back(uint8_t(meshlet_.first_vertex() + (start + n) % length));
  for (uint32_t i = 0; i < refs.size(); i++) {
    PlannedReference ref{refs[(first + i) % refs.size()], i + 1 == refs.size(), refs.size() == 1};
    if (i == 0) ref.reference.start = boundaries_.loops[disk].begin + start;
    references.push_back(ref);
  }
}

// Bits that depend on the gate: symbols and traversed residuals of a mask of streams.
uint64_t Planner::cost(const Traversal& traversal, uint64_t streams) {
  uint64_t bits = symbol_bits(traversal.symbols);
  const uint32_t* rows[MESHLET_VERTICES];
  for (uint32_t i = 0; i < traversal.count; i++)
    rows[i] = residuals_of(traversal.introductions[i],
                           packed_triangle(meshlet_, traversal.introductions[i]), streams);
  for (; streams; streams &= streams - 1) {
    const uint32_t s = SerialDecoder::mask_lsb(streams);
    const uint32_t elements = streams_[s].elements;
    list_.resize(traversal.count * elements);
    uint32_t* to = list_.data();
    for (uint32_t i = 0; i < traversal.count; i++, to += elements)
      copy_elements(rows[i] + values_.first_element(s), elements, to);
    bits += best_rice_bits({list_.data(), list_.size()});
  }
  return bits;
}

const uint32_t* Planner::residuals_of(Introduction introduction, uint32_t triangle,
                                      uint64_t streams) {
  uint32_t* out = &residuals_[introduction * size_t(values_.element_count())];
  if (const uint64_t missing = streams & ~known_[introduction]) {
    known_[introduction] |= missing;
    values_.traversed(missing, triangle, out);
  }
  return out;
}

void Planner::traversed(uint32_t s, uint32_t predictor, std::vector<uint32_t>& out) {
  const uint32_t elements = streams_[s].elements;
  size_t to = out.size();
  out.resize(to + triangles_.size() * elements);
  for (uint32_t triangle : triangles_) {
    values_.traversed(s, predictor, triangle, &out[to]);
    to += elements;
  }
}

void Planner::append_lists(std::vector<uint32_t>& residuals, std::vector<uint32_t>& counts) {
  for (size_t i = 0; i < introductions_.size(); i++)
    residuals_of(introductions_[i], triangles_[i], all_streams_);
  for (uint32_t s = 0; s < streams_.size(); s++) append_stream(s, residuals, counts);
}

void Planner::append_stream(uint32_t s, std::vector<uint32_t>& residuals,
                            std::vector<uint32_t>& counts) {
  const size_t anchors = residuals.size();
  values_.anchors(s, residuals);
  const size_t chains = residuals.size();
  values_.chains(s, streams_[s].predictor, residuals);
  const size_t interiors = residuals.size();
  values_.seams(s, streams_[s].predictor, residuals);
  const uint32_t elements = streams_[s].elements;
  size_t to = residuals.size();
  residuals.resize(to + introductions_.size() * elements);
  for (Introduction introduction : introductions_) {
    const size_t row = introduction * size_t(values_.element_count());
    copy_elements(&residuals_[row + values_.first_element(s)], elements, &residuals[to]);
    to += elements;
  }
  for (size_t size : {chains - anchors, interiors - chains, residuals.size() - interiors})
    counts.push_back(uint32_t(size));
}

}  // namespace gltf_meshlet_codec

#include "encode/stream_choices.h"

#include <algorithm>
#include <mutex>

#include "common/parallel.h"

namespace gltf_meshlet_codec {
namespace {

constexpr size_t kSampleChunk = 32;  // meshlets per parallel item

// The predictors that the encoder tries for a stream.
std::vector<uint8_t> allowed_predictors(const std::vector<Stream>& streams, uint32_t s) {
  if (streams[s].bits > PREDICT_MAX_BITS) return {kCopy};
  std::vector<uint8_t> allowed = {kParallelogram, kMean, kCopy, kDamped};
  for (uint8_t p = kGeo; p < PREDICTORS; p++) {
    std::vector<Stream> with = streams;
    with[s].predictor = p;
    if (!streams_problem(with.data(), with.size())) allowed.push_back(p);
  }
  return allowed;
}

// Bits of the further anchors and of their width fields.
uint64_t further_anchor_bits(Residuals residuals, const Stream& stream, uint32_t base) {
  if (residuals.count == 0) return 0;
  const Code fixed = fixed_code(residuals, stream.elements);
  uint64_t bits = 0;
  for (uint32_t c = 0; c < stream.elements; c++) {
    const uint32_t field = anchor_field(fixed.widths[c], stream.bits, base);
    bits += ANCHOR_WIDTH_BITS +
            anchor_width(field, stream.bits, base) * (residuals.count / stream.elements);
  }
  return bits;
}

}  // namespace

void choose_predictors(const EncoderInput& input, const Boundaries& boundaries,
                       std::vector<Stream>& streams, const PredictorSample& sample, int threads) {
  std::vector<uint32_t> open;
  for (uint32_t s = 0; s < streams.size(); s++) {
    if (streams[s].predictor != kChoosePredictor) continue;
    streams[s].predictor = streams[s].bits > PREDICT_MAX_BITS ? kCopy : kParallelogram;
    open.push_back(s);
  }
  if (open.empty()) return;
  std::vector<std::vector<uint8_t>> allowed(streams.size());
  for (uint32_t s : open) allowed[s] = allowed_predictors(streams, s);
  const uint32_t meshlets = input.meshlets.count();
  const uint32_t stride =
      std::max((meshlets + sample.count - 1) / sample.count, sample.least_stride);
  const size_t count = (meshlets + stride - 1) / stride;
  using Sums = std::vector<std::array<uint64_t, PREDICTORS>>;
  Sums bits(streams.size(), Sums::value_type{});
  std::mutex mutex;
  for_blocks(threads, count, kSampleChunk, [&](size_t, size_t first, size_t last) {
    Planner planner(input, boundaries, streams, sample.planner);
    std::vector<PlannedReference> references;
    std::vector<uint32_t> chains, interiors;
    Sums sums(streams.size(), Sums::value_type{});
    for (size_t i = first; i < last; i++) {
      references.clear();
      planner.plan(uint32_t(i) * stride, references);
      for (uint32_t s : open)
        for (uint8_t p : allowed[s]) {
          chains.clear();
          interiors.clear();
          planner.values().chains(s, p, chains);
          planner.values().seams(s, p, interiors);
          planner.traversed(s, p, interiors);
          for (const std::vector<uint32_t>* list : {&chains, &interiors})
            sums[s][p] += CodeSizes({list->data(), list->size()}, streams[s].elements).least();
        }
    }
    std::lock_guard<std::mutex> lock(mutex);
    for (uint32_t s : open)
      for (uint8_t p : allowed[s]) bits[s][p] += sums[s][p];
  });
  for (uint32_t s : open)
    streams[s].predictor =
        *std::min_element(allowed[s].begin(), allowed[s].end(),
                          [&](uint8_t p, uint8_t q) { return bits[s][p] < bits[s][q]; });
}

void BaseSizes::add(uint32_t list, uint32_t base, uint64_t bits) {
  bits_[list][base] = std::min(bits_[list][base] + bits, kImpossible);
}

void BaseSizes::add(const Stream& stream, const StreamLists& lists) {
  const CodeSizes chains(lists.of[kChains], stream.elements),
      interiors(lists.of[kInteriors], stream.elements);
  const Residuals anchors = lists.further_anchors(stream.elements);
  for (uint32_t base = 0; base < kBases; base++) {
    add(kAnchors, base, further_anchor_bits(anchors, stream, base));
    add(kChains, base, chains.best(CodedList::kChain, base));
    add(kInteriors, base, interiors.best(CodedList::kInterior, base));
  }
}

void BaseSizes::add(const BaseSizes& other) {
  for (uint32_t list = 0; list < kResidualLists; list++)
    for (uint32_t base = 0; base < kBases; base++) add(list, base, other.bits_[list][base]);
}

void BaseSizes::choose(Stream& stream) const {
  const auto best = [&](uint32_t list) {
    return uint8_t(std::min_element(bits_[list].begin(), bits_[list].end()) - bits_[list].begin());
  };
  stream.anchor_base = best(kAnchors);
  stream.chain_base = best(kChains);
  stream.interior_base = best(kInteriors);
}

}  // namespace gltf_meshlet_codec

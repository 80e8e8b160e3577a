// Chooses the streams' predictors and bases.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "encode/plan.h"
#include "encode/planner.h"

namespace gltf_meshlet_codec {

// In place of a stream's predictor: the encoder chooses.
constexpr uint8_t kChoosePredictor = 255;

// At most `count` meshlets: every n-th, n being at least least_stride.
struct PredictorSample {
  uint32_t count, least_stride;
  PlannerOptions planner;
};

// Tries the predictors that the format allows on a sample of the meshlets, for streams whose
// predictor is kChoosePredictor, and takes that of the fewest bits.
void choose_predictors(const EncoderInput& input, const Boundaries& boundaries,
                       std::vector<Stream>& streams, const PredictorSample& sample, int threads);

// Bits of all lists of one stream, by base.
class BaseSizes {
 public:
  // Adds the lists of a meshlet, or all of others.
  void add(const Stream& stream, const StreamLists& lists);
  void add(const BaseSizes& other);

  // Gives the stream the bases of the fewest bits.
  void choose(Stream& stream) const;

 private:
  static constexpr size_t kBases = CODE_MAX_PARAMETER + 1;
  void add(uint32_t list, uint32_t base, uint64_t bits);
  std::array<std::array<uint64_t, kBases>, kResidualLists> bits_{};
};

}  // namespace gltf_meshlet_codec

// Plans meshlets: chooses the gate from which each disk is traversed.
#pragma once
#include <cstdint>
#include <vector>

#include "encode/meshlet_values.h"

namespace gltf_meshlet_codec {

struct PlannerOptions {
  uint32_t gates;       // tried per disk, at most
  bool positions_only;  // count those of stream 0 only
};

// Plans meshlets of one mesh, one at a time. One thread at a time.
class Planner {
 public:
  // The streams have predictors. All arguments must outlive this object.
  Planner(const EncoderInput& input, const Boundaries& boundaries,
          const std::vector<Stream>& streams, const PlannerOptions& options)
      : input_(input),
        boundaries_(boundaries),
        streams_(streams),
        options_(options),
        meshlet_(input, boundaries),
        values_(streams, input.values),
        residuals_(kIntroductions * values_.element_count()) {
    for (uint32_t s = 0; s < streams.size(); s++) {
      all_streams_ |= 1ull << s;
      geo_streams_ |= uint64_t(streams[s].predictor == kGeo) << s;
    }
  }

  // Plans meshlet m and appends its references.
  Plan plan(uint32_t m, std::vector<PlannedReference>& references);

  // Append, for the meshlet planned last, a stream's residuals of the vertices that the traversal
  // introduces, or all lists of all streams with their counts.
  void traversed(uint32_t s, uint32_t predictor, std::vector<uint32_t>& out);
  void append_lists(std::vector<uint32_t>& residuals, std::vector<uint32_t>& counts);
  MeshletValues& values() { return values_; }

 private:
  static constexpr size_t kIntroductions = 256;

  void plan_disk(uint32_t disk, Plan& plan, std::vector<PlannedReference>& references);
  uint64_t cost(const Traversal& traversal, uint64_t streams);
  // Computes residuals of a mask of streams, unless known. triangle: packed.
  const uint32_t* residuals_of(Introduction introduction, uint32_t triangle, uint64_t streams);
  void append_stream(uint32_t s, std::vector<uint32_t>& residuals, std::vector<uint32_t>& counts);
  void add_references(uint32_t disk, uint32_t first, uint32_t start,
                      std::vector<PlannedReference>& references);

  const EncoderInput& input_;
  const Boundaries& boundaries_;
  const std::vector<Stream>& streams_;
  const PlannerOptions options_;
  LocalMeshlet meshlet_;
  MeshletValues values_;
  uint64_t all_streams_ = 0, geo_streams_ = 0;
  // Residuals of each introduction, computed when first asked for.
  std::vector<uint32_t> residuals_;
  uint64_t known_[kIntroductions];  // streams
  std::vector<uint32_t> list_;      // scratch
  // These three describe the meshlet planned last.
  std::vector<Introduction> introductions_;
  std::vector<uint32_t> triangles_;  // packed, of the introductions
  std::vector<uint8_t> loop_vertices_;
};

}  // namespace gltf_meshlet_codec

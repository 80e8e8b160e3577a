#include "encode/encoder.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <stdexcept>

#include "common/parallel.h"
#include "encode/blob_writer.h"
#include "encode/planner.h"

namespace meshlet {
namespace {

// Appends the time between two ends of stages to the statistics.
class StageClock {
 public:
  explicit StageClock(EncoderStats& stats) : stats_(stats) {}
  void end_stage(const char* stage) {
    const Clock::time_point now = Clock::now();
    stats_.stage_seconds.emplace_back(stage, std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }

 private:
  using Clock = std::chrono::steady_clock;
  EncoderStats& stats_;
  Clock::time_point last_ = Clock::now();
};

PlannerOptions planner_options(Effort effort) {
  switch (effort) {
    case Effort::kFast: return {2, false};
    case Effort::kMax: return {MESHLET_VERTICES, true};
    default: return {8, false};
  }
}

// Meshlets sampled to choose a stream's predictor.
uint32_t predictor_sample(Effort effort) { return effort == Effort::kFast ? 128 : 512; }

// Plans all meshlets, and gives the streams their bases.
std::vector<PlanChunk> plan_all(const EncoderInput& input, const Boundaries& boundaries,
                                std::vector<Stream>& streams, const EncodeOptions& options) {
  const size_t meshlets = input.meshlets.meshlet_begin.size() - 1;
  std::vector<PlanChunk> chunks((meshlets + kChunkMeshlets - 1) / kChunkMeshlets);
  std::vector<BaseSizes> sizes(streams.size());
  std::mutex mutex;
  parallel_for(options.threads, chunks.size(), [&](size_t c) {
    PlanChunk& chunk = chunks[c];
    Planner planner(input, boundaries, streams, planner_options(options.effort));
    std::vector<BaseSizes> chunk_sizes(streams.size());
    std::vector<StreamLists> lists(streams.size());
    const size_t end = std::min(meshlets, (c + 1) * kChunkMeshlets);
    for (size_t m = c * kChunkMeshlets; m < end; m++) {
      chunk.plans.push_back(planner.plan(uint32_t(m), chunk.references));
      chunk.plans.back().first_residual = uint32_t(chunk.residuals.size());
      for (uint32_t s = 0; s < streams.size(); s++)
        planner.append_lists(s, chunk.residuals, chunk.residual_counts);
      chunk.lists_of(chunk.plans.size() - 1, lists);
      for (uint32_t s = 0; s < streams.size(); s++) chunk_sizes[s].add(streams[s], lists[s]);
    }
    chunk.residuals.shrink_to_fit();
    chunk.references.shrink_to_fit();
    std::lock_guard<std::mutex> lock(mutex);
    for (uint32_t s = 0; s < streams.size(); s++) sizes[s].add(chunk_sizes[s]);
  });
  for (uint32_t s = 0; s < streams.size(); s++) sizes[s].choose(streams[s]);
  return chunks;
}

}  // namespace

void check_input(const MeshView& mesh, const std::vector<Stream>& streams) {
  if (mesh.triangle_count == 0)
    throw std::invalid_argument("a primitive without triangles cannot be encoded");
  if (mesh.triangle_count > (1u << 30) / 3)
    throw std::length_error("the primitive has more than 357 million triangles; split it");
  if (streams.empty() || streams.size() > BLOB_MAX_STREAMS)
    throw std::invalid_argument("a primitive needs 1 to 64 streams");
  std::vector<Stream> known = streams;
  for (Stream& s : known)
    if (s.predictor == kChoosePredictor) s.predictor = kCopy;
  const std::string problem = streams_problem(known);
  if (!problem.empty()) throw std::invalid_argument(problem);
}

SegmentedMesh segment_for_encoder(const MeshView& mesh, const EncodeOptions& options, float share,
                                  EncoderStats& stats) {
  StageClock clock(stats);
  GenerationOptions generation = options;
  if (options.progress) generation.progress = [&](float f) { options.progress(share * f); };
  SpatialMesh sorted = sort_in_space(mesh, options.threads);
  HalfEdges half_edges = match_half_edges(sorted.view(), options.threads);
  clock.end_stage("sort");
  Meshlets meshlets = generate_meshlets(sorted, half_edges, generation);
  clock.end_stage("grow");
  stats.stage_seconds.back().second -= meshlets.join_seconds;
  stats.stage_seconds.emplace_back("join", meshlets.join_seconds);
  stats.iterations = meshlets.iterations_run;
  std::copy(meshlets.histogram, meshlets.histogram + 4, stats.histogram);
  return {std::move(sorted), std::move(half_edges), std::move(meshlets)};
}

std::vector<uint8_t> encode_meshlets(const EncoderInput& input, std::vector<Stream> streams,
                                     const EncodeOptions& options, EncoderStats& stats) {
  StageClock clock(stats);
  const auto progress = [&](float f) {
    if (options.progress) options.progress(f);
  };
  const Boundaries boundaries = find_boundaries(input.mesh, input.half_edges, input.meshlets,
                                                input.values, options.share_seams, options.threads);
  progress(0.25f);
  clock.end_stage("boundaries");
  choose_predictors(input, boundaries, streams, planner_options(options.effort),
                    predictor_sample(options.effort), options.threads);
  std::vector<PlanChunk> chunks = plan_all(input, boundaries, streams, options);
  progress(0.75f);
  clock.end_stage("predict");
  WrittenBlob blob = write_blob(chunks, streams, boundaries, options.threads);
  stats.meshlets = blob.meshlets;
  stats.vertices = blob.vertices;
  stats.bits = std::move(blob.bits);
  progress(1.0f);
  clock.end_stage("write");
  return std::move(blob.bytes);
}

std::vector<uint8_t> encode(const MeshView& mesh, const std::vector<Stream>& streams,
                            const VertexValues& values, const EncodeOptions& options,
                            EncoderStats& stats) {
  constexpr float kSegmentShare = 0.6f;  // of the progress
  check_input(mesh, streams);
  const SegmentedMesh segmented = segment_for_encoder(mesh, options, kSegmentShare, stats);
  EncodeOptions rest = options;
  if (options.progress)
    rest.progress = [&](float f) { options.progress(kSegmentShare + (1 - kSegmentShare) * f); };
  VertexValues sorted_values = values;
  sorted_values.rows = segmented.mesh.source_vertex.data();
  const MeshView view = segmented.mesh.view();
  return encode_meshlets({view, segmented.half_edges, segmented.meshlets, sorted_values}, streams,
                         rest, stats);
}

}  // namespace meshlet

#include "encode/encoder.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <mutex>
#include <stdexcept>
#include <string_view>

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
    stats_.add_seconds(stage, std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }

 private:
  using Clock = std::chrono::steady_clock;
  EncoderStats& stats_;
  Clock::time_point last_ = Clock::now();
};

// What the second half of the encoder tries. kFast compares gates by positions alone and samples
// every 16th and 8th meshlet instead of every 8th and 4th: each saves 3 to 5 % of its time for at
// most 0.15 % more bytes.
struct Trials {
  PlannerOptions planner;
  PredictorSample predictors;
  uint32_t base_stride;  // every n-th meshlet counts in the choice of bases
};

Trials trials_of(Effort effort) {
  constexpr PlannerOptions eight{8, false, false}, all{MESHLET_VERTICES, true, false};
  switch (effort) {
    case Effort::kFast: return {{3, false, true}, {256, 16, {1, false, true}}, 8};
    case Effort::kNormal: return {eight, {512, 4, eight}, 1};
    case Effort::kHigh: return {eight, {512, 1, eight}, 1};
    case Effort::kMax: return {all, {4096, 1, all}, 1};
  }
  throw std::logic_error("an effort is unknown");
}

// Makes the meshlets and notes in `stats` how.
void generate(SegmentedMesh& segmented, const GenerationOptions& options, EncoderStats& stats) {
  StageClock clock(stats);
  segmented.meshlets = generate_meshlets(segmented.mesh, segmented.half_edges, options);
  clock.end_stage("grow");
  stats.stage_seconds.back().second -= segmented.meshlets.join_seconds;
  stats.stage_seconds.emplace_back("join", segmented.meshlets.join_seconds);
  stats.iterations = segmented.meshlets.iterations_run;
  std::copy(segmented.meshlets.histogram, segmented.meshlets.histogram + 4, stats.histogram);
}

// Plans all meshlets, and gives the streams their bases.
std::vector<PlanChunk> plan_all(const EncoderInput& input, const Boundaries& boundaries,
                                std::vector<Stream>& streams, const Trials& trials, int threads) {
  const size_t meshlets = input.meshlets.meshlet_begin.size() - 1;
  std::vector<PlanChunk> chunks((meshlets + kChunkMeshlets - 1) / kChunkMeshlets);
  std::vector<BaseSizes> sizes(streams.size());
  std::mutex mutex;
  parallel_for(threads, chunks.size(), [&](size_t c) {
    PlanChunk& chunk = chunks[c];
    chunk.plans.reserve(kChunkMeshlets);
    Planner planner(input, boundaries, streams, trials.planner);
    std::vector<BaseSizes> chunk_sizes(streams.size());
    std::vector<StreamLists> lists(streams.size());
    const size_t end = std::min(meshlets, (c + 1) * kChunkMeshlets);
    for (size_t m = c * kChunkMeshlets; m < end; m++) {
      chunk.plans.push_back(planner.plan(uint32_t(m), chunk.references));
      chunk.plans.back().first_residual = uint32_t(chunk.residuals.size());
      planner.append_lists(chunk.residuals, chunk.residual_counts);
      if (m % trials.base_stride != 0) continue;
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

std::vector<uint8_t> encode_segmented(const SegmentedMesh& segmented,
                                      const std::vector<Stream>& streams,
                                      const VertexValues& values, const EncodeOptions& options,
                                      EncoderStats& stats, bool high_too) {
  VertexValues sorted_values = values;
  sorted_values.rows = segmented.mesh.source_vertex.data();
  const MeshView view = segmented.mesh.view();
  return encode_meshlets({view, segmented.half_edges, segmented.meshlets, sorted_values}, streams,
                         options, stats, high_too);
}

// kMax makes meshlets with these factors of the options. Together with exact costs of gates, that
// saves 0.2 % in about ten times as long.
struct Factors {
  float lambda, fill;
  int iterations;
};
constexpr Factors kFactors[] = {{1, 1, 1}, {1, 1, 2}, {1.3f, 1, 1}, {0.85f, 1, 1}, {1, 0.97f, 1}};

// The smallest blob of several. At most as large as kHigh's, which is tried with the first factors.
std::vector<uint8_t> encode_max(SegmentedMesh segmented, const std::vector<Stream>& streams,
                                const VertexValues& values, const EncodeOptions& options,
                                EncoderStats& stats) {
  EncodeOptions trial = options;
  trial.progress = nullptr;
  EncoderStats total = stats, best;
  std::vector<uint8_t> smallest;
  size_t done = 0;
  for (const Factors& factors : kFactors) {
    EncoderStats trial_stats = stats;
    trial_stats.stage_seconds.clear();
    trial.lambda = factors.lambda * options.lambda;
    trial.fill = std::min(1.0f, factors.fill * options.fill);
    trial.iterations = factors.iterations * options.iterations;
    if (done > 0) generate(segmented, trial, trial_stats);
    std::vector<uint8_t> blob =
        encode_segmented(segmented, streams, values, trial, trial_stats, done == 0);
    total.add_seconds(trial_stats);
    done++;
    if (options.progress) options.progress(float(done) / float(std::size(kFactors)));
    if (!smallest.empty() && blob.size() >= smallest.size()) continue;
    smallest = std::move(blob);
    best = std::move(trial_stats);
  }
  best.stage_seconds = std::move(total.stage_seconds);
  stats = std::move(best);
  return smallest;
}

}  // namespace

void EncoderStats::add_seconds(const char* stage, double seconds) {
  const auto same = [&](const auto& known) { return std::string_view(known.first) == stage; };
  const auto found = std::find_if(stage_seconds.begin(), stage_seconds.end(), same);
  if (found == stage_seconds.end())
    stage_seconds.emplace_back(stage, seconds);
  else
    found->second += seconds;
}

void EncoderStats::add_seconds(const EncoderStats& other) {
  for (const auto& [stage, seconds] : other.stage_seconds) add_seconds(stage, seconds);
}

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
  if (const Problem problem = streams_problem(known))
    throw std::invalid_argument(sentence(problem));
}

SegmentedMesh segment_for_encoder(const MeshView& mesh, const EncodeOptions& options, float share,
                                  EncoderStats& stats) {
  StageClock clock(stats);
  GenerationOptions generation = options;
  if (options.progress) generation.progress = [&](float f) { options.progress(share * f); };
  SpatialMesh sorted = sort_in_space(mesh, options.threads);
  HalfEdges half_edges = match_half_edges(sorted.view(), options.threads);
  clock.end_stage("sort");
  SegmentedMesh segmented{std::move(sorted), std::move(half_edges), {}};
  generate(segmented, generation, stats);
  return segmented;
}

std::vector<uint8_t> encode_meshlets(const EncoderInput& input, const std::vector<Stream>& streams,
                                     const EncodeOptions& options, EncoderStats& stats,
                                     bool high_too) {
  StageClock clock(stats);
  const auto progress = [&](float f) {
    if (options.progress) options.progress(f);
  };
  const Boundaries boundaries = find_boundaries(input.mesh, input.half_edges, input.meshlets,
                                                input.values, options.share_seams, options.threads);
  progress(0.25f);
  clock.end_stage("boundaries");
  std::vector<Effort> efforts{options.effort};
  if (options.effort == Effort::kMax && high_too) efforts.push_back(Effort::kHigh);
  const float share = 0.75f / float(efforts.size());
  WrittenBlob best;
  for (size_t i = 0; i < efforts.size(); i++) {
    std::vector<Stream> chosen = streams;
    const Trials trials = trials_of(efforts[i]);
    choose_predictors(input, boundaries, chosen, trials.predictors, options.threads);
    std::vector<PlanChunk> chunks = plan_all(input, boundaries, chosen, trials, options.threads);
    progress(0.25f + share * (float(i) + 2.0f / 3.0f));
    clock.end_stage("predict");
    WrittenBlob blob = write_blob(chunks, chosen, boundaries, options.threads);
    if (i == 0 || blob.bytes.size() < best.bytes.size()) best = std::move(blob);
    progress(0.25f + share * float(i + 1));
    clock.end_stage("write");
  }
  stats.meshlets = best.meshlets;
  stats.vertices = best.vertices;
  stats.bits = std::move(best.bits);
  return std::move(best.bytes);
}

std::vector<uint8_t> encode(const MeshView& mesh, const std::vector<Stream>& streams,
                            const VertexValues& values, const EncodeOptions& options,
                            EncoderStats& stats) {
  // Of the progress. With kMax, this is the first of several trials.
  const float share = options.effort == Effort::kMax ? 0.0f : 0.6f;
  check_input(mesh, streams);
  SegmentedMesh segmented = segment_for_encoder(mesh, options, share, stats);
  EncodeOptions rest = options;
  if (options.progress) rest.progress = [&](float f) { options.progress(share + (1 - share) * f); };
  return options.effort == Effort::kMax
             ? encode_max(std::move(segmented), streams, values, rest, stats)
             : encode_segmented(segmented, streams, values, rest, stats, false);
}

}  // namespace meshlet

#include "encode/encoder.h"

#include <algorithm>
#include <mutex>
#include <stdexcept>

#include "common/parallel.h"
#include "encode/blob_writer.h"
#include "encode/planner.h"

namespace gltf_meshlet_codec {
namespace {

// The choices that the second half of the encoder tries. kFast compares gates by positions alone
// and samples every 16th and 8th meshlet instead of every 8th and 4th: each saves 3 to 5 % of its
// time for at most 0.15 % more bytes.
struct Trials {
  PlannerOptions planner;
  PredictorSample predictors;
  uint32_t base_stride;  // every n-th meshlet counts in the choice of bases
};

Trials trials_of(Effort effort) {
  constexpr PlannerOptions eight{8, false};
  switch (effort) {
    case Effort::kFast: return {{3, true}, {256, 16, {1, true}}, 8};
    case Effort::kNormal: return {eight, {512, 4, eight}, 1};
    case Effort::kPaper: return {eight, {512, 1, eight}, 1};
  }
  throw std::logic_error("an effort is unknown");
}

// Plans all meshlets, and gives the streams their bases.
std::vector<PlanChunk> plan_all(const EncoderInput& input, const Boundaries& boundaries,
                                std::vector<Stream>& streams, const Trials& trials, int threads) {
  const size_t meshlets = input.meshlets.count();
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
  if (const Problem problem = streams_problem(known.data(), known.size()))
    throw std::invalid_argument(sentence(problem));
}

SegmentedMesh segment_for_encoder(const MeshView& mesh, const EncodeOptions& options, float share,
                                  EncoderStats& stats) {
  GenerationOptions generation = options;
  if (options.progress) generation.progress = [&](float f) { options.progress(share * f); };
  SpatialMesh sorted = sort_in_space(mesh, options.threads);
  HalfEdges half_edges = match_half_edges(sorted.view(), options.threads);
  Meshlets meshlets = generate_meshlets(sorted, half_edges, generation);
  stats.iterations = meshlets.iterations_run;
  std::copy(meshlets.histogram, meshlets.histogram + 4, stats.histogram);
  return {std::move(sorted), std::move(half_edges), std::move(meshlets)};
}

std::vector<uint8_t> encode_meshlets(const EncoderInput& input, const std::vector<Stream>& streams,
                                     const EncodeOptions& options, EncoderStats& stats) {
  const auto progress = [&](float f) {
    if (options.progress) options.progress(f);
  };
  const Boundaries boundaries = find_boundaries(input.mesh, input.half_edges, input.meshlets,
                                                input.values, options.share_seams, options.threads);
  progress(0.25f);
  std::vector<Stream> chosen = streams;
  const Trials trials = trials_of(options.effort);
  choose_predictors(input, boundaries, chosen, trials.predictors, options.threads);
  std::vector<PlanChunk> chunks = plan_all(input, boundaries, chosen, trials, options.threads);
  progress(0.75f);
  WrittenBlob blob = write_blob(chunks, chosen, boundaries, options.threads);
  progress(1.0f);
  stats.meshlets = blob.meshlets;
  stats.vertices = blob.vertices;
  stats.bits = std::move(blob.bits);
  return std::move(blob.bytes);
}

std::vector<uint8_t> encode(const MeshView& mesh, const std::vector<Stream>& streams,
                            const VertexValues& values, const EncodeOptions& options,
                            EncoderStats& stats) {
  constexpr float share = 0.6f;  // of the progress
  check_input(mesh, streams);
  const SegmentedMesh segmented = segment_for_encoder(mesh, options, share, stats);
  EncodeOptions rest = options;
  if (options.progress) rest.progress = [&](float f) { options.progress(share + (1 - share) * f); };
  const MeshView view = segmented.mesh.view();
  const VertexValues sorted_values = segmented.sorted(values);
  return encode_meshlets({view, segmented.half_edges, segmented.meshlets, sorted_values}, streams,
                         rest, stats);
}

}  // namespace gltf_meshlet_codec

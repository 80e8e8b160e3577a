#include "lod/reduce_groups.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/parallel.h"

namespace gltf_meshlet_codec {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
// A group of which a larger fraction of triangles remains does not count as simplified: its
// clusters wait for the next level.
constexpr double kStuckFraction = 0.85;
// A group of which a larger fraction remains is simplified again without its seams.
constexpr double kRetryFraction = 0.5;
// A group whose error is kHigh times that of its level is simplified again with the lost parts
// locked, and keeps its triangles after kTries + kLastTries attempts. Otherwise a few groups,
// mostly thin parts that vanish, decide the errors of all coarser levels: with kHigh = 4, dragon
// draws twice the triangles. Usually about ten of thousands of vertices are locked, and the group
// gets as few triangles as before. Dragon with four times its triangles and noise draws 1.39 times
// the triangles of a discrete chain; if only limits are lowered, 1.82 times.
// The last attempts come after the level has its error, which they do not change: with 5 tries and
// none after, files of engine are 1.8 % larger. Without them, one of the five groups of
// DamagedHelmet, for which the fourth attempt is enough, keeps its 4,093 triangles: level 1 has
// 7,963 at 13 bits for positions, and 4,879 at 12, where three attempts happen to do.
constexpr double kHigh = 1.2;
constexpr int kTries = 3, kLastTries = 2;
constexpr double kLeastMedian = 0.25;  // cells of the grid
// The smallest factor by which an attempt lowers a limit. With 0.5, level 2 of DamagedHelmet has
// 3,155 triangles instead of 1,747 at the same error, and sponza_like is 1.71 times level 0, not
// 1.69.
constexpr double kStrongest = 0.25;
constexpr double kLooser = 2;  // by which the error of a level that must shrink more grows
// meshopt_SimplifySparse: triangles use few of the vertices; meshopt_SimplifyErrorAbsolute.
constexpr uint32_t kSparse = 2, kErrorAbsolute = 4;
constexpr float kLargestError = 1e30f;
// The cosine of the largest angle between a triangle and the normal that fits best at its corner.
constexpr float kLeastCosine = 0.01f;

using Numbers = std::vector<uint32_t>;

// Returns 1 for locked vertices and those at positions that two groups share.
std::vector<uint8_t> find_border_vertices(const Surface& surface, const GroupTriangles& groups) {
  constexpr uint32_t kNone = ~0u, kShared = ~0u - 1;
  std::vector<uint32_t> owner(surface.vertex_of_position.size(), kNone);  // of each position
  for (uint32_t g = 0; g < groups.groups(); g++)
    for (const uint32_t* v = groups.corners(g); v != groups.corners(g + 1); v++) {
      uint32_t& of = owner[surface.position_ids[*v]];
      of = of == kNone || of == g ? g : kShared;
    }
  std::vector<uint8_t> is_border(surface.vertex_count);
  for (size_t v = 0; v < is_border.size(); v++)
    is_border[v] =
        owner[surface.position_ids[v]] == kShared || (surface.locked && surface.locked[v] != 0);
  return is_border;
}

// A group after an attempt.
struct Attempt {
  Triangles triangles;
  double collapse_error;  // the largest one of a collapse
  bool is_joined;         // were seams ignored? Then the vertices of each position are joined.
};

// The groups of a level while they are simplified.
class Reduction {
 public:
  Reduction(const Surface& surface, const GroupTriangles& groups, double step,
            GroupMeasure& measure, const Simplifier& simplifier, int threads)
      : surface_(surface),
        groups_(groups),
        step_(step),
        measure_(measure),
        simplifier_(simplifier),
        threads_(threads),
        border_vertices_(find_border_vertices(surface, groups)),
        locked_vertices_(border_vertices_),
        state_{Pieces(groups.groups()), std::vector<double>(groups.groups(), kInfinite),
               std::vector<bool>(groups.groups()), Numbers(groups.groups())},
        error_(groups.groups(), kInfinite) {}

  // What `restore` restores of each group.
  struct State {
    Pieces pieces;
    std::vector<double> collapse_limit;  // the largest error of a collapse that it may have
    std::vector<bool> is_joined;         // are seams ignored?
    Numbers attempts;
  };

  const State& state() const { return state_; }
  ReducedGroups take(double level_error) {
    return {std::move(state_.pieces), std::move(error_), level_error};
  }

  // Simplifies these groups up to their limits, and measures them.
  void attempt(const Numbers& groups) {
    std::vector<Attempt> attempts(groups.size());
    parallel_for(threads_, groups.size(), [&](size_t i) { attempts[i] = simplify(groups[i]); });
    Numbers solved;
    for (size_t i = 0; i < groups.size(); i++) {
      const uint32_t g = groups[i];
      Triangles& triangles = attempts[i].triangles;
      const double most = kStuckFraction * 3 * double(groups_.size(g));
      const bool is_solved = !triangles.empty() && double(triangles.size()) <= most;
      state_.collapse_limit[g] = attempts[i].collapse_error;
      state_.is_joined[g] = attempts[i].is_joined;
      state_.attempts[g]++;
      state_.pieces[g] = is_solved ? std::move(triangles) : groups_.of(g);
      error_[g] = is_solved ? 0 : kInfinite;
      if (is_solved) solved.push_back(g);
    }
    measure(solved);
  }

  // Simplifies groups that are farther from level 0 than the limit again, `count` times at most.
  // lowers_limits: whether the first time lowers the limits of all.
  void keep_to(double error_limit, int count, bool lowers_limits) {
    for (int i = 0; i < count; i++, lowers_limits = true) {
      const Numbers far_groups = above(kHigh * error_limit);
      if (far_groups.empty()) break;
      restrict_groups(far_groups, error_limit, lowers_limits);
      attempt(far_groups);
    }
  }

  // Gives groups with a larger error their triangles back: they are stuck.
  void undo_above(double max_error) {
    for (uint32_t g : above(max_error)) {
      state_.pieces[g] = groups_.of(g);
      error_[g] = kInfinite;
    }
  }

  // Restores the groups to a state, and measures those that changed.
  void restore(const State& state) {
    Numbers changed;
    for (uint32_t g = 0; g < error_.size(); g++)
      if (state.attempts[g] != state_.attempts[g]) changed.push_back(g);
    state_ = state;
    locked_vertices_ = border_vertices_;
    measure(changed);
  }

  // The number of triangles, if groups with a larger error keep theirs.
  size_t triangles_within(double max_error) const {
    size_t count = 0;
    for (size_t g = 0; g < error_.size(); g++)
      count += is_above(g, max_error) ? groups_.size(g) : state_.pieces[g].size() / 3;
    return count;
  }

  bool is_any_solved() const {
    return std::any_of(error_.begin(), error_.end(), [](double e) { return std::isfinite(e); });
  }

  // The median error of the simplified groups, weighted by their old triangles.
  double median() const {
    Numbers order;
    size_t sum = 0;
    for (uint32_t g = 0; g < error_.size(); g++)
      if (std::isfinite(error_[g])) order.push_back(g), sum += groups_.size(g);
    std::stable_sort(order.begin(), order.end(),
                     [&](uint32_t a, uint32_t b) { return error_[a] < error_[b]; });
    size_t i = 0, passed = groups_.size(order[0]);
    while (2 * passed < sum) passed += groups_.size(order[++i]);
    return std::max(error_[order[i]], kLeastMedian);
  }

 private:
  bool is_above(size_t g, double max_error) const {
    return std::isfinite(error_[g]) && error_[g] > max_error;
  }

  // The simplified groups with a larger error.
  Numbers above(double max_error) const {
    Numbers found;
    for (uint32_t g = 0; g < error_.size(); g++)
      if (is_above(g, max_error)) found.push_back(g);
    return found;
  }

  void measure(const Numbers& groups) {
    if (groups.empty()) return;
    const std::vector<float> errors = measure_.measure(state_.pieces, groups);
    for (size_t i = 0; i < groups.size(); i++) error_[groups[i]] = double(errors[i]);
  }

  // Locks the vertices around parts that groups lost, or lowers their limits.
  //
  // Limits are lowered for groups that lost nothing new. Where seams are ignored, the simplifier
  // sees one vertex of each position, and most locks miss it: limits do the rest.
  void restrict_groups(const Numbers& groups, double error, bool lowers_limits) {
    std::vector<Numbers> lost(groups.size());
    parallel_for(threads_, groups.size(), [&](size_t i) {
      lost[i] = measure_.lost_vertices(groups[i], state_.pieces[groups[i]], kHigh * error);
    });
    for (size_t i = 0; i < groups.size(); i++) {
      bool is_any_new = false;
      for (uint32_t v : lost[i]) {
        is_any_new |= locked_vertices_[v] == 0;
        locked_vertices_[v] = 1;
      }
      const uint32_t g = groups[i];
      if (lowers_limits || !is_any_new)
        state_.collapse_limit[g] *= std::max(error / error_[g], kStrongest);
    }
  }

  // Simplifies a group, without its seams if these leave too many triangles.
  Attempt simplify(uint32_t g) const {
    const Triangles triangles = groups_.of(g);
    const double limit = state_.collapse_limit[g];
    Attempt result{triangles, 0, state_.is_joined[g]};
    if (!result.is_joined)
      result.triangles = simplify(g, triangles, surface_.attribute_count, result.collapse_error);
    const bool leaves_many =
        double(result.triangles.size()) > kRetryFraction * double(triangles.size());
    if (result.is_joined || (std::isinf(limit) && leaves_many)) {
      Triangles joined = triangles;
      for (uint32_t& v : joined) v = surface_.vertex_of_position[surface_.position_ids[v]];
      double error;
      joined = simplify(g, joined, 0, error);
      if (result.is_joined || joined.size() < result.triangles.size())
        result = {std::move(joined), error, true};
    }
    size_t count = 0;
    for (size_t i = 0; i < result.triangles.size(); i += 3) {
      const uint32_t* corners = &result.triangles[i];
      if (surface_.is_degenerate(corners)) continue;
      std::copy_n(corners, 3, &result.triangles[count]);
      count += 3;
    }
    result.triangles.resize(count);
    return result;
  }

  // Collapses edges onto existing vertices until the target is reached, or the group's limit.
  Triangles simplify(uint32_t g, const Triangles& triangles, size_t attribute_count,
                     double& collapse_error) const {
    const double all = double(triangles.size() / 3);
    const double target = std::clamp(std::nearbyint(all / step_), 1.0, all);  // half to even
    const float limit = float(std::min(state_.collapse_limit[g], double(kLargestError)));
    const size_t vertices = surface_.vertex_count, stride = attribute_count * sizeof(float);
    const float* const attributes = attribute_count ? surface_.attributes : nullptr;
    const float* const weights = attribute_count ? surface_.weights : nullptr;
    const uint32_t options = kSparse | kErrorAbsolute;
    Triangles result(triangles.size());
    float error = 0;
    size_t count;
    if (surface_.choices && simplifier_.simplify_guarded) {
      const VertexChoices& choices = *surface_.choices;
      count = simplifier_.simplify_guarded(
          result.data(), triangles.data(), triangles.size(), surface_.seam_points, vertices, 12,
          attributes, stride, weights, attribute_count, locked_vertices_.data(), 3 * size_t(target),
          limit, options, &error, choices.places, choices.begin.data(),
          choices.place_normals.data(), kLeastCosine);
    } else {
      count = simplifier_.simplify(result.data(), triangles.data(), triangles.size(),
                                   surface_.seam_points, vertices, 12, attributes, stride, weights,
                                   attribute_count, locked_vertices_.data(), 3 * size_t(target),
                                   limit, options, &error);
    }
    result.resize(std::min(count, result.size()));
    collapse_error = double(error);
    return result;
  }

  const Surface& surface_;
  const GroupTriangles& groups_;
  const double step_;
  GroupMeasure& measure_;
  const Simplifier& simplifier_;
  const int threads_;
  const std::vector<uint8_t> border_vertices_;
  std::vector<uint8_t> locked_vertices_;
  State state_;
  std::vector<double> error_;
};

}  // namespace

std::vector<uint32_t> joined(const Pieces& pieces, Triangles& all) {
  std::vector<uint32_t> begin{0};
  size_t corners = all.size();
  for (const Triangles& piece : pieces) corners += piece.size();
  all.reserve(corners);
  for (const Triangles& piece : pieces) {
    all.insert(all.end(), piece.begin(), piece.end());
    begin.push_back(begin.back() + uint32_t(piece.size() / 3));
  }
  return begin;
}

ReducedGroups reduce_groups(const Surface& surface, const GroupTriangles& groups, double step,
                            GroupMeasure& measure, double expected_error,
                            const Simplifier& simplifier, int threads) {
  Reduction reduction(surface, groups, step, measure, simplifier, threads);
  Numbers all(groups.groups());
  std::iota(all.begin(), all.end(), 0);
  reduction.attempt(all);
  if (!reduction.is_any_solved()) return reduction.take(expected_error);
  const Reduction::State first_state = reduction.state();
  const double median = reduction.median();
  double error_limit = std::min(median, expected_error);
  for (;;) {
    reduction.keep_to(error_limit, kTries, false);
    const size_t within = reduction.triangles_within(kHigh * error_limit);
    if (double(within) <= kShrink * double(groups.count())) break;
    reduction.restore(first_state);
    if (error_limit == median) return reduction.take(error_limit);
    error_limit = std::min(kLooser * error_limit, median);
  }
  reduction.keep_to(error_limit, kLastTries, true);
  reduction.undo_above(kHigh * error_limit);
  return reduction.take(error_limit);
}

}  // namespace gltf_meshlet_codec

#include "lod/build_levels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "lod/error_meter.h"
#include "lod/group_meshlets.h"
#include "lod/reduce_groups.h"

namespace gltf_meshlet_codec {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
// Triangles of a level over those of the next: shares of the reduction that the caller asks for.
// The first step has the most triangles, and decides the size of the file; the smaller the others,
// the closer is a level to any error. With steps of 4.2, 3.4, 2.9 instead of 5, 2.5, 2.25 dragon
// draws 1.25 times the triangles and igea 1.1 times, in files of about the same size.
constexpr double kSteps[] = {1.0, 0.5, 0.45};
// The error that level 1 should have at most, in longest sides of the primitive. Without a limit,
// level 1 of DamagedHelmet has 6,989 triangles of 15,452 at 0.07 of its side, with it 4,896 at half
// of that: groups that cannot take the whole step spoil it. 0.01 makes files of engine and
// sponza_like larger than 1.7 times level 0.
constexpr double kFirstError = 0.03;
constexpr size_t kLastLevelTriangles = 128;  // triangles of the last level, at most

using Numbers = std::vector<uint32_t>;

double longest_side(const float* points, size_t count) {
  Vec3 low{0, 0, 0}, high = low;
  for (size_t v = 0; v < count; v++) {
    const Vec3 p{points[3 * v], points[3 * v + 1], points[3 * v + 2]};
    low = v ? minimum(low, p) : p;
    high = v ? maximum(high, p) : p;
  }
  return double(Box{low, high}.longest_side());
}

class Builder {
 public:
  Builder(const Surface& surface, ClusterSet given, const PagePilot& pilot,
          const Simplifier& simplifier, const LevelOptions& options)
      : surface_(surface),
        pilot_(pilot),
        simplifier_(simplifier),
        options_(options),
        next_level_(options.level),
        all_(std::move(given)) {
    options_.generation.progress = nullptr;  // of the builder, not of meshlets
    const bool is_first = all_.clusters.empty();
    level_error_ = is_first ? kFirstError * longest_side(surface.points, surface.vertex_count) /
                                  options.reduction
                            : kInfinite;
    if (is_first) make_level_0();
    cluster_group_.assign(all_.clusters.size(), kNoGroup);
    frontier_.resize(all_.clusters.size());
    std::iota(frontier_.begin(), frontier_.end(), 0);
  }

  // Groups the clusters of the frontier and simplifies the groups. Returns the number of triangles
  // of the next level, 0 if this level is the last.
  size_t add_level() {
    const bool may_end = options_.builds_all;
    form_groups();
    list_triangles();
    const bool is_small = frontier_triangles() <= kLastLevelTriangles || frontier_.size() == 1;
    if ((may_end && is_small) || triangle_ids_.empty()) return end_level();
    ReducedGroups reduced = reduce();
    std::vector<double> error = stated_errors(std::move(reduced.error));
    std::vector<bool> is_stuck(groups_.size());
    size_t next_count = 0, stuck_count = 0;
    Pieces next = std::move(reduced.pieces);
    const GroupTriangles old = old_groups();
    for (size_t g = 0; g < groups_.size(); g++) {
      is_stuck[g] = !(std::isfinite(error[g]) && error[g] <= options_.error_limit);
      if (is_stuck[g]) next[g] = old.of(g), stuck_count += old.size(g);
      next_count += next[g].size() / 3;
    }
    if (may_end && double(next_count) > kShrink * double(triangle_ids_.size())) return end_level();
    built_.stuck_triangles.push_back(stuck_count);
    if (level_ == 0) unstick(next, error, is_stuck);
    if (std::find(is_stuck.begin(), is_stuck.end(), false) == is_stuck.end())
      return triangle_ids_.size();
    replace(std::move(next), error, is_stuck);
    return frontier_triangles();
  }

  // Makes a last level of the frontier's clusters.
  void end() {
    form_groups();
    end_level();
  }

  // Returns the levels so far, without the frontier, whose clusters wait.
  Levels take() {
    meter_.reset();  // its trees are as large as all else
    if (frontier_.empty()) {
      built_.grouped = std::move(all_);
      built_.cluster_group.assign(cluster_group_.begin(), cluster_group_.end());
      return std::move(built_);
    }
    for (uint32_t c = 0; c < all_.clusters.size(); c++) {
      if (cluster_group_[c] == kNoGroup) continue;
      built_.grouped.append(all_, c);
      built_.cluster_group.push_back(uint32_t(cluster_group_[c]));
    }
    for (uint32_t c : frontier_) built_.waiting.append(all_, c);
    return std::move(built_);
  }

 private:
  // --- clusters ---

  void make_level_0() {
    Triangles triangles(surface_.triangles, surface_.triangles + 3 * surface_.triangle_count);
    Numbers order;
    const GroupMeshlets made =
        make_clusters(triangles, {0, uint32_t(surface_.triangle_count)}, order);
    for (size_t c = 0; c < made.count(); c++)
      all_.clusters.push_back({kNoGroup, 0, 0, cluster_sphere(c)});
  }

  // Splits groups of triangles into clusters, and appends their ranges. order: the numbers of the
  // triangles in the order of the clusters.
  GroupMeshlets make_clusters(const Triangles& triangles, const Numbers& begin, Numbers& order) {
    const MeshView mesh{triangles.data(), triangles.size() / 3, surface_.position_ids,
                        surface_.points, surface_.vertex_count};
    GroupMeshlets made = generate_in_groups(mesh, begin, options_.generation);
    order = std::move(made.triangles);
    ClusterRanges& all = all_.ranges;
    const uint32_t first_disk = all.cluster_begin.back(), first = all.disk_begin.back();
    for (size_t d = 1; d < made.disk_begin.size(); d++)
      all.disk_begin.push_back(first + made.disk_begin[d]);
    for (size_t c = 1; c < made.meshlet_begin.size(); c++)
      all.cluster_begin.push_back(first_disk + made.meshlet_begin[c]);
    all.triangles.reserve(all.triangles.size() + triangles.size());
    for (uint32_t t : order)
      all.triangles.insert(all.triangles.end(), &triangles[3 * size_t(t)],
                           &triangles[3 * size_t(t)] + 3);
    return made;
  }

  // A sphere around a cluster in all shapes.
  Sphere cluster_sphere(size_t c) const {
    const uint32_t* const begin = all_.ranges.corners(c);
    const uint32_t* const end = all_.ranges.corners(c + 1);
    Vec3d low = vec3d_at(surface_.points, *begin), high = low;
    for (const float* shape : surface_.shapes)
      for (const uint32_t* v = begin; v != end; v++) {
        low = minimum(low, vec3d_at(shape, *v));
        high = maximum(high, vec3d_at(shape, *v));
      }
    const Vec3d centre = (low + high) / 2;
    return {centre, length(high - centre)};
  }

  size_t frontier_triangles() const {
    size_t count = 0;
    for (uint32_t c : frontier_) count += all_.ranges.size(c);
    return count;
  }

  // --- a level ---

  // Groups the frontier.
  void form_groups() {
    level_ = next_level_++;
    ClusterSet pending;
    for (uint32_t c : frontier_) pending.append(all_, c);
    groups_ = group_clusters(pending, options_.group_size, pilot_, simplifier_,
                             options_.generation.threads);
    for (Numbers& group : groups_)
      for (uint32_t& c : group) c = frontier_[c];
  }

  // Lists the triangles of the groups, without degenerate ones. Joins groups that have only those.
  void list_triangles() {
    Numbers counts;
    for (const Numbers& group : groups_) {
      const auto count = [&](uint32_t sum, uint32_t c) { return sum + uint32_t(ids_of(c).size()); };
      counts.push_back(std::accumulate(group.begin(), group.end(), 0u, count));
    }
    groups_ = join_empty(groups_, counts);
    triangle_ids_.clear();
    old_begin_.assign(1, 0);
    for (const Numbers& group : groups_) {
      for (uint32_t c : group) {
        const Numbers ids = ids_of(c);
        triangle_ids_.insert(triangle_ids_.end(), ids.begin(), ids.end());
      }
      old_begin_.push_back(uint32_t(triangle_ids_.size()));
    }
  }

  // The numbers of a cluster's triangles, without degenerate ones.
  Numbers ids_of(uint32_t c) const {
    Numbers ids;
    for (uint32_t t = all_.ranges.first_triangle(c); t < all_.ranges.first_triangle(c + 1); t++)
      if (!surface_.is_degenerate(&all_.ranges.triangles[3 * size_t(t)])) ids.push_back(t);
    return ids;
  }

  GroupTriangles old_groups() const { return {old_->data(), old_begin_}; }

  // Simplifies the groups.
  ReducedGroups reduce() {
    const int threads = options_.generation.threads;
    const auto old = std::make_shared<Triangles>();
    old->reserve(3 * triangle_ids_.size());
    for (uint32_t t : triangle_ids_)
      for (size_t k = 0; k < 3; k++)
        old->push_back(surface_.canonical_vertices[all_.ranges.triangles[3 * size_t(t) + k]]);
    old_ = old;
    if (!meter_)
      meter_ = std::make_unique<ErrorMeter>(surface_.shapes, surface_.vertex_count, old_,
                                            old_begin_, triangle_ids_, threads);
    meter_->begin_level(old_, old_begin_, triangle_ids_);
    const double step = options_.reduction * kSteps[std::min<size_t>(level_, 2)];
    ReducedGroups reduced = reduce_groups(surface_, old_groups(), step, *meter_,
                                          step * level_error_, simplifier_, threads);
    level_error_ = reduced.level_error;
    return reduced;
  }

  // Returns errors that are never below those of finer groups.
  std::vector<double> stated_errors(std::vector<double> error) const {
    for (size_t g = 0; g < groups_.size(); g++) {
      double base = 0, below = 0;
      for (uint32_t c : groups_[g]) {
        base = std::max(base, all_.clusters[c].base_error);
        below = std::max(below, all_.clusters[c].error);
      }
      error[g] = std::max(error[g] + base, below);
    }
    return error;
  }

  // Clusters of level 0 cannot wait: others would share their pages. They replace themselves.
  void unstick(const Pieces& next, std::vector<double>& error, std::vector<bool>& is_stuck) {
    Numbers stuck;
    for (uint32_t g = 0; g < groups_.size(); g++) {
      if (!is_stuck[g]) continue;
      stuck.push_back(g);
      error[g] = 0;
      is_stuck[g] = false;
    }
    if (!stuck.empty()) meter_->measure(next, stuck);
  }

  size_t end_level() {
    for (const Numbers& group : groups_) add_group(group, kInfinite);
    built_.stuck_triangles.push_back(0);
    frontier_.clear();
    return 0;
  }

  // --- the next level ---

  // Replaces the groups that are not stuck by clusters of their pieces.
  void replace(Pieces next, const std::vector<double>& error, const std::vector<bool>& is_stuck) {
    Pieces pieces;
    Numbers groups;
    std::vector<double> triangle_errors;
    Numbers first_new_triangle(groups_.size());
    for (uint32_t g = 0; g < groups_.size(); g++) {
      if (is_stuck[g]) continue;
      first_new_triangle[g] = uint32_t(triangle_errors.size());
      triangle_errors.insert(triangle_errors.end(), next[g].size() / 3, error[g]);
      pieces.push_back(std::move(next[g]));
      groups.push_back(g);
    }
    Triangles triangles;
    const Numbers begin = joined(pieces, triangles);
    if (surface_.choices)
      choose_vertices(
          *surface_.choices, surface_.points, triangle_errors,
          [&](const std::vector<Vec3>& points) { return meter_->nearest(points); },
          options_.generation.threads, triangles);
    const size_t first_triangle = all_.ranges.triangle_count(), first = all_.ranges.count();
    Numbers order;
    const GroupMeshlets made = make_clusters(triangles, begin, order);
    for (size_t i = 0; i < groups.size(); i++) {
      double base = 0;
      for (uint32_t c : groups_[groups[i]]) base = std::max(base, all_.clusters[c].base_error);
      const uint32_t number = add_group(groups_[groups[i]], error[groups[i]]);
      const Cluster replacement{int32_t(options_.first_group + number), error[groups[i]], base,
                                built_.groups[number].sphere};
      all_.clusters.resize(first + made.group_begin[i + 1], replacement);
    }
    move_frontier(first);
    Numbers new_triangle_ids(order.size());
    for (size_t i = 0; i < order.size(); i++)
      new_triangle_ids[order[i]] = uint32_t(first_triangle + i);
    std::vector<bool> is_replaced(is_stuck);
    is_replaced.flip();
    meter_->replace(is_replaced, first_new_triangle, new_triangle_ids);
  }

  // The frontier loses clusters with a group, and gets all from `first` on.
  void move_frontier(size_t first) {
    cluster_group_.resize(all_.clusters.size(), kNoGroup);
    const auto has_group = [&](uint32_t c) { return cluster_group_[c] != kNoGroup; };
    frontier_.erase(std::remove_if(frontier_.begin(), frontier_.end(), has_group), frontier_.end());
    for (size_t c = first; c < all_.clusters.size(); c++) frontier_.push_back(uint32_t(c));
  }

  uint32_t add_group(const Numbers& group, double error) {
    const auto number = uint32_t(built_.groups.size());
    std::vector<Sphere> spheres;
    for (uint32_t c : group) {
      spheres.push_back(all_.clusters[c].sphere);
      cluster_group_[c] = int32_t(number);
    }
    built_.groups.push_back({level_, error, enclosing_sphere(spheres)});
    return number;
  }

  const Surface& surface_;
  const PagePilot& pilot_;
  const Simplifier& simplifier_;
  LevelOptions options_;
  uint32_t level_ = 0, next_level_;
  double level_error_;  // of the level before
  ClusterSet all_;      // of all levels so far
  std::vector<int32_t> cluster_group_;
  Numbers frontier_;  // clusters without a group
  std::unique_ptr<ErrorMeter> meter_;
  Levels built_;
  // Of level_: its groups, the numbers of their triangles, the first one of each group, and the
  // triangles, with canonical vertices.
  Groups groups_;
  Numbers triangle_ids_, old_begin_;
  std::shared_ptr<const Triangles> old_;
};

}  // namespace

Levels build_levels(const Surface& surface, ClusterSet given, const PagePilot& pilot,
                    const Simplifier& simplifier, const LevelOptions& options) {
  Builder builder(surface, std::move(given), pilot, simplifier, options);
  if (options.must_end) {
    builder.end();
    return builder.take();
  }
  while (const size_t remaining = builder.add_level()) {
    if (!options.builds_all) break;
    if (options.generation.progress)
      options.generation.progress(
          float(1 - double(remaining) / double(std::max<size_t>(surface.triangle_count, 1))));
  }
  return builder.take();
}

}  // namespace gltf_meshlet_codec

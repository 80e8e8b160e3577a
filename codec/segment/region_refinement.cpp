#include "segment/region_refinement.h"

#include <algorithm>

namespace gltf_meshlet_codec {
namespace {

constexpr int32_t kNone = -1;

// Most triangles around a vertex that a move may look at.
constexpr int kMaxFan = 64;

// Most regions in a search for room.
constexpr size_t kMaxSearched = 200;

// Score of a border edge that disappears. The rest of a move's score, in [-1, 1], is how much
// nearer the triangle is to its new region's centre.
constexpr float kEdgeScore = 2.0f;

// Least gain of a move, unless it makes room.
constexpr float kLeastGain = 0.4f;

class Refiner {
 public:
  Refiner(Patch& patch, const RefinementOptions& options);

  void run() {
    sweep(2 * options_.max_size);
    balance();
    for (int i = 0; i < options_.sweeps; i++)
      if (!sweep(options_.max_size)) break;
  }

 private:
  // A triangle and the region it would move to.
  struct Move {
    int32_t triangle = kNone;
    int32_t to = kNone;
    float score = -1e30f;
  };

  int32_t neighbour(int32_t triangle, int k) const { return patch_.neighbours[3 * triangle + k]; }
  int32_t region_across(int32_t triangle, int k) const {
    const int32_t other = neighbour(triangle, k);
    return other < 0 ? kNone : patch_.region[other / 3];
  }
  int shared_edges(int32_t triangle, int32_t region) const;
  bool fan_is_inside(int32_t triangle, int corner, int32_t region) const;
  bool fan_touches(int32_t triangle, int corner, int32_t region) const;
  bool keeps_disks(int32_t triangle, int32_t from, int32_t to) const;
  float score(int32_t triangle, int32_t from, int32_t to) const;
  void move(int32_t triangle, int32_t to);
  void link(int32_t triangle, int32_t region);
  void unlink(int32_t triangle, int32_t region);

  bool sweep(int max_size);
  void balance();
  void relieve(int32_t region);
  Move best_move(int32_t from, int32_t to) const;
  bool pass_on(int32_t region);
  int32_t find_room(int32_t region);
  Vec3 centre(int32_t region) const { return sums_[region] * (1.0f / float(sizes_[region])); }

  Patch& patch_;
  const RefinementOptions options_;
  std::vector<int32_t> sizes_;
  std::vector<int32_t> first_, next_, previous_;  // linked lists of the regions' triangles
  std::vector<Vec3> sums_;                        // per region: sum of its triangles' centres
  std::vector<int32_t> parent_, seen_, queue_;    // of the search for room
  std::vector<std::pair<int32_t, int32_t>> blocked_;
  int32_t search_ = 0;
};

Refiner::Refiner(Patch& patch, const RefinementOptions& options)
    : patch_(patch),
      options_(options),
      sizes_(patch.region_count, 0),
      first_(patch.region_count, kNone),
      next_(patch.size()),
      previous_(patch.size()),
      sums_(patch.region_count, Vec3{0, 0, 0}),
      parent_(patch.region_count),
      seen_(patch.region_count, 0) {
  for (size_t t = 0; t < patch.size(); t++) link(int32_t(t), patch.region[t]);
}

void Refiner::link(int32_t triangle, int32_t region) {
  next_[triangle] = first_[region];
  previous_[triangle] = kNone;
  if (first_[region] != kNone) previous_[first_[region]] = triangle;
  first_[region] = triangle;
  ++sizes_[region];
  sums_[region] = sums_[region] + patch_.facets[triangle].centre;
}

void Refiner::unlink(int32_t triangle, int32_t region) {
  if (previous_[triangle] != kNone)
    next_[previous_[triangle]] = next_[triangle];
  else
    first_[region] = next_[triangle];
  if (next_[triangle] != kNone) previous_[next_[triangle]] = previous_[triangle];
  --sizes_[region];
  sums_[region] = sums_[region] - patch_.facets[triangle].centre;
}

void Refiner::move(int32_t triangle, int32_t to) {
  unlink(triangle, patch_.region[triangle]);
  link(triangle, to);
  patch_.region[triangle] = to;
}

int Refiner::shared_edges(int32_t triangle, int32_t region) const {
  int shared = 0;
  for (int k = 0; k < 3; k++) shared += region_across(triangle, k) == region;
  return shared;
}

// Do all triangles around this corner form a closed fan inside the region?
bool Refiner::fan_is_inside(int32_t triangle, int corner, int32_t region) const {
  int32_t half_edge = 3 * triangle + corner;
  for (int step = 0; step < kMaxFan; step++) {
    const int32_t other = patch_.neighbours[half_edge];
    if (other < 0) return false;
    if (other / 3 == triangle) return true;
    if (patch_.region[other / 3] != region) return false;
    half_edge = other / 3 * 3 + (other + 1) % 3;
  }
  return false;
}

// Does any other triangle around this corner belong to the region?
bool Refiner::fan_touches(int32_t triangle, int corner, int32_t region) const {
  // Turns around the corner one way and, unless the fan closes, the other way.
  for (int way = 0; way < 2; way++) {
    int32_t half_edge = 3 * triangle + (way == 0 ? corner : (corner + 2) % 3);
    for (int step = 0;; step++) {
      if (step == kMaxFan) return true;
      const int32_t other = patch_.neighbours[half_edge];
      if (other < 0) break;
      if (other / 3 == triangle) return false;
      if (patch_.region[other / 3] == region) return true;
      half_edge = other / 3 * 3 + (other + (way == 0 ? 1 : 2)) % 3;
    }
  }
  return false;
}

// Do regions that are disks stay disks if the triangle moves from one to the other?
bool Refiner::keeps_disks(int32_t triangle, int32_t from, int32_t to) const {
  const int left = shared_edges(triangle, from), joined = shared_edges(triangle, to);
  if (left == 3 || joined == 0) return false;
  if (left == 2) {
    for (int k = 0; k < 3; k++)
      if (region_across(triangle, k) != from) return fan_is_inside(triangle, (k + 2) % 3, from);
  }
  if (joined == 1) {
    for (int k = 0; k < 3; k++)
      if (region_across(triangle, k) == to) return !fan_touches(triangle, (k + 2) % 3, to);
  }
  return true;
}

float Refiner::score(int32_t triangle, int32_t from, int32_t to) const {
  const float before = length(patch_.facets[triangle].centre - centre(from));
  const float after = length(patch_.facets[triangle].centre - centre(to));
  const float sum = before + after;
  return kEdgeScore * float(shared_edges(triangle, to) - shared_edges(triangle, from)) +
         (sum > 0 ? (before - after) / sum : 0);
}

// Moves triangles if that shortens borders or rounds regions. Returns whether any moved.
bool Refiner::sweep(int max_size) {
  bool moved = false;
  for (int32_t t = 0; t < int32_t(patch_.size()); t++) {
    const int32_t from = patch_.region[t];
    const int32_t beside[3] = {region_across(t, 0), region_across(t, 1), region_across(t, 2)};
    // Inside, or with two edges: no other region can have as many.
    if ((beside[0] == from) + (beside[1] == from) + (beside[2] == from) > 1) continue;
    Move best;
    best.score = kLeastGain;
    for (const int32_t to : beside) {
      if (to == kNone || to == from || sizes_[to] >= max_size || sizes_[from] == 1) continue;
      const float value = score(t, from, to);
      if (value > best.score && keeps_disks(t, from, to)) best = {t, to, value};
    }
    if (best.triangle == kNone) continue;
    move(t, best.to);
    moved = true;
  }
  return moved;
}

// Brings regions within the limit, fullest first.
void Refiner::balance() {
  std::vector<int32_t> full;
  for (int32_t r = 0; r < patch_.region_count; r++)
    if (sizes_[r] > options_.max_size) full.push_back(r);
  std::sort(full.begin(), full.end(), [&](int32_t a, int32_t b) {
    return sizes_[a] != sizes_[b] ? sizes_[a] > sizes_[b] : a < b;
  });
  for (const int32_t region : full) relieve(region);
}

void Refiner::relieve(int32_t region) {
  blocked_.clear();
  for (int failures = 0; sizes_[region] > options_.max_size && failures < options_.max_failures;)
    if (!pass_on(region)) ++failures;
}

Refiner::Move Refiner::best_move(int32_t from, int32_t to) const {
  Move best;
  if (sizes_[from] == 1) return best;
  for (int32_t t = first_[from]; t != kNone; t = next_[t]) {
    if (shared_edges(t, to) == 0) continue;
    const float value = score(t, from, to);
    if (value > best.score && keeps_disks(t, from, to)) best = {t, to, value};
  }
  return best;
}

// Passes one triangle each from region to region along the shortest path to one with room.
bool Refiner::pass_on(int32_t region) {
  int32_t to = find_room(region);
  if (to == kNone) return false;
  while (to != region) {
    const int32_t from = parent_[to];
    const Move best = best_move(from, to);
    if (best.triangle == kNone) {
      blocked_.emplace_back(from, to);
      return false;
    }
    move(best.triangle, to);
    to = from;
  }
  return true;
}

// Breadth-first search over neighbouring regions; leaves the path in parent_.
int32_t Refiner::find_room(int32_t region) {
  search_++;
  seen_[region] = search_;
  queue_.assign(1, region);
  for (size_t head = 0; head < queue_.size() && head < kMaxSearched; head++) {
    const int32_t from = queue_[head];
    int32_t room = kNone;
    for (int32_t t = first_[from]; t != kNone; t = next_[t]) {
      for (int k = 0; k < 3; k++) {
        const int32_t to = region_across(t, k);
        if (to == kNone || seen_[to] == search_) continue;
        if (std::find(blocked_.begin(), blocked_.end(), std::make_pair(from, to)) != blocked_.end())
          continue;
        seen_[to] = search_;
        parent_[to] = from;
        queue_.push_back(to);
        if (sizes_[to] < options_.max_size && (room == kNone || sizes_[to] < sizes_[room]))
          room = to;
      }
    }
    if (room != kNone) return room;
  }
  return kNone;
}

}  // namespace

void refine_regions(Patch& patch, const RefinementOptions& options) {
  Refiner(patch, options).run();
}

}  // namespace gltf_meshlet_codec

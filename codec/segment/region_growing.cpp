#include "segment/region_growing.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

namespace gltf_meshlet_codec {
namespace {

// Centres move this many times as far as the means of their regions: fewer rounds until they rest.
constexpr float kOvershoot = 1.7f;

// C_m of equation (2): added to the relative size of a full region.
constexpr float kFullPenalty = 8.0f;

// A triangle that a region may attach. Its fields lie together, so that it costs one access to
// memory.
struct Candidate {
  int32_t triangle, region;
  float shape_weight;
  int32_t next;  // in its bucket, or of the free places
};

// Candidates by weight, in buckets of an eighth of an octave: O(1) per operation. Entries lighter
// than the current bucket go into that bucket.
class BucketQueue {
 public:
  explicit BucketQueue(size_t capacity)
      : candidates_(new Candidate[capacity]), heads_(kBucketCount, kNone) {}

  static int bucket_of(float weight) {
    uint32_t bits;
    std::memcpy(&bits, &weight, sizeof bits);
    const int bucket = int(bits >> 20) - kLightest;
    return std::min(std::max(bucket, 0), kBucketCount - 1);
  }
  void add(int32_t triangle, int32_t region, float shape_weight, int bucket) {
    int32_t item = free_;
    if (item == kNone)
      item = used_++;
    else
      free_ = candidates_[item].next;
    bucket = std::max(bucket, current_);
    candidates_[item] = {triangle, region, shape_weight, heads_[bucket]};
    heads_[bucket] = item;
  }
  // Removes a candidate of the lightest bucket that has any. Returns false if there is none.
  bool pop(Candidate& candidate) {
    while (heads_[current_] == kNone)
      if (++current_ == kBucketCount) return current_ = 0, false;
    const int32_t item = heads_[current_];
    candidate = candidates_[item];
    heads_[current_] = candidate.next;
    if (candidate.next != kNone) __builtin_prefetch(&candidates_[candidate.next]);
    candidates_[item].next = free_;
    free_ = item;
    return true;
  }
  int current() const { return current_; }

 private:
  static constexpr int32_t kNone = -1;
  static constexpr int kOctaves = 64, kPerOctave = 8, kBucketCount = kOctaves * kPerOctave;
  static constexpr int kLightest =
      (127 - 50) * kPerOctave;  // weights below 2^-50 share the first bucket
  std::unique_ptr<Candidate[]> candidates_;
  std::vector<int32_t> heads_;
  int32_t used_ = 0;
  int32_t free_ = kNone;  // places to use again: those used last are in the cache
  int current_ = 0;
};

class RegionGrower {
 public:
  RegionGrower(Patch& patch, const GrowthOptions& options)
      : patch_(patch), options_(options), queue_(3 * patch.size()) {}

  int run() { return options_.cycles > 0 ? grow_and_shift() : grow(); }

 private:
  int grow();
  int grow_and_shift();
  void place_centres();
  void place_ranges();
  void add_region(int32_t seed);
  void attach_triangles();
  void mend_regions();
  void keep_connected(int32_t region, const std::vector<int32_t>& former);
  void empty_queue();
  void attach(int32_t triangle, int32_t region);
  void add_candidate(int32_t triangle, int32_t region);
  void sum_regions();
  void move_centres(float reach);
  bool choose_seeds();
  void sweep();
  int32_t lightest_region(int32_t triangle) const;
  void shift(int32_t triangle, int32_t to);
  float shape_weight(int32_t triangle, int32_t region) const;
  float fill(int32_t size) const;
  float sweep_fill(int32_t size) const;

  Patch& patch_;
  const GrowthOptions options_;
  BucketQueue queue_;
  std::vector<int32_t> seeds_;  // triangle at the centre of each region
  std::vector<Facet> means_;    // centre and mean normal of each region
  std::vector<Facet> sums_;     // over the triangles of each region
  std::vector<int32_t> sizes_;
  std::vector<int32_t> stack_;  // of triangles
};

// Labels the connected components of the patch; returns their sizes.
std::vector<int32_t> label_connected(const Patch& patch, std::vector<int32_t>& component) {
  std::vector<int32_t> sizes, stack;
  component.assign(patch.size(), -1);
  for (size_t start = 0; start < patch.size(); start++) {
    if (component[start] >= 0) continue;
    const int32_t label = int32_t(sizes.size());
    component[start] = label;
    stack.assign(1, int32_t(start));
    sizes.push_back(0);
    while (!stack.empty()) {
      const int32_t triangle = stack.back();
      stack.pop_back();
      ++sizes[label];
      for (int k = 0; k < 3; k++) {
        const int32_t across = patch.neighbours[3 * triangle + k];
        if (across < 0 || component[across / 3] >= 0) continue;
        component[across / 3] = label;
        stack.push_back(across / 3);
      }
    }
  }
  return sizes;
}

// Number of regions of a connected component.
int64_t centre_count(int64_t size, float mean_size) {
  return std::min(size, int64_t(std::ceil(float(size) / mean_size)));
}

int RegionGrower::grow() {
  place_centres();
  int round = 0;
  do {
    attach_triangles();
    sum_regions();
    move_centres(kOvershoot);
    round++;
  } while (choose_seeds() && round < options_.rounds);
  return round;
}

// Sweeps find nearly the same centres as rounds of growth, but regions may fall apart. Growing once
// more from these centres makes whole ones.
int RegionGrower::grow_and_shift() {
  place_ranges();
  for (int cycle = 0; cycle < options_.cycles; cycle++) {
    sum_regions();
    for (int i = 0; i < options_.sweeps; i++) {
      move_centres(cycle == 0 && i == 0 ? 1.0f : kOvershoot);
      sweep();
    }
    move_centres(kOvershoot);
    choose_seeds();
    options_.mends ? mend_regions() : attach_triangles();
  }
  return options_.cycles * (options_.sweeps + 1);
}

void RegionGrower::add_region(int32_t seed) {
  seeds_.push_back(seed);
  means_.push_back(patch_.facets[seed]);
  patch_.region_count = int32_t(seeds_.size());
}

// Initial centres, evenly over each connected component: triangles are numbered along a
// space-filling curve, and every n-th becomes a centre.
void RegionGrower::place_centres() {
  std::vector<int32_t> component;
  const std::vector<int32_t> sizes = label_connected(patch_, component);
  std::vector<int64_t> seen(sizes.size(), 0);
  for (size_t t = 0; t < patch_.size(); t++) {
    const int64_t size = sizes[component[t]], rank = seen[component[t]]++;
    const int64_t centres = centre_count(size, options_.mean_size);
    if ((rank * centres + size / 2) % size < centres) add_region(int32_t(t));
  }
}

// Cuts each connected component into ranges along the curve.
void RegionGrower::place_ranges() {
  std::vector<int32_t> component;
  const std::vector<int32_t> sizes = label_connected(patch_, component);
  std::vector<int64_t> ranges, first_region, seen(sizes.size(), 0);
  int64_t regions = 0;
  for (const int32_t size : sizes) {
    ranges.push_back(centre_count(size, options_.mean_size));
    first_region.push_back(regions);
    regions += ranges.back();
  }
  patch_.region.resize(patch_.size());
  std::vector<int32_t> first(size_t(regions), -1);  // triangle of each region
  for (size_t t = 0; t < patch_.size(); t++) {
    const int32_t c = component[t];
    const int64_t region = first_region[c] + seen[c]++ * ranges[c] / sizes[c];
    patch_.region[t] = int32_t(region);
    if (first[region] < 0) first[region] = int32_t(t);
  }
  for (const int32_t triangle : first) add_region(triangle);
}

// The factors of equation (1) that do not change while a region grows: distance and planarity.
inline float RegionGrower::shape_weight(int32_t triangle, int32_t region) const {
  const Facet& facet = patch_.facets[triangle];
  const Facet& mean = means_[region];
  return length(facet.centre - mean.centre) *
         std::max(0.0f, options_.lambda - dot(facet.normal, mean.normal));
}

// The factor of equation (1) for a region's size.
inline float RegionGrower::fill(int32_t size) const {
  float fill = float(size) * (1.0f / options_.mean_size);
  if (options_.weight == Weight::kPaper && size >= options_.max_size) fill += kFullPenalty;
  return fill;
}

// Without the penalty for full regions, which would push triangles to and fro in sweeps. Squared
// where no growth follows, which would even sizes out: saves 0.5 % of kFast's bytes.
inline float RegionGrower::sweep_fill(int32_t size) const {
  const float fill = float(size) * (1.0f / options_.mean_size);
  return options_.mends ? fill * fill : fill;
}

void RegionGrower::attach(int32_t triangle, int32_t region) {
  patch_.region[triangle] = region;
  ++sizes_[region];
  for (int k = 0; k < 3; k++) {
    const int32_t across = patch_.neighbours[3 * triangle + k];
    if (across < 0 || patch_.region[across / 3] >= 0) continue;
    add_candidate(across / 3, region);
  }
}

inline void RegionGrower::add_candidate(int32_t triangle, int32_t region) {
  const float shape = shape_weight(triangle, region);
  queue_.add(triangle, region, shape, BucketQueue::bucket_of(fill(sizes_[region]) * shape));
}

void RegionGrower::attach_triangles() {
  patch_.region.assign(patch_.size(), -1);
  sizes_.assign(seeds_.size(), 0);
  // Centres stay in their own regions even if another region has less weight.
  for (size_t r = 0; r < seeds_.size(); r++) patch_.region[seeds_[r]] = int32_t(r);
  for (size_t r = 0; r < seeds_.size(); r++) attach(seeds_[r], int32_t(r));
  empty_queue();
}

// Regions keep the triangles that are connected to their seeds, and grow over the others.
void RegionGrower::mend_regions() {
  std::vector<int32_t> former(patch_.size(), -1);
  former.swap(patch_.region);
  sizes_.assign(seeds_.size(), 0);
  for (size_t r = 0; r < seeds_.size(); r++) keep_connected(int32_t(r), former);
  for (int32_t t = 0; t < int32_t(patch_.size()); t++) {
    if (patch_.region[t] >= 0) continue;
    for (int k = 0; k < 3; k++) {
      const int32_t across = patch_.neighbours[3 * t + k];
      if (across >= 0 && patch_.region[across / 3] >= 0)
        add_candidate(t, patch_.region[across / 3]);
    }
  }
  empty_queue();
}

// Attaches the region's former triangles that are connected to its seed.
void RegionGrower::keep_connected(int32_t region, const std::vector<int32_t>& former) {
  patch_.region[seeds_[region]] = region;
  stack_.assign(1, seeds_[region]);
  while (!stack_.empty()) {
    const int32_t triangle = stack_.back();
    stack_.pop_back();
    ++sizes_[region];
    for (int k = 0; k < 3; k++) {
      const int32_t across = patch_.neighbours[3 * triangle + k];
      if (across < 0 || former[across / 3] != region || patch_.region[across / 3] >= 0) continue;
      patch_.region[across / 3] = region;
      stack_.push_back(across / 3);
    }
  }
}

// Attaches candidates, lightest first, and the candidates that follow from them.
void RegionGrower::empty_queue() {
  for (Candidate candidate; queue_.pop(candidate);) {
    if (patch_.region[candidate.triangle] >= 0) continue;
    // The region may have grown since this entry was weighed.
    const int bucket =
        BucketQueue::bucket_of(fill(sizes_[candidate.region]) * candidate.shape_weight);
    if (bucket > queue_.current())
      queue_.add(candidate.triangle, candidate.region, candidate.shape_weight, bucket);
    else
      attach(candidate.triangle, candidate.region);
  }
}

void RegionGrower::sum_regions() {
  sums_.assign(seeds_.size(), Facet{{0, 0, 0}, {0, 0, 0}});
  sizes_.assign(seeds_.size(), 0);
  for (size_t t = 0; t < patch_.size(); t++) {
    Facet& sum = sums_[patch_.region[t]];
    sum.centre = sum.centre + patch_.facets[t].centre;
    sum.normal = sum.normal + patch_.facets[t].normal;
    ++sizes_[patch_.region[t]];
  }
}

// Moves each region's centre towards the mean of its triangles.
void RegionGrower::move_centres(float reach) {
  for (size_t r = 0; r < seeds_.size(); r++) {
    const Vec3 mean = sums_[r].centre * (1.0f / float(sizes_[r]));
    means_[r].centre = means_[r].centre + (mean - means_[r].centre) * reach;
    means_[r].normal = normalized(sums_[r].normal);
  }
}

// Moves each region's seed to the triangle nearest to its centre. Returns whether any changed.
bool RegionGrower::choose_seeds() {
  std::vector<float> nearest(seeds_.size(), 1e30f);
  std::vector<int32_t> seeds(seeds_.size());
  for (size_t t = 0; t < patch_.size(); t++) {
    const int32_t region = patch_.region[t];
    const Vec3 offset = patch_.facets[t].centre - means_[region].centre;
    const float distance = dot(offset, offset);
    if (distance < nearest[region]) nearest[region] = distance, seeds[region] = int32_t(t);
  }
  seeds.swap(seeds_);
  return seeds != seeds_;
}

// Gives triangles at borders to the region of least weight. That changes about as much as a round
// of growth and needs no queue, but a region may fall apart.
void RegionGrower::sweep() {
  for (int32_t t = 0; t < int32_t(patch_.size()); t++) {
    const int32_t to = lightest_region(t);
    if (to != patch_.region[t] && sizes_[patch_.region[t]] > 1) shift(t, to);
  }
}

// Returns the region of least weight among the triangle's own and those around it.
inline int32_t RegionGrower::lightest_region(int32_t triangle) const {
  const int32_t own = patch_.region[triangle];
  int32_t best = own;
  float least = -1;
  for (int k = 0; k < 3; k++) {
    const int32_t across = patch_.neighbours[3 * triangle + k];
    if (across < 0) continue;
    const int32_t other = patch_.region[across / 3];
    if (other == own || other == best) continue;
    if (least < 0) least = sweep_fill(sizes_[own]) * shape_weight(triangle, own);
    const float weight = sweep_fill(sizes_[other] + 1) * shape_weight(triangle, other);
    if (weight < least) least = weight, best = other;
  }
  return best;
}

void RegionGrower::shift(int32_t triangle, int32_t to) {
  const Facet& facet = patch_.facets[triangle];
  const int32_t from = patch_.region[triangle];
  sums_[from] = {sums_[from].centre - facet.centre, sums_[from].normal - facet.normal};
  sums_[to] = {sums_[to].centre + facet.centre, sums_[to].normal + facet.normal};
  --sizes_[from];
  ++sizes_[to];
  patch_.region[triangle] = to;
}

}  // namespace

int grow_regions(Patch& patch, const GrowthOptions& options) {
  return RegionGrower(patch, options).run();
}

}  // namespace gltf_meshlet_codec

#include "segment/region_growing.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

namespace meshlet {
namespace {

// Centres move this many times as far as the means of their regions: fewer rounds until they rest.
constexpr float kOvershoot = 1.7f;

// C_m of equation (2): added to the relative size of a full region.
constexpr float kFullPenalty = 8.0f;

// Sweeps that shift borders between two rounds of growth, and how often kNormal does all that. More
// sweeps or cycles made files less than 0.1 % smaller.
constexpr int kSweeps = 4;
constexpr int kCycles = 2;

// A triangle that a region may attach. All that is known of it lies together, so that it costs one
// access to memory.
struct Candidate {
  int32_t triangle, region;
  float shape_weight;
  int32_t next;  // in its bucket
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
  // The queue must be empty.
  void clear() { used_ = 0; }
  void add(int32_t triangle, int32_t region, float shape_weight, int bucket) {
    candidates_[used_] = {triangle, region, shape_weight, kNone};
    push(used_++, bucket);
  }
  void push(int32_t item, int bucket) {
    bucket = std::max(bucket, current_);
    candidates_[item].next = heads_[bucket];
    heads_[bucket] = item;
  }
  // Removes an item of the lightest bucket that has any, or returns kNone.
  int32_t pop() {
    while (heads_[current_] == kNone)
      if (++current_ == kBucketCount) return current_ = 0, kNone;
    const int32_t item = heads_[current_];
    heads_[current_] = candidates_[item].next;
    return item;
  }
  int current() const { return current_; }
  const Candidate& operator[](int32_t item) const { return candidates_[item]; }

  static constexpr int32_t kNone = -1;

 private:
  static constexpr int kOctaves = 64, kPerOctave = 8, kBucketCount = kOctaves * kPerOctave;
  static constexpr int kLightest =
      (127 - 50) * kPerOctave;  // weights below 2^-50 share the first bucket
  std::unique_ptr<Candidate[]> candidates_;
  std::vector<int32_t> heads_;
  int32_t used_ = 0;
  int current_ = 0;
};

class RegionGrower {
 public:
  RegionGrower(Patch& patch, const GrowthOptions& options)
      : patch_(patch),
        options_(options),
        queue_(options.effort == Effort::kFast ? 0 : 3 * patch.size()) {}

  int run() {
    if (options_.effort == Effort::kFast) return shift_runs();
    place_centres();
    return options_.effort == Effort::kNormal ? grow_and_shift() : grow();
  }

 private:
  int grow();
  int grow_and_shift();
  int shift_runs();
  void place_centres();
  void place_runs();
  void add_region(int32_t seed);
  void attach_triangles();
  void attach(int32_t triangle, int32_t region);
  void sum_regions();
  void move_centres(float reach);
  bool choose_seeds();
  void sweep();
  int32_t lightest_region(int32_t triangle) const;
  void shift(int32_t triangle, int32_t to);
  float shape_weight(int32_t triangle, int32_t region) const;
  float fill(int32_t size) const;

  Patch& patch_;
  const GrowthOptions options_;
  BucketQueue queue_;
  std::vector<int32_t> seeds_;  // triangle at the centre of each region
  std::vector<Facet> means_;    // centre and mean normal of each region
  std::vector<Facet> sums_;     // over the triangles of each region
  std::vector<int32_t> sizes_;
};

// Labels the edge-connected parts of the patch; returns their sizes.
std::vector<int32_t> label_connected(const Patch& patch, std::vector<int32_t>& part) {
  std::vector<int32_t> sizes, stack;
  part.assign(patch.size(), -1);
  for (size_t start = 0; start < patch.size(); start++) {
    if (part[start] >= 0) continue;
    const int32_t label = int32_t(sizes.size());
    part[start] = label;
    stack.assign(1, int32_t(start));
    sizes.push_back(0);
    while (!stack.empty()) {
      const int32_t triangle = stack.back();
      stack.pop_back();
      ++sizes[label];
      for (int k = 0; k < 3; k++) {
        const int32_t across = patch.neighbours[3 * triangle + k];
        if (across < 0 || part[across / 3] >= 0) continue;
        part[across / 3] = label;
        stack.push_back(across / 3);
      }
    }
  }
  return sizes;
}

// Number of regions of a connected part.
int64_t centre_count(int64_t size, float mean_size) {
  return std::min(size, int64_t(std::ceil(float(size) / mean_size)));
}

int RegionGrower::grow() {
  int round = 0;
  do {
    attach_triangles();
    sum_regions();
    move_centres(kOvershoot);
    round++;
  } while (choose_seeds() && round < options_.iterations);
  return round;
}

// Sweeps find nearly the same centres as rounds of growth. Growing once more from these mends
// regions that fell apart.
int RegionGrower::grow_and_shift() {
  for (int cycle = 0; cycle < kCycles; cycle++) {
    attach_triangles();
    sum_regions();
    for (int i = 0; i < kSweeps; i++) {
      move_centres(kOvershoot);
      sweep();
    }
    move_centres(kOvershoot);
    choose_seeds();
  }
  attach_triangles();
  return kCycles * (kSweeps + 1);
}

int RegionGrower::shift_runs() {
  place_runs();
  sum_regions();
  for (int i = 0; i < kSweeps; i++) {
    move_centres(i == 0 ? 1.0f : kOvershoot);
    sweep();
  }
  return kSweeps;
}

void RegionGrower::add_region(int32_t seed) {
  seeds_.push_back(seed);
  means_.push_back(patch_.facets[seed]);
  patch_.region_count = int32_t(seeds_.size());
}

// Initial centres, evenly over each connected part: triangles are numbered along a space-filling
// curve, and every n-th becomes a centre.
void RegionGrower::place_centres() {
  std::vector<int32_t> part;
  const std::vector<int32_t> sizes = label_connected(patch_, part);
  std::vector<int64_t> seen(sizes.size(), 0);
  for (size_t t = 0; t < patch_.size(); t++) {
    const int64_t size = sizes[part[t]], rank = seen[part[t]]++;
    const int64_t centres = centre_count(size, options_.mean_size);
    if ((rank * centres + size / 2) % size < centres) add_region(int32_t(t));
  }
}

// Cuts each connected part of the mesh into runs along the curve.
void RegionGrower::place_runs() {
  patch_.region.resize(patch_.size());
  for (size_t begin = 0, end; begin < patch_.size(); begin = end) {
    for (end = begin + 1; end < patch_.size() && patch_.part[end] == patch_.part[begin];) end++;
    const int64_t size = int64_t(end - begin), runs = centre_count(size, options_.mean_size);
    for (int64_t run = 0; run < runs; run++) {
      const size_t first = begin + size_t(run * size / runs);
      std::fill(patch_.region.begin() + std::ptrdiff_t(first),
                patch_.region.begin() + std::ptrdiff_t(end), patch_.region_count);
      add_region(int32_t(first));
    }
  }
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

void RegionGrower::attach(int32_t triangle, int32_t region) {
  patch_.region[triangle] = region;
  ++sizes_[region];
  for (int k = 0; k < 3; k++) {
    const int32_t across = patch_.neighbours[3 * triangle + k];
    if (across < 0 || patch_.region[across / 3] >= 0) continue;
    const float shape = shape_weight(across / 3, region);
    queue_.add(across / 3, region, shape, BucketQueue::bucket_of(fill(sizes_[region]) * shape));
  }
}

void RegionGrower::attach_triangles() {
  queue_.clear();
  patch_.region.assign(patch_.size(), -1);
  sizes_.assign(seeds_.size(), 0);
  // Centres stay in their own regions even if another region has less weight.
  for (size_t r = 0; r < seeds_.size(); r++) patch_.region[seeds_[r]] = int32_t(r);
  for (size_t r = 0; r < seeds_.size(); r++) attach(seeds_[r], int32_t(r));
  for (int32_t item; (item = queue_.pop()) != BucketQueue::kNone;) {
    const Candidate& candidate = queue_[item];
    if (patch_.region[candidate.triangle] >= 0) continue;
    // The region may have grown since this entry was weighed.
    const int bucket =
        BucketQueue::bucket_of(fill(sizes_[candidate.region]) * candidate.shape_weight);
    if (bucket > queue_.current())
      queue_.push(item, bucket);
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
    const float norm = length(sums_[r].normal);
    means_[r].normal = norm > 0 ? sums_[r].normal * (1.0f / norm) : sums_[r].normal;
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

// Gives triangles at borders to the region of least weight: what a round of growth changes, without
// its queue. A region may fall apart.
void RegionGrower::sweep() {
  for (int32_t t = 0; t < int32_t(patch_.size()); t++) {
    const int32_t to = lightest_region(t);
    if (to != patch_.region[t] && sizes_[patch_.region[t]] > 1) shift(t, to);
  }
}

// Of the regions around a triangle and its own.
inline int32_t RegionGrower::lightest_region(int32_t triangle) const {
  const int32_t own = patch_.region[triangle];
  int32_t best = own;
  float least = -1;
  for (int k = 0; k < 3; k++) {
    const int32_t across = patch_.neighbours[3 * triangle + k];
    if (across < 0) continue;
    const int32_t other = patch_.region[across / 3];
    if (other == own || other == best) continue;
    // Without the penalty for full regions, which would push triangles to and fro.
    const float scale = 1.0f / options_.mean_size;
    if (least < 0) least = float(sizes_[own]) * scale * shape_weight(triangle, own);
    const float weight = float(sizes_[other] + 1) * scale * shape_weight(triangle, other);
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

}  // namespace meshlet

#include "segment/region_growing.h"

#include <algorithm>
#include <cstring>

namespace meshlet {
namespace {

// Centres move this many times as far as the means of their regions: fewer rounds until they rest.
constexpr float kOvershoot = 1.7f;

// C_m of equation (2): added to the relative size of a full region.
constexpr float kFullPenalty = 8.0f;

// Half-edges by weight, in buckets of an eighth of an octave: O(1) per operation. Entries lighter
// than the current bucket go into that bucket.
class BucketQueue {
 public:
  explicit BucketQueue(size_t capacity) : next_(capacity), heads_(kBucketCount, kNone) {}

  static int bucket_of(float weight) {
    uint32_t bits;
    std::memcpy(&bits, &weight, sizeof bits);
    const int bucket = int(bits >> 20) - kLightest;
    return std::min(std::max(bucket, 0), kBucketCount - 1);
  }
  void push(int32_t item, int bucket) {
    bucket = std::max(bucket, current_);
    next_[item] = heads_[bucket];
    heads_[bucket] = item;
  }
  // Removes an item of the kLightest bucket that has any, or returns kNone.
  int32_t pop() {
    while (heads_[current_] == kNone)
      if (++current_ == kBucketCount) return current_ = 0, kNone;
    const int32_t item = heads_[current_];
    heads_[current_] = next_[item];
    return item;
  }
  int current() const { return current_; }

  static constexpr int32_t kNone = -1;

 private:
  static constexpr int kOctaves = 64, kPerOctave = 8, kBucketCount = kOctaves * kPerOctave;
  static constexpr int kLightest =
      (127 - 50) * kPerOctave;  // weights below 2^-50 share the first bucket
  std::vector<int32_t> next_;
  std::vector<int32_t> heads_;
  int current_ = 0;
};

class RegionGrower {
 public:
  RegionGrower(Patch& patch, const GrowthOptions& options)
      : patch_(patch),
        options_(options),
        queue_(3 * patch.size()),
        shape_weights_(3 * patch.size()) {}

  int run() {
    place_centres();
    int round = 0;
    do {
      attach_triangles();
      round++;
    } while (move_centres() && round < options_.iterations);
    return round;
  }

 private:
  void place_centres();
  void attach_triangles();
  void attach(int32_t triangle, int32_t region);
  bool move_centres();
  float shape_weight(int32_t triangle, int32_t region) const;
  float weight(int32_t half_edge) const;

  Patch& patch_;
  const GrowthOptions options_;
  BucketQueue queue_;
  std::vector<float> shape_weights_;  // of half-edges in the queue
  std::vector<int32_t> seeds_;        // triangle at the centre of each region
  std::vector<Facet> means_;          // centre and mean normal of each region
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

// Initial centres, evenly over each connected part: triangles are numbered along a space-filling
// curve, and every n-th becomes a centre.
void RegionGrower::place_centres() {
  std::vector<int32_t> part;
  const std::vector<int32_t> sizes = label_connected(patch_, part);
  std::vector<int64_t> seen(sizes.size(), 0);
  for (size_t t = 0; t < patch_.size(); t++) {
    const int64_t size = sizes[part[t]], rank = seen[part[t]]++;
    const int64_t centres = std::min(size, int64_t(std::ceil(float(size) / options_.mean_size)));
    if ((rank * centres + size / 2) % size < centres) seeds_.push_back(int32_t(t));
  }
  for (const int32_t seed : seeds_) means_.push_back(patch_.facets[seed]);
  patch_.region_count = int32_t(seeds_.size());
}

// The factors of equation (1) that do not change while a region grows: distance and planarity.
float RegionGrower::shape_weight(int32_t triangle, int32_t region) const {
  const Facet& facet = patch_.facets[triangle];
  const Facet& mean = means_[region];
  return length(facet.centre - mean.centre) *
         std::max(0.0f, options_.lambda - dot(facet.normal, mean.normal));
}

// Equation (1) for the triangle across a half-edge in the queue.
float RegionGrower::weight(int32_t half_edge) const {
  const int32_t size = sizes_[patch_.region[half_edge / 3]];
  float fill = float(size) * (1.0f / options_.mean_size);
  if (options_.weight == Weight::kPaper && size >= options_.max_size) fill += kFullPenalty;
  return fill * shape_weights_[half_edge];
}

void RegionGrower::attach(int32_t triangle, int32_t region) {
  patch_.region[triangle] = region;
  ++sizes_[region];
  for (int k = 0; k < 3; k++) {
    const int32_t across = patch_.neighbours[3 * triangle + k];
    if (across < 0 || patch_.region[across / 3] >= 0) continue;
    const int32_t half_edge = 3 * triangle + k;
    shape_weights_[half_edge] = shape_weight(across / 3, region);
    queue_.push(half_edge, BucketQueue::bucket_of(weight(half_edge)));
  }
}

void RegionGrower::attach_triangles() {
  patch_.region.assign(patch_.size(), -1);
  sizes_.assign(seeds_.size(), 0);
  // Centres stay in their own regions even if another region has less weight.
  for (size_t r = 0; r < seeds_.size(); r++) patch_.region[seeds_[r]] = int32_t(r);
  for (size_t r = 0; r < seeds_.size(); r++) attach(seeds_[r], int32_t(r));
  for (int32_t half_edge; (half_edge = queue_.pop()) != BucketQueue::kNone;) {
    const int32_t triangle = patch_.neighbours[half_edge] / 3,
                  region = patch_.region[half_edge / 3];
    if (patch_.region[triangle] >= 0) continue;
    // The region may have grown since this entry was weighed.
    const int bucket = BucketQueue::bucket_of(weight(half_edge));
    if (bucket > queue_.current())
      queue_.push(half_edge, bucket);
    else
      attach(triangle, region);
  }
}

// Moves each region's centre towards the mean of its triangles, and its seed to the triangle
// nearest to the centre. Returns whether any seed changed.
bool RegionGrower::move_centres() {
  const std::vector<Facet> former = means_;
  std::fill(means_.begin(), means_.end(), Facet{{0, 0, 0}, {0, 0, 0}});
  for (size_t t = 0; t < patch_.size(); t++) {
    Facet& mean = means_[patch_.region[t]];
    mean.centre = mean.centre + patch_.facets[t].centre;
    mean.normal = mean.normal + patch_.facets[t].normal;
  }
  for (size_t r = 0; r < seeds_.size(); r++) {
    const Vec3 mean = means_[r].centre * (1.0f / float(sizes_[r]));
    means_[r].centre = former[r].centre + (mean - former[r].centre) * kOvershoot;
    const float norm = length(means_[r].normal);
    if (norm > 0) means_[r].normal = means_[r].normal * (1.0f / norm);
  }
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

}  // namespace

int grow_regions(Patch& patch, const GrowthOptions& options) {
  return RegionGrower(patch, options).run();
}

}  // namespace meshlet

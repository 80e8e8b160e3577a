#include "encode/page_growth.h"

#include <algorithm>
#include <limits>

#include "common/curve.h"

namespace gltf_meshlet_codec {
namespace {

constexpr uint32_t kNone = ~0u;

// The meshlets along a curve through their centres.
Array<uint32_t> along_curve(const MeshView& mesh, const Meshlets& meshlets) {
  std::vector<Vec3> centres(meshlets.count());
  for (size_t m = 0; m < centres.size(); m++) {
    const uint32_t begin = meshlets.first_triangle(m), end = meshlets.first_triangle(m + 1);
    for (int c = 0; c < 3; c++) {
      double sum = 0;
      for (uint32_t i = begin; i < end; i++)
        for (int k = 0; k < 3; k++)
          sum +=
              mesh.positions[3 * size_t(mesh.triangles[3 * size_t(meshlets.triangles[i]) + k]) + c];
      centres[m][c] = float(sum / (3.0 * (end - begin)));
    }
  }
  const Box box = box_of(centres);
  const float size = std::max(box.longest_side(), std::numeric_limits<float>::min());
  return order_along_curve(centres.size(), 1, [&](size_t m) {
    const Vec3 p = centres[m] - box.low;
    return Vec3{p.x / size, p.y / size, p.z / size} * (kCurveCells - 1);
  });
}

}  // namespace

PageGrowth::PageGrowth(const MeshView& mesh, const HalfEdges& half_edges, const Meshlets& meshlets)
    : PageItems(false), at_place_(along_curve(mesh, meshlets)) {
  const size_t count = at_place_.size();
  link(half_edges, meshlets);
  page_edges_.assign(count, 0);
  finished_edges_.assign(count, 0);
  is_free_.assign(count, true);
  place_.resize(count);
  for (uint32_t place = 0; place < count; place++) {
    place_[at_place_[place]] = place;
    free_.insert(free_.end(), place);
  }
}

// Counts the edges that each pair of meshlets shares, by position.
void PageGrowth::link(const HalfEdges& half_edges, const Meshlets& meshlets) {
  const size_t count = at_place_.size();
  std::vector<uint32_t> owner(meshlets.triangles.size());
  for (uint32_t m = 0; m < count; m++)
    for (uint32_t i = meshlets.first_triangle(m); i < meshlets.first_triangle(m + 1); i++)
      owner[meshlets.triangles[i]] = m;
  std::vector<uint32_t> across;
  first_neighbour_.push_back(0);
  for (uint32_t m = 0; m < count; m++) {
    across.clear();
    for (uint32_t i = meshlets.first_triangle(m); i < meshlets.first_triangle(m + 1); i++) {
      for (uint32_t k = 0; k < 3; k++) {
        const int32_t other = half_edges.by_position(3 * size_t(meshlets.triangles[i]) + k);
        if (other >= 0 && owner[uint32_t(other) / 3] != m)
          across.push_back(owner[uint32_t(other) / 3]);
      }
    }
    edges_.push_back(std::max(uint32_t(across.size()), 1u));
    std::sort(across.begin(), across.end());
    for (size_t i = 0; i < across.size(); i++) {
      if (i == 0 || across[i] != across[i - 1]) neighbours_.push_back({across[i], 0});
      neighbours_.back().edges++;
    }
    first_neighbour_.push_back(uint32_t(neighbours_.size()));
  }
}

void PageGrowth::start() {
  for (uint32_t m : touched_) page_edges_[m] = 0;
  touched_.clear();
  candidates_ = Queue();
  seeding_ = true;
}

uint32_t PageGrowth::next(Queue& queue, double (PageGrowth::*score)(uint32_t) const) {
  while (!queue.empty()) {
    const Candidate best = queue.top();
    queue.pop();
    if (is_free_[best.meshlet] && best.score == (this->*score)(best.meshlet)) return best.meshlet;
  }
  return kNone;
}

// A free meshlet near the last one, or the first.
uint32_t PageGrowth::next_on_curve() const {
  const auto after = seeding_ ? free_.begin() : free_.lower_bound(place_[last_]);
  return at_place_[after != free_.end() ? *after : *free_.rbegin()];
}

uint32_t PageGrowth::add() {
  uint32_t m =
      seeding_ ? next(seeds_, &PageGrowth::seed_score) : next(candidates_, &PageGrowth::score);
  if (m == kNone) m = next_on_curve();
  seeding_ = false;
  is_free_[m] = false;
  free_.erase(place_[m]);
  last_ = m;
  for (uint32_t i = first_neighbour_[m]; i < first_neighbour_[m + 1]; i++) {
    const uint32_t other = neighbours_[i].meshlet;
    if (page_edges_[other] == 0) touched_.push_back(other);
    page_edges_[other] += neighbours_[i].edges;
    if (is_free_[other]) candidates_.push({score(other), age_++, other});
  }
  return m;
}

void PageGrowth::finish(const std::vector<uint32_t>& kept) {
  for (uint32_t m : kept) count_finished(m, true);
}

void PageGrowth::release(uint32_t m, bool finished) {
  is_free_[m] = true;
  free_.insert(place_[m]);
  seeds_.push({seed_score(m), age_++, m});
  if (finished) count_finished(m, false);
}

void PageGrowth::count_finished(uint32_t m, bool finished) {
  for (uint32_t i = first_neighbour_[m]; i < first_neighbour_[m + 1]; i++) {
    const uint32_t other = neighbours_[i].meshlet;
    finished_edges_[other] += finished ? neighbours_[i].edges : 0u - neighbours_[i].edges;
    if (is_free_[other]) seeds_.push({seed_score(other), age_++, other});
  }
}

}  // namespace gltf_meshlet_codec

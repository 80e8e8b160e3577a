#include "levels/tables.h"

#include <algorithm>
#include <cmath>

namespace gltf_meshlet_codec {
namespace {

template <class Row>
bool copy_rows(const uint8_t* from, size_t count, List<Row>& rows) {
  if (!rows.resize(count)) return false;
  if (count) std::memcpy(rows.data(), from, count * sizeof(Row));
  return true;
}

bool is_finite(float x) { return std::fabs(x) <= 3.4028234663852886e38f; }

// The least radius with which a sphere at the centre of `coarse` contains that of `fine`; the
// specification defines each rounding.
double reach(const LevelGroup& coarse, const LevelGroup& fine) {
  const double x = double(coarse.centre[0]) - double(fine.centre[0]),
               y = double(coarse.centre[1]) - double(fine.centre[1]),
               z = double(coarse.centre[2]) - double(fine.centre[2]);
  return std::sqrt((x * x + y * y) + z * z) + double(fine.radius);
}

// More than its meshlets can have: memory is planned by these numbers.
bool has_too_much(const LevelPage& page, uint64_t clusters) {
  const uint64_t most = MESHLET_TRIANGLES * clusters;
  return page.triangles > most || page.vertices > 3 * most;
}
constexpr const char* kTooMuch = "page # has more triangles or vertices than its clusters can have";

}  // namespace

Problem LevelTables::open(const LevelCounts& counts, const LevelBytes& bytes) {
  counts_ = counts;
  if (const Problem problem = check_counts()) return problem;
  if (const Problem problem = copy(bytes)) return problem;
  if (const Problem problem = check_groups()) return problem;
  return check_runs();
}

Problem LevelTables::check_counts() const {
  const LevelCounts& c = counts_;
  if (c.coarse_pages == 0 || c.coarse_pages >= c.pages || c.pages > c.groups ||
      c.groups > kMostGroups || c.runs == 0 || c.runs > uint64_t(kMostClusters) * c.groups ||
      c.root_pages > c.pages)
    return {"the levels have counts that cannot be"};
  return {};
}

// The page table, whole pages of groups, and their runs.
Problem LevelTables::copy(const LevelBytes& b) {
  const uint64_t page_end = sizeof(LevelPage) * uint64_t(counts_.pages),
                 group_end = page_end + sizeof(LevelGroup) * uint64_t(counts_.groups),
                 end = group_end + sizeof(LevelRun) * uint64_t(counts_.runs);
  if (b.runs && b.size < page_end) return {kPrefixEnds};
  if (b.runs ? b.size > group_end : b.size != end)
    return {"the tables of the levels have another length than their counts say"};
  const uint64_t known = ((b.runs ? b.size : group_end) - page_end) / sizeof(LevelGroup);
  if (!copy_rows(b.bytes, counts_.pages, pages_) || !begins_.resize(counts_.pages))
    return {kNoMemory};
  if (const Problem problem = check_pages()) return problem;
  const uint32_t groups = groups_of_whole_pages(known);
  if (const Problem problem = check_prefix(groups)) return problem;
  if (!copy_rows(b.bytes + page_end, groups, groups_)) return {kNoMemory};
  return copy_runs(b, b.bytes + group_end);
}

uint32_t LevelTables::groups_of_whole_pages(uint64_t known) const {
  uint32_t groups = 0;
  for (uint32_t p = 0; p < counts_.pages && page_end_group(p) <= known; p++)
    groups = page_end_group(p);
  return groups;
}

// Without all top groups, cuts would have holes.
Problem LevelTables::check_prefix(uint32_t groups) const {
  if (groups == counts_.groups) return {};
  if (!counts_.root_pages) return {kPrefixRoots};
  return groups < page_end_group(counts_.root_pages - 1) ? Problem{kPrefixEnds} : Problem{};
}

// all: where the runs are in tables that are no prefix.
Problem LevelTables::copy_runs(const LevelBytes& b, const uint8_t* all) {
  uint64_t runs = 0;
  for (const LevelGroup& group : groups_) runs += group.runs;
  if (runs > counts_.runs || (known_groups() == counts_.groups && runs != counts_.runs))
    return {"the groups of the levels have other runs than there are"};
  if (b.runs && b.runs_size / sizeof(LevelRun) < runs) return {kPrefixRuns};
  return copy_rows(b.runs ? b.runs : all, size_t(runs), runs_) ? Problem{} : Problem{kNoMemory};
}

uint32_t LevelTables::page_of(uint32_t g) const {
  const auto next = std::upper_bound(
      pages_.begin(), pages_.end(), g,
      [](uint32_t group, const LevelPage& page) { return group < page.first_group; });
  return uint32_t(next - pages_.begin()) - 1;
}

Problem LevelTables::check_pages() {
  uint64_t begin = 0;
  for (uint32_t p = 0; p < counts_.pages; p++) {
    const LevelPage& page = pages_[p];
    if (page.bytes == 0 || page.bytes % 4) return {"page # has an impossible length", p};
    if (p == 0
            ? page.first_group != 0
            : page.first_group <= pages_[p - 1].first_group || page.first_group >= counts_.groups)
      return {"page # has no groups, or not the next ones", p};
    if (p == counts_.coarse_pages) begin = 0;
    begins_[p] = begin;
    begin += page.bytes;
  }
  for (uint32_t p = 0; p < counts_.pages; p++)
    if (has_too_much(pages_[p],
                     uint64_t(kMostClusters) * (page_end_group(p) - pages_[p].first_group)))
      return {kTooMuch, p};
  return {};
}

Problem LevelTables::check_groups() {
  uint32_t page = 0;
  for (uint32_t g = 0; g < known_groups(); g++) {
    while (page_end_group(page) <= g) page++;
    if (const Problem problem = check_group(g, page)) return problem;
    if (g + 1 == page_end_group(page) && has_too_much(pages_[page], page_clusters(page)))
      return {kTooMuch, page};
    fine_groups_ += groups_[g].runs == 0;
  }
  return {};
}

Problem LevelTables::check_group(uint32_t g, uint32_t page) const {
  const LevelGroup& group = groups_[g];
  const bool is_first = g == pages_[page].first_group;
  if (group.page != page) return {"group # is not in the page that lists it", g};
  if (group.clusters == 0) return {"group # has no clusters", g};
  if (group.first_cluster !=
      (is_first ? 0u : uint32_t(groups_[g - 1].first_cluster) + groups_[g - 1].clusters))
    return {"the clusters of group # do not follow on", g};
  if (group.first_run != (g ? groups_[g - 1].first_run + groups_[g - 1].runs : 0u))
    return {"the runs of group # do not follow on", g};
  if (!is_finite(group.centre[0]) || !is_finite(group.centre[1]) || !is_finite(group.centre[2]) ||
      !is_finite(group.radius))
    return {"the sphere of group # is not finite", g};
  if (!(group.radius >= 0) || !(group.error >= 0))
    return {"the radius or error of group # is negative or no number", g};
  if ((group.runs == 0) != (page >= counts_.coarse_pages))
    return {"group # has no runs in a coarse page, or has some in one of level 0", g};
  return {};
}

// Groups that name a known one are known, too: coarse ones come first.
Problem LevelTables::check_runs() {
  List<uint8_t> replaced;
  if (!replaced.resize(groups_.size())) return {kNoMemory};
  std::fill(replaced.begin(), replaced.end(), uint8_t(0));
  for (uint32_t g = 0; g < known_groups(); g++) {
    const LevelGroup& group = groups_[g];
    uint32_t clusters = 0;
    for (uint32_t r = group.first_run; r < group.first_run + group.runs; r++) {
      if (const Problem problem = check_run(group, g, runs_[r])) return problem;
      clusters += runs_[r].clusters();
      if (runs_[r].group() < known_groups()) replaced[runs_[r].group()] = 1;
    }
    if (group.runs && clusters != group.clusters)
      return {"the runs of group # are not its clusters", g};
    if (is_finite(group.error) != (replaced[g] != 0))
      return {"group # has a finite error and no replacement, or the reverse", g};
    if (!replaced[g]) root_pages_ = group.page + 1;
  }
  if (counts_.root_pages && counts_.root_pages != root_pages_)
    return {"rootPageCount is not # as the groups say", root_pages_};
  return {};
}

Problem LevelTables::check_run(const LevelGroup& coarse, uint32_t g, const LevelRun& run) const {
  if (run.group() <= g || run.group() >= counts_.groups)
    return {"a run of group # names a group that is not finer", g};
  if (run.clusters() == 0) return {"a run of group # has no clusters", g};
  if (run.group() >= known_groups()) return {};
  const LevelGroup& fine = groups_[run.group()];
  if (!(coarse.error >= fine.error)) return {"group # has a smaller error than a finer one", g};
  if (!(reach(coarse, fine) <= double(coarse.radius)))
    return {"the sphere of group # does not contain that of a finer one", g};
  return {};
}

}  // namespace gltf_meshlet_codec

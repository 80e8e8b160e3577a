// The tables of EXT_meshlet_lod, all of them or a prefix: pages, groups and runs.
#pragma once
#include "decode/memory.h"
#include "format/blob.h"

namespace gltf_meshlet_codec {

constexpr uint32_t kMostGroups = 1u << 24;  // 24 bits of a run
constexpr uint32_t kMostClusters = 255;     // of a group: 8 bits

// Rows as in the file.
struct LevelPage {
  uint32_t bytes, first_group, triangles, vertices;
};
struct LevelGroup {
  float centre[3], radius, error;
  uint32_t first_run, page;
  uint16_t first_cluster;  // meshlet of the page
  uint8_t clusters, runs;
};
struct LevelRun {
  uint32_t word;

  uint32_t group() const { return word & 0xFFFFFFu; }
  uint32_t clusters() const { return word >> 24; }
};
static_assert(sizeof(LevelPage) == 16 && sizeof(LevelGroup) == 32 && sizeof(LevelRun) == 4,
              "rows are copied as bytes");

// The counts of the extension's object.
struct LevelCounts {
  uint32_t pages, coarse_pages, groups, runs;
  uint32_t root_pages;  // 0: not stated
};

// Bytes of the tables: the first ones of their view, and runs. `runs` is null if `bytes` are all.
struct LevelBytes {
  const uint8_t* bytes;
  uint64_t size;
  const uint8_t* runs;
  uint64_t runs_size;
};

// Not broken rules but mistakes of who passes a prefix.
inline constexpr char kPrefixEnds[] = "the prefix ends before the groups of the root pages do";
inline constexpr char kPrefixRuns[] = "the prefix has fewer runs than its groups";
inline constexpr char kPrefixRoots[] =
    "a prefix needs the number of root pages: without rootPageCount open all of the tables";

// Copied and checked. Does not change once it is open: threads share it.
class LevelTables {
 public:
  // Call once. Returns the rule of the specification that the counts or tables break, if any.
  Problem open(const LevelCounts& counts, const LevelBytes& bytes);

  const LevelCounts& counts() const { return counts_; }
  // Groups from here on are not there: their pages count as not resident.
  uint32_t known_groups() const { return uint32_t(groups_.size()); }
  // Pages up to the last one with a top group.
  uint32_t root_pages() const { return root_pages_; }
  const LevelPage& page(uint32_t p) const { return pages_[p]; }
  const LevelGroup& group(uint32_t g) const { return groups_[g]; }
  const LevelRun& run(uint32_t r) const { return runs_[r]; }
  // Where the page begins in its view, that of coarse pages or of level 0.
  uint64_t page_begin(uint32_t p) const { return begins_[p]; }
  uint32_t page_end_group(uint32_t p) const {
    return p + 1 < counts_.pages ? pages_[p + 1].first_group : counts_.groups;
  }
  // Are the groups of the page there?
  bool knows_page(uint32_t p) const { return page_end_group(p) <= known_groups(); }
  // The page that lists group g.
  uint32_t page_of(uint32_t g) const;
  // Meshlets of a page that is known.
  uint32_t page_clusters(uint32_t p) const {
    const LevelGroup& last = groups_[page_end_group(p) - 1];
    return uint32_t(last.first_cluster) + last.clusters;
  }
  // Of a cut, in ranges of clusters.
  uint64_t most_draws() const { return runs_.size() + fine_groups_; }

 private:
  Problem check_counts() const;
  Problem copy(const LevelBytes& bytes);
  Problem copy_runs(const LevelBytes& bytes, const uint8_t* all);
  uint32_t groups_of_whole_pages(uint64_t known) const;
  Problem check_prefix(uint32_t groups) const;
  Problem check_pages();
  Problem check_groups();
  Problem check_group(uint32_t g, uint32_t page) const;
  Problem check_runs();
  Problem check_run(const LevelGroup& coarse, uint32_t g, const LevelRun& run) const;

  LevelCounts counts_{};
  uint32_t root_pages_ = 0, fine_groups_ = 0;
  List<LevelPage> pages_;
  List<LevelGroup> groups_;
  List<LevelRun> runs_;
  List<uint64_t> begins_;  // of the pages, in bytes
};

}  // namespace gltf_meshlet_codec

#include "lod/level_pages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "common/weld.h"
#include "format/blob.h"

namespace gltf_meshlet_codec {
namespace {

// Groups of a block, which errors order. Measured with 24, 48 and 96 on dragon with four times its
// triangles and noise: the pages for one pixel of error have 1.28, 1.20 and 1.16 MB; those for four
// pixels at the nearest point, mean of 20 cameras, have 1.57, 1.60 and 1.70 MB.
constexpr size_t kBlockGroups = 48;
// The last page of a coarse level takes groups of the next level if it is emptier than this. Full
// pages make 2 % smaller files, but a cut loads up to a fifth more bytes (igea).
constexpr double kLeastPage = 0.25;

using Numbers = std::vector<uint32_t>;

template <size_t N>
using Rows = std::vector<std::array<uint32_t, N>>;

// Gives equal rows one number, in order of first occurrence. Returns how many there are.
template <size_t N>
uint32_t number_rows(const Rows<N>& rows, Numbers& numbers) {
  numbers.resize(rows.size());
  return weld_rows(reinterpret_cast<const uint8_t*>(rows.data()), rows.size(), 4 * N,
                   numbers.data());
}

uint32_t last_level(const Levels& levels) {
  uint32_t last = 0;
  for (const ClusterGroup& group : levels.groups) last = std::max(last, group.level);
  return last;
}

// Vertices for the encoder, and the triangles of all clusters with them.
struct PageMesh {
  const Triangles* triangles;
  const uint32_t* position_ids;
  const float* positions;
  size_t vertex_count;
  VertexValues values;
};

// Copies of vertices: each coarse level has its own.
class CoarseVertices {
 public:
  CoarseVertices(const Levels& levels, const Surface& surface, const VertexValues& of_surface)
      : levels_(levels), triangles_(levels.grouped.ranges.triangles.size()) {
    find_clashes();
    const uint32_t layers = last_level(levels) + 1;
    Rows<2> keys;
    for_corners([&](uint32_t cluster, size_t i) {
      const auto finer = uint32_t(levels_.grouped.clusters[cluster].finer_group);
      keys.push_back({clashes_[finer] ? layers + finer : level(cluster), corner(i)});
    });
    Numbers numbers;
    const uint32_t count = number_rows(keys, numbers);
    Rows<2> places(count);  // level and position of each copy
    Numbers vertices(count);
    size_t k = 0;
    for_corners([&](uint32_t cluster, size_t i) {
      const uint32_t copy = triangles_[i] = numbers[k++];
      vertices[copy] = corner(i);
      places[copy] = {level(cluster), surface.position_ids[corner(i)]};
    });
    number_rows(places, position_ids_);
    copy_values(vertices, surface, of_surface);
  }

  // With these copies as vertices. of_surface: as in the constructor.
  PageMesh mesh(const VertexValues& of_surface) const {
    VertexValues values;
    for (const Numbers& list : values_) values.values.push_back(list.data());
    values.elements = of_surface.elements;
    return {&triangles_, position_ids_.data(), positions_.data(), position_ids_.size(), values};
  }

 private:
  uint32_t level(uint32_t cluster) const {
    return levels_.groups[levels_.cluster_group[cluster]].level;
  }
  uint32_t corner(size_t i) const { return levels_.grouped.ranges.triangles[i]; }

  // Calls body(cluster, place in `triangles`) for all corners of coarse clusters.
  template <class Body>
  void for_corners(const Body& body) const {
    const ClusterSet& all = levels_.grouped;
    for (uint32_t c = 0; c < all.clusters.size(); c++) {
      if (all.clusters[c].finer_group == kNoGroup) continue;
      const size_t end = 3 * size_t(all.ranges.first_triangle(c + 1));
      for (size_t i = 3 * size_t(all.ranges.first_triangle(c)); i < end; i++) body(c, i);
    }
  }

  // Finds replacements with an edge that two triangles of the level use in one direction. Meshlets
  // are made in each replacement alone, where such an edge may lie inside a disk.
  void find_clashes() {
    Rows<3> edges;
    int32_t last = 0;
    for_corners([&](uint32_t cluster, size_t i) {
      edges.push_back({level(cluster), corner(i), corner(i % 3 == 2 ? i - 2 : i + 1)});
      last = std::max(last, levels_.grouped.clusters[cluster].finer_group);
    });
    Numbers numbers, uses(edges.size());
    number_rows(edges, numbers);
    for (uint32_t n : numbers) uses[n]++;
    clashes_.resize(size_t(last) + 1);
    size_t k = 0;
    for_corners([&](uint32_t cluster, size_t) {
      const auto finer = size_t(levels_.grouped.clusters[cluster].finer_group);
      if (uses[numbers[k++]] > 1) clashes_[finer] = true;
    });
  }

  void copy_values(const Numbers& vertices, const Surface& surface, const VertexValues& from) {
    values_.resize(from.values.size());
    for (uint32_t v : vertices) {
      const float* p = surface.points + 3 * size_t(v);
      positions_.insert(positions_.end(), p, p + 3);
      for (uint32_t s = 0; s < values_.size(); s++)
        values_[s].insert(values_[s].end(), from.of(s, v), from.of(s, v) + from.elements[s]);
    }
  }

  const Levels& levels_;
  Triangles triangles_;  // of all clusters; zeros in level 0
  Numbers position_ids_;
  std::vector<float> positions_;
  std::vector<Numbers> values_;
  std::vector<bool> clashes_;  // of each finer group
};

class Pager {
 public:
  Pager(const Levels& levels, const std::vector<Stream>& streams, size_t page_bytes, int threads)
      : levels_(levels),
        streams_(streams),
        page_bytes_(page_bytes),
        threads_(threads),
        clusters_(levels.groups.size()) {
    for (uint32_t c = 0; c < levels.cluster_group.size(); c++)
      clusters_[levels.cluster_group[c]].push_back(c);
    const auto finer_group = [&](uint32_t c) { return levels.grouped.clusters[c].finer_group; };
    for (Numbers& clusters : clusters_)
      std::stable_sort(clusters.begin(), clusters.end(),
                       [&](uint32_t a, uint32_t b) { return finer_group(a) < finer_group(b); });
  }

  // Encodes groups, in this order, and appends their pages.
  void add(const Numbers& groups, const PageMesh& mesh, std::vector<EncodedPage>& pages,
           EncoderStats& stats) const {
    ClusterRanges own;
    Numbers group_begin{0};
    const ClusterRanges& all = levels_.grouped.ranges;
    Triangles triangles;
    for (uint32_t g : groups) {
      for (uint32_t c : clusters_[g]) {
        own.append(all, c);
        const auto begin = mesh.triangles->begin();
        triangles.insert(triangles.end(), begin + 3 * std::ptrdiff_t(all.first_triangle(c)),
                         begin + 3 * std::ptrdiff_t(all.first_triangle(c + 1)));
      }
      group_begin.push_back(uint32_t(own.count()));
    }
    Meshlets meshlets;
    meshlets.triangles.resize(own.triangle_count());
    std::iota(meshlets.triangles.begin(), meshlets.triangles.end(), 0);
    meshlets.disk_begin = std::move(own.disk_begin);
    meshlets.meshlet_begin = std::move(own.cluster_begin);
    const MeshView view{triangles.data(), triangles.size() / 3, mesh.position_ids, mesh.positions,
                        mesh.vertex_count};
    EncodeOptions options;
    options.threads = threads_;
    std::vector<Bytes> blobs = encode_given(view, meshlets, group_begin, streams_, mesh.values,
                                            options, page_bytes_, stats);
    size_t group = 0;
    for (Bytes& blob : blobs) {
      BlobHeader header;
      if (read_blob_header(blob.data(), blob.size(), header))
        throw std::logic_error("a page that was encoded is malformed");
      pages.push_back({{}, std::move(blob), header.triangle_count, header.vertex_count});
      const uint32_t end = group_begin[group] + header.meshlet_count;
      while (group_begin[group] < end) pages.back().groups.push_back(groups[group++]);
    }
  }

 private:
  const Levels& levels_;
  const std::vector<Stream>& streams_;
  const size_t page_bytes_;
  const int threads_;
  std::vector<Numbers> clusters_;  // of each group, by their finer groups: runs
};

Numbers groups_of(const Levels& levels, uint32_t level) {
  Numbers groups;
  for (uint32_t g = 0; g < levels.groups.size(); g++)
    if (levels.groups[g].level == level) groups.push_back(g);
  return groups;
}

}  // namespace

size_t LevelPages::largest() const {
  size_t largest = 0;
  for (const std::vector<EncodedPage>* pages : {&coarse, &fine})
    for (const EncodedPage& page : *pages) largest = std::max(largest, page.blob.size());
  return largest;
}

std::vector<uint32_t> ordered_by_error(const std::vector<uint32_t>& groups,
                                       const std::vector<ClusterGroup>& all) {
  const size_t blocks = (groups.size() + kBlockGroups - 1) / kBlockGroups;
  Numbers order(groups);
  for (size_t block = 0, first = 0; block < blocks; block++) {
    const size_t last = ((block + 1) * groups.size() + blocks - 1) / blocks;
    std::stable_sort(order.begin() + std::ptrdiff_t(first), order.begin() + std::ptrdiff_t(last),
                     [&](uint32_t a, uint32_t b) { return all[a].error > all[b].error; });
    first = last;
  }
  return order;
}

LevelPages encode_levels(const Levels& levels, const Surface& surface,
                         const std::vector<Stream>& streams, const VertexValues& values,
                         const uint32_t* source_position_ids, size_t page_bytes, int threads) {
  LevelPages pages;
  const Pager pager(levels, streams, page_bytes, threads);
  const uint32_t last = last_level(levels);
  if (last > 0) {
    const CoarseVertices coarse(levels, surface, values);
    const PageMesh mesh = coarse.mesh(values);
    for (uint32_t level = last; level > 0; level--) {
      Numbers groups = ordered_by_error(groups_of(levels, level), levels.groups);
      if (groups.empty()) continue;
      std::vector<EncodedPage>& done = pages.coarse;
      if (!done.empty() && double(done.back().blob.size()) < kLeastPage * double(page_bytes)) {
        groups.insert(groups.begin(), done.back().groups.begin(), done.back().groups.end());
        done.pop_back();
      }
      EncoderStats stats;
      pager.add(groups, mesh, done, stats);
    }
  }
  // The groups of level 0 stay along the curve: the errors of their replacements differ little, and
  // neighbours in one page share vertices.
  const Numbers finest = groups_of(levels, 0);
  const PageMesh mesh{&levels.grouped.ranges.triangles, source_position_ids, surface.points,
                      surface.vertex_count, values};
  if (!finest.empty()) pager.add(finest, mesh, pages.fine, pages.fine_stats);
  return pages;
}

EncodedLevels build_and_encode(const Surface& surface, const ClusterSet& given,
                               const PagePilot& pilot, const uint32_t* source_position_ids,
                               const Simplifier& simplifier, LevelOptions options) {
  const bool is_whole = options.builds_all && given.clusters.empty();
  for (;;) {
    EncodedLevels all{build_levels(surface, given, pilot, simplifier, options), {}};
    const std::vector<ClusterGroup>& groups = all.levels.groups;
    if (groups.empty()) return all;
    if (is_whole && (std::isinf(groups[0].error) || groups.size() > kMostGroups)) return all;
    all.pages = encode_levels(all.levels, surface, pilot.streams, pilot.values, source_position_ids,
                              pilot.page_bytes, options.generation.threads);
    const bool fits = pilot.page_bytes == 0 || all.pages.largest() <= pilot.page_bytes;
    if (fits || options.group_size <= kSmallestGroup) return all;
    options.group_size = std::max(options.group_size / 2, kSmallestGroup);  // rare: see PagePilot
  }
}

}  // namespace gltf_meshlet_codec

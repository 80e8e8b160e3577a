#include "lod/group_clusters.h"

#include <algorithm>
#include <numeric>

#include "common/curve.h"
#include "common/parallel.h"

namespace gltf_meshlet_codec {
namespace {

constexpr double kLargest = 11.0 / 8;  // clusters of a group over those that it should have
constexpr double kTighter = 0.9;       // than the estimate allows: the largest group varies
// The most bytes of connectivity for a triangle; vertices take no more than their integers.
constexpr double kConnectivity = 0.5;

using Numbers = std::vector<uint32_t>;
using Keys = std::vector<uint64_t>;

Keys sorted_set(Keys keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

uint32_t place_of(const Keys& set, uint64_t key) {
  return uint32_t(std::lower_bound(set.begin(), set.end(), key) - set.begin());
}

// Do two triangles pass an edge in one direction?
bool repeats_edge(const Triangles& triangles) {
  Keys edges;
  for (size_t i = 0; i < triangles.size(); i++) {
    const uint32_t next = triangles[i % 3 == 2 ? i - 2 : i + 1];
    edges.push_back(uint64_t(triangles[i]) << 32 | next);
  }
  return sorted_set(edges).size() < edges.size();
}

// A group with local numbers, for the encoder.
struct LocalGroup {
  Numbers triangles, position_ids;
  std::vector<float> positions;
  std::vector<Numbers> values;  // of each stream

  // layers: of each triangle. Each has its own vertices.
  LocalGroup(const PagePilot& pilot, const Triangles& global, const Numbers& layers) {
    Keys keys, ids;
    for (size_t i = 0; i < global.size(); i++)
      keys.push_back(uint64_t(layers[i / 3]) << 32 | global[i]);
    const Keys vertices = sorted_set(keys);
    const auto id_of = [&](uint64_t key) {
      return key >> 32 << 32 | pilot.surface.position_ids[uint32_t(key)];
    };
    for (uint64_t key : vertices) ids.push_back(id_of(key));
    ids = sorted_set(std::move(ids));
    for (uint64_t key : keys) triangles.push_back(place_of(vertices, key));
    values.resize(pilot.streams.size());
    for (uint64_t key : vertices) {
      position_ids.push_back(place_of(ids, id_of(key)));
      const float* p = pilot.surface.points + 3 * size_t(uint32_t(key));
      positions.insert(positions.end(), p, p + 3);
      for (uint32_t s = 0; s < values.size(); s++) {
        const uint32_t* v = pilot.values.of(s, uint32_t(key));
        values[s].insert(values[s].end(), v, v + pilot.streams[s].elements);
      }
    }
  }
};

// Joins groups of less than half of `size` clusters along the curve, up to `largest`.
Groups join_small(const Groups& groups, uint32_t size, double largest) {
  Groups result;
  size_t small = SIZE_MAX;  // the last group that is too small
  const auto is_small = [&](size_t g) { return 2 * result[g].size() < size; };
  for (const Numbers& group : groups) {
    for (size_t first = 0; first < group.size(); first += kMostClusters) {
      const size_t last = std::min(group.size(), first + kMostClusters);
      const auto from = group.begin() + std::ptrdiff_t(first);
      const auto to = group.begin() + std::ptrdiff_t(last);
      if (small != SIZE_MAX && double(result[small].size() + last - first) <= largest) {
        result[small].insert(result[small].end(), from, to);
      } else {
        result.emplace_back(from, to);
        if (is_small(result.size() - 1)) small = result.size() - 1;
      }
      if (small != SIZE_MAX && !is_small(small)) small = SIZE_MAX;
    }
  }
  return result;
}

// Groups clusters, about `size` in a group. The partitioner joins only clusters that share
// vertices. Groups that are too small are therefore joined along the curve.
Groups partition(const ClusterSet& clusters, uint32_t size, const Surface& surface,
                 const Simplifier& simplifier) {
  const ClusterRanges& ranges = clusters.ranges;
  const double largest = std::min(size * kLargest, double(kMostClusters));
  Groups groups(1);
  groups[0].resize(ranges.count());
  std::iota(groups[0].begin(), groups[0].end(), 0);
  if (double(ranges.count()) <= largest) return groups;
  Numbers corners(ranges.triangles), counts, group_of(ranges.count());
  for (uint32_t& v : corners) v = surface.position_ids[v];
  for (size_t c = 0; c < ranges.count(); c++) counts.push_back(3 * ranges.size(c));
  const size_t count =
      simplifier.partition(group_of.data(), corners.data(), corners.size(), counts.data(),
                           counts.size(), surface.vertex_of_position.size(), size);
  groups.assign(count, {});
  for (size_t c = 0; c < ranges.count(); c++)
    if (group_of[c] < count) groups[group_of[c]].push_back(uint32_t(c));
  const auto is_empty = [](const Numbers& group) { return group.empty(); };
  groups.erase(std::remove_if(groups.begin(), groups.end(), is_empty), groups.end());
  std::vector<Vec3> middles;
  for (const Numbers& group : groups) {
    Vec3d sum{0, 0, 0};
    for (uint32_t c : group) sum = sum + clusters.clusters[c].sphere.centre;
    const Vec3d middle = sum / double(group.size());
    middles.push_back({float(middle.x), float(middle.y), float(middle.z)});
  }
  Groups on_curve;
  for (uint32_t g : order_in_box(middles, kCurveCells)) on_curve.push_back(std::move(groups[g]));
  return join_small(on_curve, size, largest);
}

// The next size of groups to try, if the largest group must shrink to this fraction.
uint32_t shrunk_size(uint32_t size, double fraction) {
  const uint32_t smaller = std::min(uint32_t(kTighter * fraction * size), size - 1);
  return std::max(smaller, kSmallestGroup);
}

}  // namespace

double PagePilot::page_fraction(const ClusterSet& clusters,
                                const std::vector<uint32_t>& group) const {
  ClusterRanges own;
  Numbers layers;
  for (uint32_t c : group) {
    own.append(clusters.ranges, c);
    layers.resize(own.triangle_count(), uint32_t(clusters.clusters[c].finer_group + 1));
  }
  const size_t triangles = own.triangle_count();
  Keys vertices(own.triangles.begin(), own.triangles.end());
  double bits = 0;
  for (const Stream& stream : streams) bits += double(stream.elements) * double(stream.bits);
  const double most =
      double(sorted_set(std::move(vertices)).size()) * bits / 8 + kConnectivity * double(triangles);
  if (most < double(page_bytes)) return 0;
  // As the levels' pages: a replacement with an edge that its level has already has its own
  // vertices.
  if (!repeats_edge(own.triangles)) layers.assign(triangles, 0);
  const LocalGroup local(*this, own.triangles, layers);
  const MeshView mesh{local.triangles.data(), triangles, local.position_ids.data(),
                      local.positions.data(), local.position_ids.size()};
  Meshlets given;
  given.triangles.resize(triangles);
  std::iota(given.triangles.begin(), given.triangles.end(), 0);
  given.disk_begin = own.disk_begin;
  given.meshlet_begin = own.cluster_begin;
  VertexValues local_values;
  local_values.elements = values.elements;
  for (const Numbers& list : local.values) local_values.values.push_back(list.data());
  EncodeOptions options;
  options.threads = 1;
  EncoderStats stats;
  const std::vector<Bytes> blobs =
      encode_given(mesh, given, {0, given.count()}, streams, local_values, options, 0, stats);
  return double(blobs[0].size()) / double(page_bytes);
}

Groups group_clusters(const ClusterSet& clusters, uint32_t size, const PagePilot& pilot,
                      const Simplifier& simplifier, int threads) {
  for (;;) {
    Groups groups = partition(clusters, size, pilot.surface, simplifier);
    if (pilot.page_bytes == 0 || size <= kSmallestGroup) return groups;
    std::vector<double> fractions(groups.size());
    parallel_for(threads, groups.size(),
                 [&](size_t g) { fractions[g] = pilot.page_fraction(clusters, groups[g]); });
    const double fraction = *std::max_element(fractions.begin(), fractions.end());
    if (fraction <= 1) return groups;
    size = shrunk_size(size, 1 / fraction);
  }
}

Groups join_empty(const Groups& groups, const std::vector<uint32_t>& triangles) {
  Groups result;
  bool is_empty = false;
  for (size_t g = 0; g < groups.size(); g++) {
    if (!result.empty() && (triangles[g] == 0 || is_empty)) {
      result.back().insert(result.back().end(), groups[g].begin(), groups[g].end());
      is_empty = is_empty && triangles[g] == 0;
    } else {
      result.push_back(groups[g]);
      is_empty = triangles[g] == 0;
    }
  }
  return result;
}

}  // namespace gltf_meshlet_codec

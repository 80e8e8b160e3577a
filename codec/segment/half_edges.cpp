#include "segment/half_edges.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "common/parallel.h"

namespace meshlet {
namespace {

// Buckets up to this size are searched one by one; larger ones are sorted.
constexpr std::ptrdiff_t kSmallBucket = 32;

// Fewest half-edges per thread: each thread reads all of them.
constexpr size_t kLeastPerThread = 1 << 14;

// Parts of the vertices per thread, in the second half.
constexpr size_t kPartsPerThread = 8;

// Half-edges in buckets by the lower of their two ends: both sides of an edge are in one bucket.
//
// Ends: from(i) and to(i) of the i-th half-edge, below id_count; equal ends are left out.
template <class Ends>
class Buckets {
 public:
  Buckets(const Ends& ends, size_t count, size_t id_count, int threads)
      : ends_(ends),
        id_count_(id_count),
        threads_(threads),
        ranges_(std::clamp<size_t>(count / kLeastPerThread, 1, size_t(resolve_threads(threads)))),
        begin_(id_count + 2, 0) {
    fill(count);
  }

  // Calls body for every pair of opposite half-edges, once.
  template <class Body>
  void match(Body&& body) {
    const size_t parts = ranges_ == 1 ? 1 : kPartsPerThread * ranges_;
    parallel_for(threads_, parts, [&](size_t p) {
      for (size_t v = id_count_ * p / parts; v < id_count_ * (p + 1) / parts; v++)
        match_bucket(&entries_[begin_[v]], &entries_[begin_[v + 1]], body);
    });
  }

 private:
  struct Entry {
    uint32_t higher;  // end, or kNone
    uint32_t item;    // 2 i + whether the i-th half-edge ends at the lower end
  };
  static constexpr uint32_t kNone = ~0u;

  uint32_t first_of(size_t range) const { return uint32_t(id_count_ * range / ranges_); }

  // Calls body(lower, entry) for the half-edges of a range of vertices. Each thread reads all.
  template <class Body>
  void for_range(size_t range, size_t count, Body&& body) const {
    const uint32_t first = first_of(range), size = first_of(range + 1) - first;
    for (size_t i = 0; i < count; i++) {
      const uint32_t from = ends_.from(i), to = ends_.to(i), lower = std::min(from, to);
      if (lower - first < size && from != to)
        body(lower, Entry{std::max(from, to), uint32_t(2 * i + (to < from))});
    }
  }

  void fill(size_t count) {
    // begin_[v + 1] first counts bucket v, then is its begin, and after filling its end.
    parallel_for(threads_, ranges_, [&](size_t r) {
      for_range(r, count, [&](uint32_t lower, Entry) { ++begin_[lower + 2]; });
    });
    for (size_t i = 2; i < begin_.size(); i++) begin_[i] += begin_[i - 1];
    entries_.reset(new Entry[begin_.back() + 1]);
    parallel_for(threads_, ranges_, [&](size_t r) {
      for_range(r, count,
                [&](uint32_t lower, Entry entry) { entries_[begin_[lower + 1]++] = entry; });
    });
  }

  // Calls body for every two entries with the same ends, and no third.
  template <class Body>
  static void match_bucket(Entry* begin, Entry* end, Body&& body) {
    if (end - begin > kSmallBucket) return match_sorted(begin, end, body);
    for (Entry* entry = begin; entry < end; entry++) {
      if (entry->higher == kNone) continue;
      Entry* other = find(entry + 1, end, entry->higher);
      if (other == end) continue;
      if (find(other + 1, end, entry->higher) == end) body_of_two(*entry, *other, body);
      for (; other < end; other = find(other + 1, end, entry->higher)) other->higher = kNone;
    }
  }

  template <class Body>
  static void match_sorted(Entry* begin, Entry* end, Body&& body) {
    std::sort(begin, end, [](const Entry& a, const Entry& b) { return a.higher < b.higher; });
    for (Entry* entry = begin; entry < end;) {
      Entry* next = entry + 1;
      while (next < end && next->higher == entry->higher) next++;
      if (next - entry == 2) body_of_two(entry[0], entry[1], body);
      entry = next;
    }
  }

  static Entry* find(Entry* entry, Entry* end, uint32_t higher) {
    while (entry < end && entry->higher != higher) entry++;
    return entry;
  }

  // Unless they run the same way.
  template <class Body>
  static void body_of_two(const Entry& a, const Entry& b, Body&& body) {
    if ((a.item ^ b.item) & 1) body(a.item / 2, b.item / 2);
  }

  const Ends& ends_;
  const size_t id_count_;
  const int threads_;
  const size_t ranges_;  // of vertices, one for each thread
  std::vector<uint32_t> begin_;
  std::unique_ptr<Entry[]> entries_;
};

// All half-edges of a mesh by vertex.
struct VertexEnds {
  const uint32_t* triangles;
  uint32_t from(size_t i) const { return triangles[i]; }
  uint32_t to(size_t i) const { return triangles[next_in_triangle(uint32_t(i))]; }
};

// Some half-edges of a mesh by position.
struct PositionEnds {
  const MeshView& mesh;
  const std::vector<uint32_t>& half_edges;
  uint32_t from(size_t i) const { return mesh.position_ids[mesh.triangles[half_edges[i]]]; }
  uint32_t to(size_t i) const {
    return mesh.position_ids[mesh.triangles[next_in_triangle(half_edges[i])]];
  }
};

// The half-edges without an opposite one.
std::vector<uint32_t> find_open(const std::vector<int32_t>& opposite, int threads) {
  constexpr size_t kBlock = 1 << 17;  // half-edges per parallel item
  std::vector<std::vector<uint32_t>> of_block((opposite.size() + kBlock - 1) / kBlock);
  parallel_for(threads, of_block.size(), [&](size_t b) {
    const size_t end = std::min(opposite.size(), (b + 1) * kBlock);
    for (size_t h = b * kBlock; h < end; h++)
      if (opposite[h] < 0) of_block[b].push_back(uint32_t(h));
  });
  std::vector<uint32_t> open;
  for (const std::vector<uint32_t>& block : of_block)
    open.insert(open.end(), block.begin(), block.end());
  return open;
}

}  // namespace

HalfEdges match_half_edges(const MeshView& mesh, int threads) {
  std::vector<int32_t> opposite(3 * mesh.triangle_count, HalfEdges::kNone);
  const VertexEnds all{mesh.triangles};
  Buckets(all, opposite.size(), mesh.vertex_count, threads).match([&](uint32_t a, uint32_t b) {
    if (a / 3 == b / 3) return;
    opposite[a] = int32_t(b);
    opposite[b] = int32_t(a);
  });
  const std::vector<uint32_t> open = find_open(opposite, threads);
  if (open.empty()) return HalfEdges(std::move(opposite));
  const PositionEnds by_position{mesh, open};
  Buckets(by_position, open.size(), mesh.vertex_count, threads).match([&](uint32_t a, uint32_t b) {
    if (open[a] / 3 == open[b] / 3) return;
    opposite[open[a]] = HalfEdges::kByPosition - int32_t(open[b]);
    opposite[open[b]] = HalfEdges::kByPosition - int32_t(open[a]);
  });
  return HalfEdges(std::move(opposite));
}

}  // namespace meshlet

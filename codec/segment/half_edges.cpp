#include "segment/half_edges.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "common/parallel.h"

namespace meshlet {
namespace {

// Buckets up to this size are searched one by one; larger ones are sorted.
constexpr uint32_t kSmallBucket = 32;

// Fewest half-edges per thread: each thread reads all of them.
constexpr size_t kLeastPerThread = 1 << 14;

// Parts of the vertices per thread, in the second half.
constexpr size_t kPartsPerThread = 8;

// Where half-edges go, in buckets by where they start.
//
// Ends: from(i) and to(i) of the i-th half-edge, below id_count; equal ends are left out.
template <class Ends>
class Buckets {
 public:
  struct Found {
    uint32_t count;  // 2: or more
    uint32_t item;   // one of them
  };

  Buckets(const Ends& ends, size_t count, size_t id_count, int threads)
      : ends_(ends),
        id_count_(id_count),
        threads_(threads),
        ranges_(std::clamp<size_t>(count / kLeastPerThread, 1, size_t(resolve_threads(threads)))),
        begin_(id_count + 2, 0) {
    fill(count);
    sort_large();
  }

  // Calls body(item, opposite) for every half-edge that has an opposite one; `may_match` says
  // whether two half-edges can be opposite.
  template <class MayMatch, class Body>
  void match(MayMatch&& may_match, Body&& body) const {
    for_vertices([&](uint32_t from, uint32_t begin, uint32_t end) {
      for (uint32_t i = begin; i < end; i++) {
        const Found other = find(to_[i], from);
        if (other.count == 1 && may_match(item_[i], other.item) && find(from, to_[i]).count == 1)
          body(item_[i], other.item);
      }
    });
  }

 private:
  uint32_t first_of(size_t range) const { return uint32_t(id_count_ * range / ranges_); }

  void fill(size_t count) {
    // begin_[v + 1] first counts bucket v, then is its begin, and after filling its end.
    parallel_for(threads_, ranges_, [&](size_t r) {
      const uint32_t first = first_of(r), size = first_of(r + 1) - first;
      for (size_t i = 0; i < count; i++) {
        const uint32_t from = ends_.from(i);
        if (from - first < size && from != ends_.to(i)) ++begin_[from + 2];
      }
    });
    for (size_t i = 2; i < begin_.size(); i++) begin_[i] += begin_[i - 1];
    to_.reset(new uint32_t[begin_.back()]);
    item_.reset(new uint32_t[begin_.back()]);
    parallel_for(threads_, ranges_, [&](size_t r) {
      const uint32_t first = first_of(r), size = first_of(r + 1) - first;
      for (size_t i = 0; i < count; i++) {
        const uint32_t from = ends_.from(i), to = ends_.to(i);
        if (from - first >= size || from == to) continue;
        const uint32_t place = begin_[from + 1]++;
        to_[place] = to;
        item_[place] = uint32_t(i);
      }
    });
  }

  // Calls body(vertex, begin, end of its bucket).
  template <class Body>
  void for_vertices(Body&& body) const {
    const size_t parts = ranges_ == 1 ? 1 : kPartsPerThread * ranges_;
    parallel_for(threads_, parts, [&](size_t p) {
      for (size_t v = id_count_ * p / parts; v < id_count_ * (p + 1) / parts; v++)
        body(uint32_t(v), begin_[v], begin_[v + 1]);
    });
  }

  void sort_large() {
    for_vertices([&](uint32_t, uint32_t begin, uint32_t end) {
      if (end - begin <= kSmallBucket) return;
      std::vector<std::pair<uint32_t, uint32_t>> bucket;
      for (uint32_t i = begin; i < end; i++) bucket.emplace_back(to_[i], item_[i]);
      std::sort(bucket.begin(), bucket.end());
      for (const auto& [to, item] : bucket) {
        to_[begin] = to;
        item_[begin++] = item;
      }
    });
  }

  // The half-edges from one vertex to another.
  Found find(uint32_t from, uint32_t to) const {
    const uint32_t begin = begin_[from], end = begin_[from + 1];
    Found found{0, 0};
    if (end - begin <= kSmallBucket) {
      for (uint32_t i = begin; i < end; i++) {
        const bool equal = to_[i] == to;
        found.count += equal;
        found.item = equal ? item_[i] : found.item;
      }
      return found;
    }
    const uint32_t *first = to_.get() + begin, *last = to_.get() + end;
    const uint32_t* at = std::lower_bound(first, last, to);
    if (at == last || *at != to) return found;
    return {at + 1 < last && at[1] == to ? 2u : 1u, item_[at - to_.get()]};
  }

  const Ends& ends_;
  const size_t id_count_;
  const int threads_;
  const size_t ranges_;  // of vertices, one for each thread
  std::vector<uint32_t> begin_;
  std::unique_ptr<uint32_t[]> to_, item_;
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

}  // namespace

HalfEdges match_half_edges(const MeshView& mesh, int threads) {
  std::vector<int32_t> opposite(3 * mesh.triangle_count, HalfEdges::kNone);
  const VertexEnds all{mesh.triangles};
  Buckets(all, opposite.size(), mesh.vertex_count, threads)
      .match([](uint32_t a, uint32_t b) { return a / 3 != b / 3; },
             [&](uint32_t h, uint32_t other) { opposite[h] = int32_t(other); });
  std::vector<uint32_t> open;
  for (uint32_t h = 0; h < opposite.size(); h++)
    if (opposite[h] < 0) open.push_back(h);
  if (open.empty()) return HalfEdges(std::move(opposite));
  const PositionEnds by_position{mesh, open};
  Buckets(by_position, open.size(), mesh.vertex_count, threads)
      .match([&](uint32_t a, uint32_t b) { return open[a] / 3 != open[b] / 3; },
             [&](uint32_t i, uint32_t other) {
               opposite[open[i]] = HalfEdges::kByPosition - int32_t(open[other]);
             });
  return HalfEdges(std::move(opposite));
}

}  // namespace meshlet

#include "segment/half_edges.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "common/parallel.h"

namespace gltf_meshlet_codec {
namespace {

// Up to this many half-edges are searched one by one; more are sorted.
constexpr std::ptrdiff_t kSmallBucket = 32;

// Half-edges per block. A thread skips the blocks that have no vertex of its range: in a mesh that
// is sorted in space, most.
constexpr size_t kBlock = 3 << 10;

// Fewest half-edges per thread.
constexpr size_t kLeastPerThread = 1 << 14;

// Blocks of vertices per thread, when buckets are matched.
constexpr size_t kBlocksPerThread = 8;

// Half-edges in buckets by the lower of their two ends: both sides of an edge are in one bucket.
// A bucket is a list that is linked through `opposite`, until its half-edges are matched.
//
// Ends: count(), half_edge(i) for i < count(), and id(v), a number below the mesh's vertex count
// for vertex v. Half-edges whose ends have equal ids are left out.
template <class Ends>
class Buckets {
 public:
  // opposite: of all half-edges. Those of Ends become kNone.
  Buckets(const MeshView& mesh, const Ends& ends, int32_t* opposite, int threads)
      : mesh_(mesh),
        ends_(ends),
        opposite_(opposite),
        threads_(threads),
        ranges_(std::clamp<size_t>(ends.count() / kLeastPerThread, 1,
                                   size_t(resolve_threads(threads)))),
        first_(new int32_t[mesh.vertex_count]) {
    fill();
  }

  // Calls body for every pair of opposite half-edges, once.
  template <class Body>
  void match(Body&& body) {
    const size_t blocks = ranges_ == 1 ? 1 : kBlocksPerThread * ranges_;
    parallel_for(threads_, blocks, [&](size_t b) {
      std::vector<Entry> bucket;
      for (size_t v = mesh_.vertex_count * b / blocks; v < mesh_.vertex_count * (b + 1) / blocks;
           v++) {
        take(first_[v], bucket);
        match_bucket(bucket.data(), bucket.data() + bucket.size(), body);
      }
    });
  }

 private:
  struct Entry {
    uint32_t higher;  // end, or kTaken
    uint32_t half_edge;
    bool falls;  // it ends at the lower end
  };
  static constexpr uint32_t kTaken = ~0u;

  uint32_t from(uint32_t half_edge) const { return ends_.id(mesh_.triangles[half_edge]); }
  uint32_t to(uint32_t half_edge) const { return from(next_in_triangle(half_edge)); }
  uint32_t first_of(size_t range) const { return uint32_t(mesh_.vertex_count * range / ranges_); }

  // The least and the greatest lower end of a block's half-edges.
  struct Extent {
    uint32_t low, high;
  };
  std::vector<Extent> measure_blocks() const {
    std::vector<Extent> extents(block_count(ends_.count(), kBlock), Extent{0, ~0u});
    if (ranges_ == 1) return extents;
    parallel_for(threads_, ranges_, [&](size_t r) {
      for (size_t b = extents.size() * r / ranges_; b < extents.size() * (r + 1) / ranges_; b++) {
        Extent extent{~0u, 0};
        for (size_t i = b * kBlock; i < std::min((b + 1) * kBlock, ends_.count()); i++) {
          const uint32_t half_edge = ends_.half_edge(i);
          const uint32_t lower = std::min(from(half_edge), to(half_edge));
          extent = {std::min(extent.low, lower), std::max(extent.high, lower)};
        }
        extents[b] = extent;
      }
    });
    return extents;
  }

  // Each thread fills the buckets of a range of vertices.
  void fill() {
    const std::vector<Extent> extents = measure_blocks();
    parallel_for(threads_, ranges_, [&](size_t r) {
      const uint32_t first = first_of(r), last = first_of(r + 1);
      std::fill(&first_[first], &first_[last], HalfEdges::kNone);
      for (size_t b = 0; b < extents.size(); b++)
        if (extents[b].low < last && extents[b].high >= first) fill_from(b, first, last);
    });
  }

  void fill_from(size_t block, uint32_t first, uint32_t last) {
    for (size_t i = block * kBlock; i < std::min((block + 1) * kBlock, ends_.count()); i++) {
      const uint32_t half_edge = ends_.half_edge(i), a = from(half_edge), b = to(half_edge);
      const uint32_t lower = std::min(a, b);
      if (lower - first >= last - first) continue;
      opposite_[half_edge] =
          a == b ? HalfEdges::kNone : std::exchange(first_[lower], int32_t(half_edge));
    }
  }

  // Moves the half-edges of a list to a bucket.
  void take(int32_t list, std::vector<Entry>& bucket) const {
    bucket.clear();
    while (list != HalfEdges::kNone) {
      const uint32_t half_edge = uint32_t(list), a = from(half_edge), b = to(half_edge);
      bucket.push_back({std::max(a, b), half_edge, b < a});
      list = std::exchange(opposite_[half_edge], HalfEdges::kNone);
    }
  }

  // Calls body for every two entries with the same ends, and no third.
  template <class Body>
  static void match_bucket(Entry* begin, Entry* end, Body&& body) {
    if (end - begin > kSmallBucket) return match_sorted(begin, end, body);
    for (Entry* entry = begin; entry < end; entry++) {
      if (entry->higher == kTaken) continue;
      Entry* other = find(entry + 1, end, entry->higher);
      if (other == end) continue;
      if (find(other + 1, end, entry->higher) == end) body_of_two(*entry, *other, body);
      for (; other < end; other = find(other + 1, end, entry->higher)) other->higher = kTaken;
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

  // Unless they run the same way, or in one triangle.
  template <class Body>
  static void body_of_two(const Entry& a, const Entry& b, Body&& body) {
    if (a.falls != b.falls && a.half_edge / 3 != b.half_edge / 3) body(a.half_edge, b.half_edge);
  }

  const MeshView& mesh_;
  const Ends& ends_;
  int32_t* const opposite_;
  const int threads_;
  const size_t ranges_;               // of vertices, one for each thread
  std::unique_ptr<int32_t[]> first_;  // half-edge of each vertex's bucket
};

// All half-edges by vertex.
struct VertexEnds {
  size_t half_edges;
  size_t count() const { return half_edges; }
  uint32_t half_edge(size_t i) const { return uint32_t(i); }
  uint32_t id(uint32_t vertex) const { return vertex; }
};

// Some half-edges by position.
struct PositionEnds {
  const std::vector<uint32_t>& half_edges;
  const uint32_t* position_ids;
  size_t count() const { return half_edges.size(); }
  uint32_t half_edge(size_t i) const { return half_edges[i]; }
  uint32_t id(uint32_t vertex) const { return position_ids[vertex]; }
};

// The half-edges without an opposite one.
std::vector<uint32_t> find_open(const Array<int32_t>& opposite, int threads) {
  constexpr size_t kBlock = 1 << 17;  // half-edges per parallel item
  std::vector<std::vector<uint32_t>> of_block(block_count(opposite.size(), kBlock));
  for_blocks(threads, opposite.size(), kBlock, [&](size_t b, size_t first, size_t last) {
    for (size_t h = first; h < last; h++)
      if (opposite[h] < 0) of_block[b].push_back(uint32_t(h));
  });
  std::vector<uint32_t> open;
  for (const std::vector<uint32_t>& block : of_block)
    open.insert(open.end(), block.begin(), block.end());
  return open;
}

}  // namespace

HalfEdges match_half_edges(const MeshView& mesh, int threads) {
  Array<int32_t> opposite(3 * mesh.triangle_count);
  const VertexEnds all{opposite.size()};
  Buckets(mesh, all, opposite.data(), threads).match([&](uint32_t a, uint32_t b) {
    opposite[a] = int32_t(b);
    opposite[b] = int32_t(a);
  });
  const std::vector<uint32_t> open = find_open(opposite, threads);
  if (open.empty()) return HalfEdges(std::move(opposite));
  const PositionEnds by_position{open, mesh.position_ids};
  Buckets(mesh, by_position, opposite.data(), threads).match([&](uint32_t a, uint32_t b) {
    opposite[a] = HalfEdges::kByPosition - int32_t(b);
    opposite[b] = HalfEdges::kByPosition - int32_t(a);
  });
  return HalfEdges(std::move(opposite));
}

}  // namespace gltf_meshlet_codec

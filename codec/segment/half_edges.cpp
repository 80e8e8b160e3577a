#include "segment/half_edges.h"

#include <algorithm>

#include "common/parallel.h"

namespace meshlet {
namespace {

// A half-edge in the bucket of the smaller of its two ends.
struct Entry {
  uint32_t larger_end;
  uint32_t half_edge;  // top bit: it runs from the larger end to the smaller
};
constexpr uint32_t kDescending = 1u << 31;

// Buckets up to this size are matched by comparing all pairs; larger ones are sorted.
constexpr size_t kSmallBucket = 24;

void match_pair(const Entry& a, const Entry& b, int32_t* match) {
  const uint32_t ha = a.half_edge & ~kDescending, hb = b.half_edge & ~kDescending;
  if (((a.half_edge ^ b.half_edge) & kDescending) == 0 || ha / 3 == hb / 3) return;
  match[ha] = int32_t(hb);
  match[hb] = int32_t(ha);
}

void match_small_bucket(const Entry* bucket, size_t size, int32_t* match) {
  for (size_t i = 0; i < size; i++) {
    size_t uses = 0, other = 0;
    for (size_t j = 0; j < size; j++)
      if (j != i && bucket[j].larger_end == bucket[i].larger_end) ++uses, other = j;
    if (uses == 1 && other > i) match_pair(bucket[i], bucket[other], match);
  }
}

void match_large_bucket(Entry* bucket, size_t size, int32_t* match) {
  std::sort(bucket, bucket + size, [](const Entry& a, const Entry& b) {
    return a.larger_end != b.larger_end ? a.larger_end < b.larger_end : a.half_edge < b.half_edge;
  });
  for (size_t i = 0, end; i < size; i = end) {
    for (end = i + 1; end < size && bucket[end].larger_end == bucket[i].larger_end;) ++end;
    if (end - i == 2) match_pair(bucket[i], bucket[i + 1], match);
  }
}

// Calls visit(smaller end, larger end, half-edge with direction bit) for all half-edges whose
// smaller end is in [first, last).
template <class Visit>
void visit_half_edges(const uint32_t* triangles, size_t triangle_count, const uint32_t* ids,
                      uint32_t first, uint32_t last, Visit&& visit) {
  for (size_t t = 0; t < triangle_count; t++) {
    uint32_t corner[3];
    for (int k = 0; k < 3; k++) corner[k] = ids ? ids[triangles[3 * t + k]] : triangles[3 * t + k];
    for (int k = 0; k < 3; k++) {
      const uint32_t from = corner[k], to = corner[k == 2 ? 0 : k + 1];
      const uint32_t smaller = std::min(from, to);
      if (smaller < first || smaller >= last || from == to) continue;
      const uint32_t half_edge = uint32_t(3 * t + k);
      visit(smaller, std::max(from, to), from < to ? half_edge : half_edge | kDescending);
    }
  }
}

void match_range(const uint32_t* triangles, size_t triangle_count, const uint32_t* ids,
                 uint32_t first, uint32_t last, int32_t* match) {
  // end[i + 1] first counts bucket i, then is its begin, and after filling its end.
  std::vector<uint32_t> end(size_t(last - first) + 2, 0);
  visit_half_edges(triangles, triangle_count, ids, first, last,
                   [&](uint32_t smaller, uint32_t, uint32_t) { ++end[smaller - first + 2]; });
  for (size_t i = 2; i < end.size(); i++) end[i] += end[i - 1];
  std::vector<Entry> entries(end.back());
  visit_half_edges(triangles, triangle_count, ids, first, last,
                   [&](uint32_t smaller, uint32_t larger, uint32_t half_edge) {
                     entries[end[smaller - first + 1]++] = {larger, half_edge};
                   });
  for (uint32_t i = 0; i < last - first; i++) {
    Entry* bucket = entries.data() + end[i];
    const size_t size = end[i + 1] - end[i];
    if (size <= kSmallBucket)
      match_small_bucket(bucket, size, match);
    else
      match_large_bucket(bucket, size, match);
  }
}

}  // namespace

std::vector<int32_t> match_half_edges(const uint32_t* triangles, size_t triangle_count,
                                      const uint32_t* ids, size_t id_count, int threads) {
  std::vector<int32_t> match(3 * triangle_count, -1);
  // Every range reads all triangles: use no more ranges than threads.
  const size_t ranges =
      std::min<size_t>(resolve_threads(threads), std::max<size_t>(1, triangle_count / 4096));
  parallel_for(threads, ranges, [&](size_t r) {
    match_range(triangles, triangle_count, ids, uint32_t(id_count * r / ranges),
                uint32_t(id_count * (r + 1) / ranges), match.data());
  });
  return match;
}

}  // namespace meshlet

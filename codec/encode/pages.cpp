#include "encode/pages.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <stdexcept>

#include "common/hash_map.h"
#include "common/parallel.h"
#include "encode/page_growth.h"
#include "segment/check_meshlets.h"

namespace meshlet {
namespace {

// Some meshlets of a mesh as a mesh of their own.
struct Part {
  Part(const MeshView& mesh, const Meshlets& all, const VertexValues& all_values,
       const std::vector<uint32_t>& numbers);

  MeshView view() const {
    return {triangles.data(), triangles.size() / 3, position_ids.data(), nullptr,
            position_ids.size()};
  }

  std::vector<uint32_t> triangles, position_ids, rows;
  VertexValues values;
  Meshlets meshlets;
};

Part::Part(const MeshView& mesh, const Meshlets& all, const VertexValues& all_values,
           const std::vector<uint32_t>& numbers) {
  const size_t most = numbers.size() * MESHLET_VERTICES;
  LocalNumbers vertices(most + 3);  // before the check of a caller's meshlets
  meshlets.meshlet_begin.push_back(0);
  meshlets.disk_begin.push_back(0);
  for (uint32_t m : numbers) {
    for (uint32_t k = all.meshlet_begin[m]; k < all.meshlet_begin[m + 1]; k++) {
      for (uint32_t i = all.disk_begin[k]; i < all.disk_begin[k + 1]; i++) {
        const uint32_t* corner = mesh.triangles + 3 * size_t(all.triangles[i]);
        meshlets.triangles.push_back(uint32_t(meshlets.triangles.size()));
        for (int c = 0; c < 3; c++) triangles.push_back(vertices.of(corner[c]));
        if (vertices.numbers().size() > most) throw std::invalid_argument(kTooManyVertices);
      }
      meshlets.disk_begin.push_back(uint32_t(meshlets.triangles.size()));
    }
    meshlets.meshlet_begin.push_back(uint32_t(meshlets.disk_begin.size() - 1));
  }
  LocalNumbers ids(vertices.numbers().size());
  for (uint32_t v : vertices.numbers()) {
    position_ids.push_back(ids.of(mesh.position_ids[v]));
    rows.push_back(all_values.rows ? all_values.rows[v] : v);
  }
  values = all_values;
  values.rows = rows.data();
}

// Encodes pages of one mesh's meshlets. Several threads may use it.
class PageEncoder {
 public:
  // meshlets: with valid lists; check: whether they come from a caller, who may not know disks.
  PageEncoder(const MeshView& mesh, const Meshlets& meshlets, const VertexValues& values,
              const std::vector<Stream>& streams, const EncodeOptions& options, bool check)
      : mesh_(mesh),
        meshlets_(meshlets),
        values_(values),
        streams_(streams),
        options_(options),
        check_(check) {
    options_.progress = nullptr;
    options_.threads = 1;  // one page on each thread
  }

  // Encodes meshlets, in this order.
  std::vector<uint8_t> encode(const std::vector<uint32_t>& numbers, EncoderStats& stats) const {
    const Part part(mesh_, meshlets_, values_, numbers);
    const MeshView view = part.view();
    const HalfEdges half_edges = match_half_edges(view, options_.threads);
    if (check_) check_disks(view, half_edges, part.meshlets);
    return encode_meshlets({view, half_edges, part.meshlets, part.values}, streams_, options_,
                           stats);
  }

  uint32_t triangles(uint32_t m) const {
    const Meshlets& all = meshlets_;
    return all.disk_begin[all.meshlet_begin[m + 1]] - all.disk_begin[all.meshlet_begin[m]];
  }

 private:
  const MeshView mesh_;
  const Meshlets& meshlets_;
  const VertexValues values_;
  const std::vector<Stream>& streams_;
  EncodeOptions options_;
  const bool check_;
};

// Adds what a page's blob has, and the time it took.
void add(EncoderStats& to, const EncoderStats& from) {
  to.meshlets += from.meshlets;
  to.vertices += from.vertices;
  to.bits.add(from.bits);
  to.add_seconds(from);
}

// Shares of the limit: the estimated size that a page is grown to, and the least of a page that
// another meshlet would still fit. Sizes are some 3 % off their estimates on scans, 20 % on scenes.
constexpr double kAim = 0.975, kFull = 0.94;
constexpr size_t kMostAtOnce = 16;  // pages that are encoded in parallel; changes the result
constexpr double kFirstRate = 4;    // bytes per triangle: only where the first search starts

// A page: its first `count` meshlets in the order of growth, encoded.
struct Page {
  std::vector<uint32_t> meshlets;
  size_t count = 0;
  std::vector<uint8_t> blob;
  EncoderStats stats;
};

// Makes pages of at most `limit` bytes.
class PageMaker {
 public:
  PageMaker(const PageEncoder& encoder, PageGrowth& growth, size_t limit, int threads)
      : encoder_(encoder), growth_(growth), limit_(limit), threads_(threads) {}

  bool done() const { return !growth_.any_free(); }

  // Some pages more. Encodes several at once while their sizes are near the estimates: the number
  // of threads must not change the result, so that it does not change how many.
  std::vector<Page> next() {
    if (at_once_ == 1) {
      at_once_ = 2;
      std::vector<Page> pages;
      pages.push_back(fullest());
      return pages;
    }
    std::vector<Page> pages = grow_several();
    parallel_for(threads_, pages.size(), [&](size_t p) { encode_fitting(pages[p]); });
    return accept(std::move(pages));
  }

 private:
  void encode(Page& page) const {
    // In the order of their numbers, neighbours are close.
    std::vector<uint32_t> numbers(page.meshlets.begin(), page.meshlets.begin() + page.count);
    std::sort(numbers.begin(), numbers.end());
    page.stats = {};
    page.blob = encoder_.encode(numbers, page.stats);
  }

  bool fits(const Page& page) const { return page.blob.size() <= limit_ || page.count == 1; }
  // Whether it is full, or too full for another meshlet.
  bool full(const Page& page) const {
    const double size = double(page.blob.size());
    return size >= kFull * double(limit_) || size + size / double(page.count) > double(limit_);
  }

  double rate_of(const Page& page) const {
    double triangles = 0;
    for (size_t i = 0; i < page.count; i++) triangles += encoder_.triangles(page.meshlets[i]);
    return double(page.blob.size()) / triangles;
  }

  // Adds meshlets until the estimate reaches `bytes`, or none is free.
  void grow(Page& page, double bytes) {
    double estimate = 0;
    for (uint32_t m : page.meshlets) estimate += rate_ * encoder_.triangles(m);
    while (growth_.any_free() && (page.meshlets.empty() || estimate < bytes)) {
      page.meshlets.push_back(growth_.add());
      estimate += rate_ * encoder_.triangles(page.meshlets.back());
    }
  }

  // One page, as full as whole meshlets allow or nearly so.
  Page fullest() {
    Page best, page;
    growth_.start();
    size_t too_many = SIZE_MAX;
    do {
      grow(page, kAim * double(limit_));
      size_t count = prefix(page, kAim * double(limit_));
      count = std::min(std::max(count, best.count + 1), too_many - 1);
      if (count > page.meshlets.size()) page.meshlets.push_back(growth_.add());
      page.count = std::min(count, page.meshlets.size());
      encode(page);
      rate_ = rate_of(page);
      if (fits(page)) {
        best.count = page.count;
        best.blob = page.blob;
        best.stats = page.stats;
      } else {
        too_many = page.count;
      }
    } while (too_many - best.count > 1 && (best.count == 0 || !full(best)) &&
             (best.count < page.meshlets.size() || growth_.any_free()));
    best.meshlets = std::move(page.meshlets);
    growth_.finish(first_meshlets(best));
    drop_rest(best, false);
    return best;
  }

  // The number of the page's meshlets that the estimate allows.
  size_t prefix(const Page& page, double bytes) const {
    size_t count = 0;
    for (double estimate = 0; count < page.meshlets.size() && estimate < bytes; count++)
      estimate += rate_ * encoder_.triangles(page.meshlets[count]);
    return count;
  }

  std::vector<Page> grow_several() {
    std::vector<Page> pages;
    while (pages.size() < at_once_ && growth_.any_free()) {
      Page page;
      growth_.start();
      grow(page, kAim * double(limit_));
      page.count = page.meshlets.size();
      growth_.finish(page.meshlets);
      pages.push_back(std::move(page));
    }
    return pages;
  }

  void encode_fitting(Page& page) const {
    for (encode(page); !fits(page); encode(page)) {
      const double share = kAim * double(limit_) / double(page.blob.size());
      page.count = std::clamp<size_t>(size_t(share * double(page.count)), 1, page.count - 1);
    }
  }

  // Keeps the pages that are full, and the last of all.
  std::vector<Page> accept(std::vector<Page> pages) {
    double rates = 0;
    for (Page& page : pages) {
      drop_rest(page, true);
      rates += rate_of(page);
    }
    rate_ = rates / double(pages.size());
    std::vector<Page> kept;
    for (size_t p = 0; p < pages.size(); p++) {
      if (full(pages[p]) || (p + 1 == pages.size() && done()))
        kept.push_back(std::move(pages[p]));
      else
        for (uint32_t m : pages[p].meshlets) growth_.release(m, true);
    }
    at_once_ = kept.size() == pages.size() ? std::min(2 * at_once_, kMostAtOnce) : 1;
    return kept;
  }

  static std::vector<uint32_t> first_meshlets(const Page& page) {
    return {page.meshlets.begin(), page.meshlets.begin() + page.count};
  }

  void drop_rest(Page& page, bool finished) {
    for (size_t i = page.count; i < page.meshlets.size(); i++)
      growth_.release(page.meshlets[i], finished);
    page.meshlets.resize(page.count);
  }

  const PageEncoder& encoder_;
  PageGrowth& growth_;
  const size_t limit_;
  const int threads_;
  double rate_ = kFirstRate;  // estimated bytes per triangle
  size_t at_once_ = 1;
};

}  // namespace

std::vector<std::vector<uint8_t>> encode_pages(const MeshView& mesh,
                                               const std::vector<Stream>& streams,
                                               const VertexValues& values,
                                               const EncodeOptions& options, size_t page_bytes,
                                               EncoderStats& stats) {
  constexpr float share = 0.5f;  // of the progress, for the meshlets
  check_input(mesh, streams);
  const SegmentedMesh segmented = segment_for_encoder(mesh, options, share, stats);
  const MeshView view = segmented.mesh.view();
  const PageEncoder encoder(view, segmented.meshlets, segmented.sorted(values), streams, options,
                            false);
  PageGrowth growth(view, segmented.half_edges, segmented.meshlets);
  PageMaker maker(encoder, growth, page_bytes, options.threads);
  std::vector<std::vector<uint8_t>> pages;
  size_t encoded = 0;
  const size_t count = segmented.meshlets.meshlet_begin.size() - 1;
  while (!maker.done()) {
    for (Page& page : maker.next()) {
      add(stats, page.stats);
      pages.push_back(std::move(page.blob));
      encoded += page.count;
    }
    if (options.progress) options.progress(share + (1 - share) * float(encoded) / float(count));
  }
  return pages;
}

std::vector<std::vector<uint8_t>> encode_given(const MeshView& mesh, const Meshlets& meshlets,
                                               const std::vector<uint32_t>& page_begin,
                                               const std::vector<Stream>& streams,
                                               const VertexValues& values,
                                               const EncodeOptions& options, EncoderStats& stats) {
  check_input(mesh, streams);
  check_lists(meshlets, mesh.triangle_count);
  const PageEncoder encoder(mesh, meshlets, values, streams, options, true);
  const bool increases = std::adjacent_find(page_begin.begin(), page_begin.end(),
                                            std::greater_equal<uint32_t>()) == page_begin.end();
  if (page_begin.size() < 2 || page_begin.front() != 0 ||
      page_begin.back() != meshlets.meshlet_begin.size() - 1 || !increases)
    throw std::invalid_argument("the pages' begins do not increase from 0 to the last meshlet");
  const size_t count = page_begin.size() - 1;
  std::vector<std::vector<uint8_t>> pages(count);
  std::vector<EncoderStats> page_stats(count);
  parallel_for(options.threads, count, [&](size_t p) {
    std::vector<uint32_t> numbers(page_begin[p + 1] - page_begin[p]);
    std::iota(numbers.begin(), numbers.end(), page_begin[p]);
    pages[p] = encoder.encode(numbers, page_stats[p]);
  });
  for (const EncoderStats& one : page_stats) add(stats, one);
  return pages;
}

}  // namespace meshlet

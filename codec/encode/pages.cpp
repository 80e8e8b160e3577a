#include "encode/pages.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "common/hash_map.h"
#include "common/parallel.h"
#include "encode/page_growth.h"
#include "segment/check_meshlets.h"

namespace gltf_meshlet_codec {
namespace {

// Some meshlets of a mesh as a mesh of their own.
struct Submesh {
  Submesh(const EncoderInput& all, const std::vector<uint32_t>& numbers);

  MeshView view() const {
    return {triangles.data(), triangles.size() / 3, position_ids.data(), nullptr,
            position_ids.size()};
  }

  std::vector<uint32_t> triangles, position_ids, rows;
  VertexValues values;
  Meshlets meshlets;
};

Submesh::Submesh(const EncoderInput& all, const std::vector<uint32_t>& numbers) {
  const size_t most = numbers.size() * MESHLET_VERTICES;
  LocalNumbers vertices(most + 3);  // before the check of a caller's meshlets
  for (uint32_t m : numbers) {
    for (uint32_t k = all.meshlets.meshlet_begin[m]; k < all.meshlets.meshlet_begin[m + 1]; k++) {
      for (uint32_t i = all.meshlets.disk_begin[k]; i < all.meshlets.disk_begin[k + 1]; i++) {
        const uint32_t* corner = all.mesh.triangles + 3 * size_t(all.meshlets.triangles[i]);
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
    position_ids.push_back(ids.of(all.mesh.position_ids[v]));
    rows.push_back(all.values.rows ? all.values.rows[v] : v);
  }
  values = all.values;
  values.rows = rows.data();
}

// Items of a page in the order in which it took them. Its first `count` are in the blob.
struct Page {
  std::vector<uint32_t> items;
  size_t count = 0;
  Bytes blob;
  EncoderStats stats;
};

// Encodes items of one mesh as pages. Several threads may use it.
class PageEncoder {
 public:
  // Item i is meshlets item_begin[i] .. item_begin[i + 1]. check: whether the meshlets come from a
  // caller, who may not know disks; their lists are valid.
  PageEncoder(const EncoderInput& all, std::vector<uint32_t> item_begin,
              const std::vector<Stream>& streams, const EncodeOptions& options, bool check)
      : all_(all),
        item_begin_(std::move(item_begin)),
        streams_(streams),
        options_(options),
        check_(check) {
    options_.progress = nullptr;
    options_.threads = 1;  // one page on each thread
  }

  uint32_t items() const { return uint32_t(item_begin_.size() - 1); }
  uint32_t triangles(uint32_t item) const {
    return all_.meshlets.first_triangle(item_begin_[item + 1]) -
           all_.meshlets.first_triangle(item_begin_[item]);
  }

  // Sets the page's blob and statistics.
  void encode(Page& page) const {
    // In the order of their numbers, neighbours are close.
    std::vector<uint32_t> items(page.items.begin(), page.items.begin() + page.count), numbers;
    std::sort(items.begin(), items.end());
    for (uint32_t i : items)
      for (uint32_t m = item_begin_[i]; m < item_begin_[i + 1]; m++) numbers.push_back(m);
    const Submesh submesh(all_, numbers);
    const MeshView view = submesh.view();
    const HalfEdges half_edges = match_half_edges(view, options_.threads);
    if (check_) check_disks(view, half_edges, submesh.meshlets);
    page.stats = {};
    page.blob = encode_meshlets({view, half_edges, submesh.meshlets, submesh.values}, streams_,
                                options_, page.stats);
  }

 private:
  const EncoderInput all_;
  const std::vector<uint32_t> item_begin_;
  const std::vector<Stream>& streams_;
  EncodeOptions options_;
  const bool check_;
};

// Shares of the limit: the estimated size that a page is grown to, and the least of a page that
// another item would still fit. Sizes are some 3 % off their estimates on scans, 20 % on scenes.
constexpr double kAim = 0.975, kFull = 0.94;
constexpr size_t kMostAtOnce = 16;  // pages that are encoded in parallel; changes the result
constexpr double kFirstRate = 4;    // bytes per triangle, the start of the first search

// Packs items into pages of at most `limit` bytes.
class PagePacker {
 public:
  PagePacker(const PageEncoder& encoder, PageItems& items, size_t limit, int threads)
      : encoder_(encoder), items_(items), limit_(limit), threads_(threads) {}

  bool done() const { return !items_.any_free(); }

  // Returns some more pages. Encodes several at once while their sizes are near the estimates, on
  // any number of threads the same ones.
  std::vector<Page> next() {
    std::vector<Page> pages;
    if (at_once_ == 1) {
      at_once_ = 2;
      pages.push_back(fullest());
      return pages;
    }
    while (pages.size() < at_once_ && items_.any_free()) {
      Page page;
      items_.start();
      grow(page);
      page.count = page.items.size();
      items_.finish(page.items);
      pages.push_back(std::move(page));
    }
    parallel_for(threads_, pages.size(), [&](size_t p) { encode_fitting(pages[p]); });
    return accept(std::move(pages));
  }

 private:
  bool fits(const Page& page) const { return page.blob.size() <= limit_ || page.count == 1; }
  // Whether it is full, or too full for another item.
  bool full(const Page& page) const {
    const double size = double(page.blob.size());
    return size >= kFull * double(limit_) || size + size / double(page.count) > double(limit_);
  }

  double aim() const { return kAim * double(limit_); }
  double estimate(uint32_t item) const { return rate_ * encoder_.triangles(item); }
  double rate_of(const Page& page) const {
    double triangles = 0;
    for (size_t i = 0; i < page.count; i++) triangles += encoder_.triangles(page.items[i]);
    return double(page.blob.size()) / triangles;
  }

  // Adds items until the estimate reaches the aim, or none is free. Items of a list are large: the
  // one that would exceed the aim begins the next page.
  void grow(Page& page) {
    double size = 0;
    for (uint32_t item : page.items) size += estimate(item);
    while (items_.any_free() && (page.items.empty() || size < aim())) {
      const uint32_t item = items_.add();
      size += estimate(item);
      if (items_.in_order && !page.items.empty() && size > aim())
        return items_.release(item, false);
      page.items.push_back(item);
    }
  }

  // The number of the page's items that the estimate allows.
  size_t prefix(const Page& page) const {
    size_t count = 0;
    for (double size = 0; count < page.items.size() && size < aim(); count++)
      size += estimate(page.items[count]);
    return count;
  }

  // Returns one page, as full as whole items allow or nearly so.
  Page fullest() {
    Page best, page;
    items_.start();
    size_t too_many = SIZE_MAX;
    do {
      grow(page);
      const size_t count = std::min(std::max(prefix(page), best.count + 1), too_many - 1);
      if (count > page.items.size()) page.items.push_back(items_.add());
      page.count = std::min(count, page.items.size());
      encoder_.encode(page);
      rate_ = rate_of(page);
      if (fits(page)) {
        best.count = page.count;
        best.blob = page.blob;
        best.stats = page.stats;
      } else {
        too_many = page.count;
      }
    } while (too_many - best.count > 1 && (best.count == 0 || !full(best)) &&
             (best.count < page.items.size() || items_.any_free()));
    best.items = std::move(page.items);
    items_.finish({best.items.begin(), best.items.begin() + best.count});
    drop_rest(best, false);
    return best;
  }

  void encode_fitting(Page& page) const {
    for (encoder_.encode(page); !fits(page); encoder_.encode(page)) {
      const double share = aim() / double(page.blob.size());
      page.count = std::clamp<size_t>(size_t(share * double(page.count)), 1, page.count - 1);
    }
  }

  // Keeps the pages that are full, and the last of all. In order, up to the first with a gap after
  // it.
  std::vector<Page> accept(std::vector<Page> pages) {
    double rates = 0;
    size_t last = pages.size();
    for (size_t p = pages.size(); p-- > 0;)
      if (items_.in_order && (pages[p].count < pages[p].items.size() || !full(pages[p]))) last = p;
    for (Page& page : pages) {
      drop_rest(page, true);
      rates += rate_of(page);
    }
    rate_ = rates / double(pages.size());
    std::vector<Page> kept;
    for (size_t p = 0; p < pages.size(); p++) {
      if (p <= last && (full(pages[p]) || (p + 1 == pages.size() && done())))
        kept.push_back(std::move(pages[p]));
      else
        for (uint32_t item : pages[p].items) items_.release(item, true);
    }
    at_once_ = kept.size() == pages.size() ? std::min(2 * at_once_, kMostAtOnce) : 1;
    return kept;
  }

  void drop_rest(Page& page, bool finished) {
    for (size_t i = page.count; i < page.items.size(); i++) items_.release(page.items[i], finished);
    page.items.resize(page.count);
  }

  const PageEncoder& encoder_;
  PageItems& items_;
  const size_t limit_;
  const int threads_;
  double rate_ = kFirstRate;  // estimated bytes per triangle
  size_t at_once_ = 1;
};

// Adds a page's blob to the blobs, and its counts to the statistics.
void add(Page& page, std::vector<Bytes>& blobs, EncoderStats& stats) {
  stats.meshlets += page.stats.meshlets;
  stats.vertices += page.stats.vertices;
  stats.bits.add(page.stats.bits);
  blobs.push_back(std::move(page.blob));
}

std::vector<Bytes> pack(const PageEncoder& encoder, PageItems& items, size_t limit,
                        const EncodeOptions& options, EncoderStats& stats) {
  PagePacker packer(encoder, items, limit, options.threads);
  std::vector<Bytes> blobs;
  for (size_t packed = 0; !packer.done();) {
    for (Page& page : packer.next()) {
      packed += page.count;
      add(page, blobs, stats);
    }
    if (options.progress) options.progress(float(packed) / float(encoder.items()));
  }
  return blobs;
}

std::vector<uint32_t> numbers_to(size_t last) {
  std::vector<uint32_t> numbers(last + 1);
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

}  // namespace

std::vector<Bytes> encode_pages(const MeshView& mesh, const std::vector<Stream>& streams,
                                const VertexValues& values, const EncodeOptions& options,
                                size_t page_bytes, EncoderStats& stats) {
  constexpr float share = 0.5f;  // of the progress, for the meshlets
  check_input(mesh, streams);
  const SegmentedMesh segmented = segment_for_encoder(mesh, options, share, stats);
  const MeshView view = segmented.mesh.view();
  const VertexValues sorted_values = segmented.sorted(values);
  const PageEncoder encoder({view, segmented.half_edges, segmented.meshlets, sorted_values},
                            numbers_to(segmented.meshlets.count()), streams, options, false);
  PageGrowth items(view, segmented.half_edges, segmented.meshlets);
  EncodeOptions rest = options;
  if (options.progress) rest.progress = [&](float f) { options.progress(share + (1 - share) * f); };
  return pack(encoder, items, page_bytes, rest, stats);
}

std::vector<Bytes> encode_given(const MeshView& mesh, const Meshlets& meshlets,
                                const std::vector<uint32_t>& group_begin,
                                const std::vector<Stream>& streams, const VertexValues& values,
                                const EncodeOptions& options, size_t page_bytes,
                                EncoderStats& stats) {
  check_input(mesh, streams);
  check_lists(meshlets, mesh.triangle_count);
  if (!are_begins(group_begin, meshlets.count()))
    throw std::invalid_argument("the groups' begins do not increase from 0 to the last meshlet");
  const HalfEdges none{{}};
  const PageEncoder encoder({mesh, none, meshlets, values}, group_begin, streams, options, true);
  if (page_bytes) {
    ItemList items(encoder.items());
    return pack(encoder, items, page_bytes, options, stats);
  }
  std::vector<Page> pages(encoder.items());
  parallel_for(options.threads, pages.size(), [&](size_t p) {
    pages[p].items = {uint32_t(p)};
    pages[p].count = 1;
    encoder.encode(pages[p]);
  });
  std::vector<Bytes> blobs;
  for (Page& page : pages) add(page, blobs, stats);
  return blobs;
}

}  // namespace gltf_meshlet_codec

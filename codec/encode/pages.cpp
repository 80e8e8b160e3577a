#include "encode/pages.h"

#include <algorithm>
#include <stdexcept>
#include <functional>
#include <string_view>
#include <unordered_map>

#include "segment/check_meshlets.h"

namespace meshlet {
namespace {

// Gives each of the numbers that it is asked for a local one, from 0 in order of first occurrence.
class LocalNumbers {
 public:
  explicit LocalNumbers(size_t expected) { local_.reserve(expected); }
  uint32_t of(uint32_t number) {
    const auto [found, is_new] = local_.try_emplace(number, uint32_t(numbers_.size()));
    if (is_new) numbers_.push_back(number);
    return found->second;
  }
  const std::vector<uint32_t>& numbers() const { return numbers_; }

 private:
  std::unordered_map<uint32_t, uint32_t> local_;
  std::vector<uint32_t> numbers_;
};

// Some meshlets of a mesh as a mesh of their own.
struct Part {
  Part(const MeshView& mesh, const Meshlets& all, const VertexValues& all_values, uint32_t first,
       uint32_t last);

  MeshView view() const {
    return {triangles.data(), triangles.size() / 3, position_ids.data(), positions.data(),
            position_ids.size()};
  }

  std::vector<uint32_t> triangles, position_ids;
  std::vector<float> positions;
  std::vector<std::vector<uint32_t>> stream_values;
  VertexValues values;
  Meshlets meshlets;
};

Part::Part(const MeshView& mesh, const Meshlets& all, const VertexValues& all_values,
           uint32_t first, uint32_t last) {
  const uint32_t first_disk = all.meshlet_begin[first], last_disk = all.meshlet_begin[last];
  const uint32_t begin = all.disk_begin[first_disk], end = all.disk_begin[last_disk];
  for (uint32_t m = first; m <= last; m++)
    meshlets.meshlet_begin.push_back(all.meshlet_begin[m] - first_disk);
  for (uint32_t k = first_disk; k <= last_disk; k++)
    meshlets.disk_begin.push_back(all.disk_begin[k] - begin);
  LocalNumbers vertices(end - begin), ids(end - begin);
  for (uint32_t i = begin; i < end; i++) {
    meshlets.triangles.push_back(i - begin);
    for (int k = 0; k < 3; k++)
      triangles.push_back(vertices.of(mesh.triangles[3 * size_t(all.triangles[i]) + k]));
  }
  for (uint32_t v : vertices.numbers()) {
    position_ids.push_back(ids.of(mesh.position_ids[v]));
    positions.insert(positions.end(), mesh.positions + 3 * size_t(v),
                     mesh.positions + 3 * size_t(v) + 3);
  }
  values.elements = all_values.elements;
  for (size_t s = 0; s < all_values.values.size(); s++) {
    const uint32_t elements = all_values.elements[s];
    std::vector<uint32_t> part;
    part.reserve(vertices.numbers().size() * elements);
    for (uint32_t v : vertices.numbers()) {
      const uint32_t* from = all_values.values[s] + size_t(v) * elements;
      part.insert(part.end(), from, from + elements);
    }
    stream_values.push_back(std::move(part));
  }
  for (const std::vector<uint32_t>& part : stream_values) values.values.push_back(part.data());
}

// Encodes ranges of one mesh's meshlets as pages.
class PageEncoder {
 public:
  PageEncoder(const MeshView& mesh, const Meshlets& meshlets, const std::vector<Stream>& streams,
              const VertexValues& values, const EncodeOptions& options)
      : mesh_(mesh), meshlets_(meshlets), streams_(streams), values_(values), options_(options) {
    options_.progress = nullptr;
  }

  uint32_t count() const { return uint32_t(meshlets_.meshlet_begin.size() - 1); }

  std::vector<uint8_t> encode(uint32_t first, uint32_t last, EncoderStats& stats) const {
    const Part part(mesh_, meshlets_, values_, first, last);
    return encode_meshlets(part.view(), part.meshlets, streams_, part.values, options_, stats);
  }

 private:
  const MeshView& mesh_;
  const Meshlets& meshlets_;
  const std::vector<Stream>& streams_;
  const VertexValues& values_;
  EncodeOptions options_;
};

void add(EncoderStats& to, const EncoderStats& from) {
  to.meshlets += from.meshlets;
  to.vertices += from.vertices;
  for (const auto& [stage, seconds] : from.stage_seconds) {
    const auto same = [&](const auto& known) { return std::string_view(known.first) == stage; };
    const auto found = std::find_if(to.stage_seconds.begin(), to.stage_seconds.end(), same);
    if (found == to.stage_seconds.end())
      to.stage_seconds.emplace_back(stage, seconds);
    else
      found->second += seconds;
  }
}

// A page and the meshlets that it holds.
struct Page {
  std::vector<uint8_t> blob;
  uint32_t last = 0;
  EncoderStats stats;
};

// The fullest page of at most `limit` bytes that starts at meshlet `first`. `per_meshlet` is an
// estimate of a meshlet's bytes, corrected with every blob that is encoded.
Page fullest_page(const PageEncoder& encoder, uint32_t first, size_t limit, double& per_meshlet) {
  Page best;
  uint32_t fits = first, too_many = encoder.count() + 1;
  while (too_many - fits > 1) {
    const double guess = double(limit) / per_meshlet;
    uint32_t last = first + uint32_t(std::min(guess, double(encoder.count() - first)));
    last = std::clamp(last, fits + 1, too_many - 1);
    Page page;
    page.last = last;
    page.blob = encoder.encode(first, last, page.stats);
    per_meshlet = double(page.blob.size()) / (last - first);
    if (page.blob.size() > limit && last - first > 1) {
      too_many = last;
      continue;
    }
    fits = last;
    best = std::move(page);
    if (best.blob.size() > limit || limit - best.blob.size() < per_meshlet) break;
  }
  return best;
}

}  // namespace

std::vector<std::vector<uint8_t>> encode_pages(const MeshView& mesh,
                                               const std::vector<Stream>& streams,
                                               const VertexValues& values,
                                               const EncodeOptions& options, size_t page_bytes,
                                               EncoderStats& stats) {
  const Meshlets meshlets = generate_for_encoder(mesh, options, 0.5f, stats);
  const PageEncoder encoder(mesh, meshlets, streams, values, options);
  std::vector<std::vector<uint8_t>> pages;
  double per_meshlet = 256;  // only where the first search starts
  for (uint32_t first = 0; first < encoder.count();) {
    Page page = fullest_page(encoder, first, page_bytes, per_meshlet);
    add(stats, page.stats);
    pages.push_back(std::move(page.blob));
    first = page.last;
    if (options.progress) options.progress(0.5f + 0.5f * float(first) / float(encoder.count()));
  }
  return pages;
}

std::vector<std::vector<uint8_t>> encode_given(const MeshView& mesh, const Meshlets& meshlets,
                                               const std::vector<uint32_t>& page_begin,
                                               const std::vector<Stream>& streams,
                                               const VertexValues& values,
                                               const EncodeOptions& options, EncoderStats& stats) {
  check_meshlets(mesh, meshlets, options.threads);
  const PageEncoder encoder(mesh, meshlets, streams, values, options);
  const bool increases = std::adjacent_find(page_begin.begin(), page_begin.end(),
                                            std::greater_equal<uint32_t>()) == page_begin.end();
  if (page_begin.size() < 2 || page_begin.front() != 0 || page_begin.back() != encoder.count() ||
      !increases)
    throw std::invalid_argument("the pages' begins do not increase from 0 to the last meshlet");
  std::vector<std::vector<uint8_t>> pages;
  for (size_t p = 0; p + 1 < page_begin.size(); p++) {
    EncoderStats page_stats;
    pages.push_back(encoder.encode(page_begin[p], page_begin[p + 1], page_stats));
    add(stats, page_stats);
  }
  return pages;
}

}  // namespace meshlet

#include "encode/pages.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <functional>
#include <limits>
#include <numeric>
#include <string_view>
#include <unordered_map>

#include "segment/check_meshlets.h"

namespace meshlet {
namespace {

// Gives each of the numbers that it is asked for a local one, from 0 in order of first occurrence.
class LocalNumbers {
 public:
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
  Part(const MeshView& mesh, const Meshlets& all, const VertexValues& all_values,
       const std::vector<uint32_t>& numbers);

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
           const std::vector<uint32_t>& numbers) {
  LocalNumbers vertices, ids;
  meshlets.meshlet_begin.push_back(0);
  meshlets.disk_begin.push_back(0);
  for (uint32_t m : numbers) {
    for (uint32_t k = all.meshlet_begin[m]; k < all.meshlet_begin[m + 1]; k++) {
      for (uint32_t i = all.disk_begin[k]; i < all.disk_begin[k + 1]; i++) {
        const uint32_t* corner = mesh.triangles + 3 * size_t(all.triangles[i]);
        meshlets.triangles.push_back(uint32_t(meshlets.triangles.size()));
        for (int c = 0; c < 3; c++) triangles.push_back(vertices.of(corner[c]));
      }
      meshlets.disk_begin.push_back(uint32_t(meshlets.triangles.size()));
    }
    meshlets.meshlet_begin.push_back(uint32_t(meshlets.disk_begin.size() - 1));
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

// Encodes pages of one mesh's meshlets, which it takes in a given order.
class PageEncoder {
 public:
  PageEncoder(const MeshView& mesh, const Meshlets& meshlets, std::vector<uint32_t> order,
              const std::vector<Stream>& streams, const VertexValues& values,
              const EncodeOptions& options)
      : mesh_(mesh),
        meshlets_(meshlets),
        order_(std::move(order)),
        streams_(streams),
        values_(values),
        options_(options) {
    options_.progress = nullptr;
  }

  uint32_t count() const { return uint32_t(order_.size()); }

  // Encodes the meshlets at [first, last) of the order. In the page they keep the order of their
  // numbers, by which neighbours are close.
  std::vector<uint8_t> encode(uint32_t first, uint32_t last, EncoderStats& stats) const {
    std::vector<uint32_t> numbers(order_.begin() + first, order_.begin() + last);
    std::sort(numbers.begin(), numbers.end());
    const Part part(mesh_, meshlets_, values_, numbers);
    return encode_meshlets(part.view(), part.meshlets, streams_, part.values, options_, stats);
  }

 private:
  const MeshView& mesh_;
  const Meshlets& meshlets_;
  const std::vector<uint32_t> order_;
  const std::vector<Stream>& streams_;
  const VertexValues& values_;
  EncodeOptions options_;
};

// Index of a point with coordinates of 10 bits on a Hilbert curve through the cube (J. Skilling,
// Programming the Hilbert curve, AIP Conference Proceedings 707, 2004).
uint32_t hilbert_index(std::array<uint32_t, 3> x) {
  constexpr uint32_t kBits = 10;
  for (uint32_t q = 1u << (kBits - 1); q > 1; q >>= 1) {
    for (uint32_t& coordinate : x) {
      const uint32_t swapped = coordinate & q ? 0 : (x[0] ^ coordinate) & (q - 1);
      x[0] ^= coordinate & q ? q - 1 : swapped;
      coordinate ^= swapped;
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  uint32_t t = 0;
  for (uint32_t q = 1u << (kBits - 1); q > 1; q >>= 1)
    if (x[2] & q) t ^= q - 1;
  uint32_t index = 0;
  for (uint32_t bit = kBits; bit-- > 0;)
    for (uint32_t coordinate : x) index = index << 1 | ((coordinate ^ t) >> bit & 1);
  return index;
}

// The meshlets along a Hilbert curve through their centres: consecutive ones are compact groups,
// with short borders.
std::vector<uint32_t> along_hilbert_curve(const MeshView& mesh, const Meshlets& meshlets) {
  const size_t count = meshlets.meshlet_begin.size() - 1;
  std::vector<std::array<float, 3>> centres(count);
  std::array<float, 3> low, high;
  low.fill(std::numeric_limits<float>::max());
  high.fill(std::numeric_limits<float>::lowest());
  for (size_t m = 0; m < count; m++) {
    const uint32_t begin = meshlets.disk_begin[meshlets.meshlet_begin[m]];
    const uint32_t end = meshlets.disk_begin[meshlets.meshlet_begin[m + 1]];
    for (int c = 0; c < 3; c++) {
      double sum = 0;
      for (uint32_t i = begin; i < end; i++)
        for (int k = 0; k < 3; k++)
          sum +=
              mesh.positions[3 * size_t(mesh.triangles[3 * size_t(meshlets.triangles[i]) + k]) + c];
      centres[m][c] = float(sum / (3.0 * (end - begin)));
      low[c] = std::min(low[c], centres[m][c]);
      high[c] = std::max(high[c], centres[m][c]);
    }
  }
  const float size = std::max(
      {high[0] - low[0], high[1] - low[1], high[2] - low[2], std::numeric_limits<float>::min()});
  std::vector<std::pair<uint32_t, uint32_t>> keyed(count);
  for (uint32_t m = 0; m < count; m++) {
    std::array<uint32_t, 3> cell;
    for (int c = 0; c < 3; c++) cell[c] = uint32_t((centres[m][c] - low[c]) / size * 1023.0f);
    keyed[m] = {hilbert_index(cell), m};
  }
  std::sort(keyed.begin(), keyed.end());
  std::vector<uint32_t> order;
  for (const auto& [index, m] : keyed) order.push_back(m);
  return order;
}

void add(EncoderStats& to, const EncoderStats& from) {
  to.meshlets += from.meshlets;
  to.vertices += from.vertices;
  to.bits.add(from.bits);
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
  const PageEncoder encoder(mesh, meshlets, along_hilbert_curve(mesh, meshlets), streams, values,
                            options);
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
  std::vector<uint32_t> order(meshlets.meshlet_begin.size() - 1);
  std::iota(order.begin(), order.end(), 0u);
  const PageEncoder encoder(mesh, meshlets, std::move(order), streams, values, options);
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

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "common/parallel.h"
#include "decode/view.h"
#include "transport/blob_reader.h"
#include "transport/encoder.h"
#include "transport/transport.h"

namespace meshlet {
namespace {

using transport::Encoder;
using transport::kParts;
using transport::Page;
using transport::PageCoder;
using transport::Settings;

// Tries settings and keeps those that save bits. Settings of different parts of a page do not
// change each other's bits: they are tried together.
std::vector<uint8_t> encode(const Page& page) {
  const uint32_t triangles = page.triangles.size(), meshlets = page.meshlets.size();
  Page known;
  PageCoder<Encoder> coder(known);
  const auto attempt = [&](const Settings& settings) {
    coder.coder.reset();
    coder.settings = settings;
    return coder.code(&page, triangles, meshlets);
  };
  Settings best;
  if (!attempt(best)) return {};
  uint64_t fewest[kParts];
  std::copy(coder.cost, coder.cost + kParts, fewest);
  const uint64_t all = coder.coder.cost();
  constexpr bool Settings::* rounds[2][kParts] = {
      {&Settings::choices, &Settings::copies, &Settings::angles},
      {&Settings::matches, nullptr, &Settings::repeats}};
  for (const auto& round : rounds) {
    Settings settings = best;
    for (const auto setting : round)
      if (setting) settings.*setting = true;
    if (!attempt(settings)) continue;
    for (uint32_t part = 0; part < kParts; part++) {
      if (!round[part] || coder.cost[part] >= fewest[part]) continue;
      // Angles take time when unpacking.
      if (round[part] == &Settings::angles && (fewest[part] - coder.cost[part]) * 32 < all)
        continue;
      fewest[part] = coder.cost[part];
      best.*round[part] = true;
    }
  }
  if (!attempt(best)) return {};
  return coder.coder.finish(triangles, meshlets);
}

// The packed page of a valid blob; empty if it has to travel as it is.
std::vector<uint8_t> pack_blob(const Blob& blob) {
  Page page;
  transport::read_blob(blob.data, page);
  std::vector<uint8_t> packed = encode(page);
  if (packed.empty() || packed.size() >= blob.size ||
      blob.size > kFreeBytes + kMostExpansion * packed.size())
    return {};
  std::vector<uint8_t> resident(blob.size);
  const PackedPage whole = {0, packed.size(), 0, blob.size, false};
  if (make_page_unpacker()->unpack(packed.data(), whole, resident.data()) ||
      std::memcmp(resident.data(), blob.data, blob.size) != 0)
    return {};  // not in canonical form
  return packed;
}

}  // namespace

Problem pack_view(const uint8_t* data, size_t size, int threads, std::vector<uint8_t>& packed) {
  View view;
  if (const Problem problem = view.open(data, size)) return problem;
  const size_t count = view.blobs.size();
  std::vector<std::vector<uint8_t>> pages(count);
  std::vector<Problem> problems(count);
  parallel_for(threads, count, [&](size_t b) {
    problems[b] = view.validate(b);
    if (!problems[b]) pages[b] = pack_blob(view.blobs[b]);
  });
  for (size_t b = 0; b < count; b++)
    if (problems[b]) return view.located(problems[b], b);
  packed.clear();
  const auto put = [&](uint32_t word) {
    for (int i = 0; i < 4; i++) packed.push_back(uint8_t(word >> 8 * i));
  };
  put(uint32_t(count) << 8 | kTransportVersion);
  for (size_t b = 0; b < count; b++) {
    put(uint32_t(view.blobs[b].size));
    put(uint32_t(pages[b].size()));
  }
  for (size_t b = 0; b < count; b++) {
    const Blob& blob = view.blobs[b];
    if (pages[b].empty())
      packed.insert(packed.end(), blob.data, blob.data + blob.size);
    else
      packed.insert(packed.end(), pages[b].begin(), pages[b].end());
  }
  return {};
}

}  // namespace meshlet

// fuzz_decoder FOLDER [MUTATIONS [SEED]]
// Runs every .bin file of a folder, every truncation of each small one, and MUTATIONS random
// mutations of them through the decoder, as views of one blob or several. Build with ASan and UBSan
// (MESHLET_FUZZ). The decoder must decode any input or throw Malformed, within seconds; otherwise
// the program ends with status 1 or a sanitizer's report. For coverage-guided fuzzing, link with
// -fsanitize=fuzzer -DMESHLET_LIBFUZZER.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <vector>

#include "decode/bit_statistics.h"
#include "decode/view.h"

namespace {

using Bytes = std::vector<uint8_t>;

void expect(bool holds, const char* problem) {
  if (holds) return;
  std::fprintf(stderr, "fuzz_decoder: %s\n", problem);
  std::abort();
}

// The decoded arrays of a view or of some meshlets.
struct Arrays {
  std::vector<uint32_t> triangles;
  std::vector<std::vector<uint32_t>> values;

  Arrays(size_t triangle_count, size_t vertex_count, const std::vector<meshlet::Stream>& streams)
      : triangles(3 * triangle_count) {
    for (const meshlet::Stream& stream : streams)
      values.emplace_back(vertex_count * meshlet::value_count(stream));
  }

  // Calls decode(outputs) to write integers or values.
  template <class Decode>
  void fill(bool integers, Decode decode) {
    std::vector<uint32_t*> as_integers;
    for (std::vector<uint32_t>& array : values) as_integers.push_back(array.data());
    std::vector<void*> as_values(as_integers.begin(), as_integers.end());
    meshlet::Outputs out;
    out.triangles = triangles.data();
    if (integers)
      out.integers = as_integers.data();
    else
      out.values = as_values.data();
    decode(out);
  }
};

Arrays decode_everything(const meshlet::View& view, bool integers) {
  expect(view.vertex_count <= 64 * view.meshlet_count, "more vertices than the meshlets can hold");
  Arrays arrays(size_t(view.triangle_count), size_t(view.vertex_count), view.streams());
  arrays.fill(integers, [&](const meshlet::Outputs& out) {
    for (size_t blob = 0; blob < view.blobs.size(); blob++) view.decode(blob, out);
  });
  for (uint32_t vertex : arrays.triangles)
    expect(vertex < view.vertex_count, "a triangle names a vertex that does not exist");
  return arrays;
}

void validate(const meshlet::View& view) {
  for (size_t blob = 0; blob < view.blobs.size(); blob++) view.validate(blob);
}

// Decodes ranges of a valid blob and compares the values at all corners with those of `whole`.
// continued: each range continues the one before.
void compare_ranges(const meshlet::Blob& blob, const Arrays& whole, bool continued) {
  const std::vector<meshlet::Stream>& streams = blob.header.streams;
  const auto decoder = meshlet::make_decoder();
  decoder->open(blob);
  const uint32_t meshlets = blob.header.meshlet_count, step = meshlets / 3 + 1;
  size_t corner = 3 * size_t(blob.first_triangle), vertices = 0;
  std::vector<std::vector<uint32_t>> values(streams.size());
  for (uint32_t first = 0; first < meshlets; first += step) {
    const uint32_t count = std::min(step, meshlets - first);
    Arrays part(64 * size_t(count), 64 * size_t(count), streams);
    if (!continued) {
      decoder->open(blob);
      vertices = 0;
      values.assign(streams.size(), {});
    }
    decoder->meshlet(meshlets - 1);  // changes nothing
    meshlet::DecodedCounts counts;
    part.fill(true, [&](const auto& out) { counts = decoder->decode(first, count, {}, out); });
    vertices += counts.vertices;
    for (size_t s = 0; s < streams.size(); s++)
      values[s].insert(values[s].end(), part.values[s].begin(),
                       part.values[s].begin() + long(counts.vertices) * streams[s].elements);
    for (size_t i = 0; i < 3 * size_t(counts.triangles); i++, corner++) {
      const uint32_t there = whole.triangles[corner], here = part.triangles[i];
      expect(here < vertices, "a range names a vertex that does not exist");
      expect(!continued || here + blob.first_vertex == there, "a range continues other numbers");
      for (size_t s = 0; s < streams.size(); s++)
        for (uint32_t c = 0, n = streams[s].elements; c < n; c++)
          expect(values[s][n * here + c] == whole.values[s][n * there + c],
                 "a range decodes to other values");
    }
  }
}

void decode_meshlets(const meshlet::View& view) {
  const auto decoder = meshlet::make_decoder();
  for (const meshlet::Blob& blob : view.blobs) {
    decoder->open(blob);
    for (uint32_t m = blob.header.meshlet_count; m-- > 0;) {
      try {
        decoder->meshlet(m);
      } catch (const meshlet::Malformed&) {
      }
    }
  }
}

template <class Run>
bool accepted(Run run) {
  try {
    run();
    return true;
  } catch (const meshlet::Malformed&) {
    return false;
  }
}

// Returns whether the whole view decodes.
bool try_view(const Bytes& bytes) {
  std::optional<meshlet::View> view;
  if (!accepted([&] { view.emplace(bytes.data(), bytes.size()); })) return false;
  std::optional<Arrays> whole;
  accepted([&] { whole = decode_everything(*view, true); });
  expect(accepted([&] { decode_everything(*view, false); }) == whole.has_value(),
         "decoding to values and to integers disagree on a view");
  const bool valid = accepted([&] { validate(*view); });
  expect(whole || !valid, "a valid view does not decode");
  if (valid)
    for (const meshlet::Blob& blob : view->blobs)
      for (bool continued : {false, true}) compare_ranges(blob, *whole, continued);
  decode_meshlets(*view);
  accepted([&] {
    for (const meshlet::Blob& blob : view->blobs) meshlet::count_bits(blob);
  });
  return whole.has_value();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  try_view(Bytes(data, data + size));
  return 0;
}

#ifndef MESHLET_LIBFUZZER
namespace {

constexpr size_t kSmall = 2048;   // bytes: files up to this size are cut at every length
constexpr double kTooLong = 2.0;  // seconds for one input, with sanitizers

struct Summary {
  size_t inputs = 0, decoded = 0;
  double slowest = 0;

  void run(const Bytes& blob) {
    const auto start = std::chrono::steady_clock::now();
    decoded += try_view(blob);
    inputs++;
    slowest = std::max(
        slowest, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    expect(slowest < kTooLong, "an input takes too long");
  }
};

// Repairs the lengths of blobs and the padding of the last one, which the decoder checks first:
// most mutations then get past them.
void repair_frame(Bytes& view) {
  view.resize(view.size() / 4 * 4);
  for (size_t at = 0; view.size() - at >= BLOB_HEADER_BYTES + BLOB_PADDING_BYTES;) {
    const uint32_t rest = uint32_t(view.size() - at);
    uint32_t length;
    std::memcpy(&length, view.data() + at + 4 * BLOB_WORD_BYTES, sizeof length);
    if (length < BLOB_HEADER_BYTES || length % 4 || length > rest - BLOB_HEADER_BYTES) {
      std::memcpy(view.data() + at + 4 * BLOB_WORD_BYTES, &rest, sizeof rest);
      std::fill(view.end() - BLOB_PADDING_BYTES, view.end(), uint8_t(0));
      return;
    }
    at += length;
  }
}

void mutate(Bytes& blob, const Bytes& other, std::mt19937& random) {
  const auto below = [&](size_t bound) { return bound ? random() % bound : 0; };
  for (size_t i = 1 + below(6); i > 0 && !blob.empty(); --i) {
    const size_t at = below(blob.size());
    switch (below(6)) {
      case 0: blob[at] ^= uint8_t(1u << below(8)); break;
      case 1: blob[at] = uint8_t(random()); break;
      case 2: blob[at] = below(2) ? 0xFF : 0x00; break;
      case 3: blob[at] = uint8_t(blob[at] + (below(2) ? 1 : -1)); break;
      case 4:
        if (below(8) == 0) blob.resize(at);
        break;
      default: {
        const size_t length = std::min({below(16), blob.size() - at, other.size()});
        std::copy_n(other.begin() + long(below(other.size() - length + 1)), length,
                    blob.begin() + long(at));
      }
    }
  }
  if (below(16)) repair_frame(blob);
}

std::vector<Bytes> read_corpus(const char* folder) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".bin") paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<Bytes> corpus;
  for (const auto& path : paths) {
    std::ifstream file(path, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return corpus;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<Bytes> corpus = argc > 1 ? read_corpus(argv[1]) : std::vector<Bytes>{};
  if (corpus.empty()) {
    std::fprintf(stderr, "usage: fuzz_decoder FOLDER_WITH_BIN_FILES [MUTATIONS [SEED]]\n");
    return 2;
  }
  const long mutations = argc > 2 ? std::atol(argv[2]) : 100000;
  Summary files, truncations, mutated;
  for (const Bytes& blob : corpus) {
    files.run(blob);
    for (size_t length = 0; blob.size() <= kSmall && length < blob.size(); length++) {
      Bytes cut(blob.begin(), blob.begin() + long(length));
      truncations.run(cut);
      repair_frame(cut);
      truncations.run(cut);
    }
  }
  std::mt19937 random(argc > 3 ? uint32_t(std::atol(argv[3])) : 1u);
  for (long i = 0; i < mutations; i++) {
    Bytes blob = corpus[random() % corpus.size()];
    mutate(blob, corpus[random() % corpus.size()], random);
    mutated.run(blob);
  }
  for (const auto& [name, summary] :
       {std::pair{"files", files}, {"truncations", truncations}, {"mutations", mutated}})
    std::printf("%s: %zu run, %zu decoded, slowest %.1f ms\n", name, summary.inputs,
                summary.decoded, summary.slowest * 1e3);
  return 0;
}
#endif

// fuzz_decoder FOLDER [MUTATIONS [SEED]]
// Runs every .bin file of a folder, every truncation of each small one, and MUTATIONS random
// mutations of them through the C interface, as views of one blob or several. Build with ASan and
// UBSan (MESHLET_FUZZ). It must decode any input or say that it is malformed, within seconds;
// otherwise the program ends with status 1 or a sanitizer's report. For coverage-guided fuzzing,
// link with -fsanitize=fuzzer -DMESHLET_LIBFUZZER.
#include <algorithm>
#include <ctime>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <vector>

#include "../../../codec/format/constants.h"
#include "gltf_meshlet_internal.h"

namespace {

using Bytes = std::vector<uint8_t>;

void expect(bool holds, const char* problem) {
  if (holds) return;
  std::fprintf(stderr, "fuzz_decoder: %s\n", problem);
  std::abort();
}

// Is this a success? Otherwise the bytes must be malformed: nothing else is wrong here.
bool valid(int status) {
  expect(status == GLTF_MESHLET_OK || status == GLTF_MESHLET_MALFORMED, gltf_meshlet_error());
  return status == GLTF_MESHLET_OK;
}

template <class T>
T sized() {
  T out{};
  out.size = sizeof out;
  return out;
}

// An open view and what its headers say.
struct View {
  gltf_meshlet_view* view = nullptr;
  gltf_meshlet_counts counts = sized<gltf_meshlet_counts>();
  std::vector<gltf_meshlet_stream> streams;
  std::vector<gltf_meshlet_page> blobs;

  explicit View(const Bytes& bytes) {
    static const uint8_t none = 0;
    if (!valid(gltf_meshlet_open(bytes.empty() ? &none : bytes.data(), bytes.size(), &view)))
      return;
    expect(valid(gltf_meshlet_get_counts(view, &counts)), "an open view has no counts");
    streams.resize(counts.streams);
    blobs.resize(counts.pages, sized<gltf_meshlet_page>());
    for (uint32_t s = 0; s < counts.streams; s++)
      expect(valid(gltf_meshlet_get_stream(view, 0, s, &streams[s])), "a stream is missing");
    for (uint32_t b = 0; b < counts.pages; b++)
      expect(valid(gltf_meshlet_get_page(view, b, &blobs[b])), "a blob is missing");
  }
  ~View() { gltf_meshlet_close(view); }
  View(const View&) = delete;
};

// The decoded arrays of a view or of some meshlets.
struct Arrays {
  std::vector<uint32_t> triangles;
  std::vector<std::vector<uint32_t>> values;
  uint64_t vertices;

  Arrays(uint64_t triangle_count, uint64_t vertex_count, const View& view)
      : triangles(3 * triangle_count), vertices(vertex_count) {
    for (const gltf_meshlet_stream& s : view.streams)
      values.emplace_back(vertex_count * (s.kind == GLTF_MESHLET_OCT ? 3u : s.elements));
  }

  // Calls decode(arrays), which writes integers or values; returns whether it did.
  template <class Decode>
  bool fill(bool integers, Decode decode) {
    std::vector<uint32_t*> as_integers;
    for (std::vector<uint32_t>& array : values) as_integers.push_back(array.data());
    std::vector<void*> as_values(as_integers.begin(), as_integers.end());
    auto out = sized<gltf_meshlet_arrays>();
    out.triangle_room = triangles.size() / 3;
    out.vertex_room = vertices;
    out.triangles = triangles.data();
    if (integers)
      out.integers = as_integers.data();
    else
      out.values = as_values.data();
    return valid(decode(out));
  }
};

struct Scratch {
  gltf_meshlet_scratch* scratch = nullptr;

  Scratch() { expect(valid(gltf_meshlet_open_scratch(&scratch)), "there is no scratch"); }
  ~Scratch() { gltf_meshlet_close(scratch); }
  Scratch(const Scratch&) = delete;
};

// Returns nothing if the view is malformed.
std::optional<Arrays> decode_everything(const View& view, bool integers, int32_t threads) {
  const gltf_meshlet_counts& n = view.counts;
  expect(n.vertices <= 64 * n.meshlets, "more vertices than the meshlets can hold");
  Arrays arrays(n.triangles, n.vertices, view);
  if (!arrays.fill(integers,
                   [&](auto& out) { return gltf_meshlet_decode(view.view, threads, &out); }))
    return {};
  for (uint32_t vertex : arrays.triangles)
    expect(vertex < n.vertices, "a triangle names a vertex that does not exist");
  return arrays;
}

// Calls action(first, count) for ranges that fill a blob, the last one first.
template <class Action>
void for_ranges(const gltf_meshlet_page& blob, uint64_t step, Action action) {
  const uint64_t n = blob.meshlets;
  for (uint64_t i = (n + step - 1) / step; i-- > 0;)
    action(blob.first_meshlet + i * step, std::min(step, n - i * step));
}

// Decodes ranges of a valid blob alone, and compares the values at all corners with those of
// `whole`. One that follows another one is no continuation of it.
void compare_ranges(const View& view, const gltf_meshlet_page& blob, const Arrays& whole,
                    const std::vector<uint32_t>& triangle_begins) {
  const Scratch scratch;
  for (uint64_t step : {uint64_t(1), uint64_t(3), blob.meshlets})
    for_ranges(blob, step, [&](uint64_t first, uint64_t count) {
      Arrays part(64 * count, 64 * count, view);
      uint32_t sizes[2];
      const auto decode = [&](auto& out) {
        return gltf_meshlet_decode_range(view.view, scratch.scratch, first, count, &out, sizes);
      };
      expect(part.fill(true, decode), "a range of a valid blob is refused");
      const uint32_t* there = &whole.triangles[3 * size_t(triangle_begins[first])];
      for (size_t i = 0; i < 3 * size_t(sizes[0]); i++) {
        const uint32_t here = part.triangles[i];
        expect(here < sizes[1], "a range names a vertex that does not exist");
        for (size_t s = 0; s < part.values.size(); s++)
          for (uint32_t c = 0, n = view.streams[s].elements; c < n; c++)
            expect(part.values[s][n * here + c] == whole.values[s][n * there[i] + c],
                   "a range decodes to other values");
      }
    });
}

// Decodes ranges to the arrays of the whole view, each of which must get what gltf_meshlet_decode
// writes there, and nothing else: an array that is whole stays so. whole: of a valid view.
void decode_parts(const View& view, const std::vector<uint32_t>& triangle_begins,
                  const std::vector<uint32_t>& vertex_begins, const Arrays* whole) {
  const Scratch scratch;
  Arrays parts(view.counts.triangles, view.counts.vertices, view);
  Arrays kept = parts;
  if (whole) kept = *whole;
  for (uint64_t step : {1u, 2u, 7u})
    for (const gltf_meshlet_page& blob : view.blobs)
      for_ranges(blob, step, [&](uint64_t first, uint64_t count) {
        for (Arrays* to : {&parts, &kept}) {
          const bool done = to->fill(true, [&](auto& out) {
            out.triangle_begins = triangle_begins.data();
            out.vertex_begins = vertex_begins.data();
            return gltf_meshlet_decode_range(view.view, step == 2 ? nullptr : scratch.scratch,
                                             first, count, &out, nullptr);
          });
          expect(done || !whole, "a part of a valid view is refused");
        }
      });
  expect(!whole || (kept.triangles == whole->triangles && kept.values == whole->values),
         "a part writes to places of others");
  expect(!whole || (parts.triangles == whole->triangles && parts.values == whole->values),
         "the parts are not the whole");
}

void decode_meshlets(const View& view) {
  const Scratch scratch;
  size_t elements = 0;
  for (const gltf_meshlet_stream& s : view.streams) elements += s.elements;
  std::vector<uint32_t> integers(64 * elements);
  uint8_t triangles[3 * 64];
  uint32_t sizes[2];
  float positions[4 * 64];
  gltf_meshlet_bounds bounds;
  const gltf_meshlet_attribute position = {0, GLTF_MESHLET_F32, positions, 0};
  auto arrays = sized<gltf_meshlet_meshlet_arrays>();
  arrays.sizes = sizes;
  arrays.triangles = triangles;
  arrays.integers = integers.data();
  arrays.attributes = &position;
  arrays.attribute_count = 1;
  if (view.streams[0].elements == 3) arrays.bounds = &bounds;
  for (uint32_t m = uint32_t(view.counts.meshlets); m-- > 0;)
    if (valid(gltf_meshlet_decode_meshlets(view.view, scratch.scratch, &m, 1, &arrays)))
      for (uint32_t i = 0; i < 3 * sizes[0]; i++)
        expect(triangles[i] < sizes[1], "a meshlet names a vertex that does not exist");
}

// Returns whether the whole view decodes.
bool try_view(const Bytes& bytes) {
  const View view(bytes);
  if (!view.view) return false;
  const std::optional<Arrays> whole = decode_everything(view, true, 1);
  expect(decode_everything(view, false, 1).has_value() == whole.has_value(),
         "decoding to values and to integers disagree on a view");
  const bool all = valid(gltf_meshlet_validate(view.view, 1));
  expect(whole || !all, "a valid view does not decode");
  const std::optional<Arrays> by_threads = decode_everything(view, true, 3);
  expect(by_threads.has_value() == whole.has_value(), "threads change whether a view decodes");
  expect(!all || (by_threads->triangles == whole->triangles && by_threads->values == whole->values),
         "threads decode to other values");
  std::vector<uint32_t> triangle_begins(view.counts.meshlets + 1), vertex_begins = triangle_begins;
  const bool begins = valid(gltf_meshlet_get_begins(view.view, 3, triangle_begins.data(),
                                                    vertex_begins.data(), triangle_begins.size()));
  expect(begins || !all, "a valid view has no begins");
  if (all)
    for (const gltf_meshlet_page& blob : view.blobs)
      compare_ranges(view, blob, *whole, triangle_begins);
  if (begins) decode_parts(view, triangle_begins, vertex_begins, all ? &*whole : nullptr);
  auto statistics = sized<gltf_meshlet_statistics>();
  expect(valid(gltf_meshlet_get_statistics(view.view, &statistics)) || !all,
         "bits of a valid view are not counted");
  decode_meshlets(view);
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
constexpr double kTooLong = 2.0;  // seconds of processor time for one input, with sanitizers

struct Summary {
  size_t inputs = 0, decoded = 0;
  double slowest = 0;

  void run(const Bytes& blob) {
    const std::clock_t start = std::clock();
    decoded += try_view(blob);
    inputs++;
    slowest = std::max(slowest, double(std::clock() - start) / CLOCKS_PER_SEC);
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

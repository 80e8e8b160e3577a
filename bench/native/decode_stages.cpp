// decode_stages BLOB...
//
// Times the stages of decoding whole blobs on one thread. Prints one JSON object: "shares", each
// stage's share of the time per repetition; "avx2", whether the AVX2 build was measured;
// "clock_share", the share of reading the clock, which the other shares exclude.
//
// Runs the stages of BlobDecoder in bulk_decoder.cpp one by one and reads the processor's clock in
// between. CMakeLists.txt gives this file the options of the library's AVX2 build.
#define MESHLET_BUILD stages
#include "decode/bulk_decoder.cpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>
#include <vector>

#ifdef __x86_64__
#include <x86intrin.h>
#endif

namespace meshlet {
namespace {

constexpr int kRepetitions = 7;

enum Stage { kConnect, kLookUp, kBoundary, kInterior, kNumber, kTriangles, kValues, kStages };
constexpr const char* kNames[kStages] = {"open and connect",          "look up shared vertices",
                                         "decode corners and chains", "decode interior vertices",
                                         "number vertices",           "write triangles",
                                         "write attributes"};

uint64_t ticks() {
#ifdef __x86_64__
  return __rdtsc();
#else
  return uint64_t(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
}

class Clock {
 public:
  void start() { last_ = ticks(); }
  void end(Stage stage) {
    uint64_t now = ticks();
    spent[stage] += now - last_;
    last_ = now;
  }
  std::array<uint64_t, kStages> spent{};

 private:
  uint64_t last_ = 0;
};

// Ticks between two consecutive readings.
uint64_t clock_cost() {
  constexpr uint64_t kReadings = 100000;
  Clock clock;
  clock.start();
  for (uint64_t i = 0; i < kReadings; i++) clock.end(kConnect);
  return clock.spent[kConnect] / kReadings;
}

struct Input {
  std::vector<uint8_t> bytes;
  BlobHeader header;
  std::vector<uint32_t> triangles;
  std::vector<std::vector<uint32_t>> values;
  std::vector<void*> pointers;

  explicit Input(const char* path) {
    std::ifstream file(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    header = read_blob_header(bytes.data(), bytes.size());
    triangles.resize(3 * size_t(header.triangle_count));
    for (const Stream& s : header.streams) {
      values.emplace_back(size_t(header.vertex_count) * value_count(s));
      pointers.push_back(values.back().data());
    }
  }

  Outputs outputs() { return {triangles.data(), nullptr, pointers.data()}; }
};

// BlobDecoder::try_decode of a whole blob, with timers. Returns false if it is malformed.
bool decode_timed(Input& input, SerialDecoder& d, History& history, Clock& clock) {
  const BlobHeader& header = input.header;
  const Outputs outputs = input.outputs();
  const StreamRange streams{0, uint32_t(header.streams.size())};
  uint32_t first = 0;
  uint32_t* triangles = outputs.triangles;
  for (uint32_t m = 0; m < header.meshlet_count; m++) {
    clock.start();
    history.reserve(m);
    d.open_meshlet(m);
    if (d.error == ERROR_NONE) d.connect_meshlet();
    clock.end(kConnect);
    if (d.error != ERROR_NONE) return false;
    history.look_up(true);
    clock.end(kLookUp);
    d.read_corners();
    history.copy_own_corners();
    if (d.error == ERROR_NONE) d.read_chains(d.opened);
    history.copy_own_chains();
    clock.end(kBoundary);
    if (d.error == ERROR_NONE) d.read_interiors();
    clock.end(kInterior);
    if (d.error != ERROR_NONE) return false;
    uint32_t global[kPlaces] = {}, new_ids[kPlaces + kBatch] = {};
    uint32_t count = history.number(global, new_ids);
    if (count == History::kCircle || count > header.vertex_count - first) return false;
    history.append(global);
    clock.end(kNumber);
    write_triangles(d, global, triangles);
    clock.end(kTriangles);
    triangles += 3 * d.triangle_count;
    write_vertices(d, header.streams.data(), streams,
                   {new_ids, count, first, header.vertex_count - first}, outputs);
    clock.end(kValues);
    first += count;
  }
  return first == header.vertex_count;
}

bool decode_timed(Input& input, Clock& clock) {
  auto decoder = std::make_unique<SerialDecoder>();
  decoder->data = input.bytes.data();
  decoder->size = uint32_t(input.bytes.size());
  decoder->load_streams(0, uint32_t(input.header.streams.size()));
  History history(*decoder);
  history.start(0, 0);
  return decode_timed(input, *decoder, history, clock);
}

}  // namespace
}  // namespace meshlet

int main(int argc, char** argv) {
  using namespace meshlet;
#ifdef __AVX2__
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("bmi2")) {
    std::fputs("decode_stages: needs a processor with AVX2 and BMI2\n", stderr);
    return 2;
  }
#endif
  std::vector<Input> blobs;
  uint64_t readings = 0;
  for (int i = 1; i < argc; i++) {
    blobs.emplace_back(argv[i]);
    readings += blobs.back().header.meshlet_count;
  }
  const double cost = double(clock_cost() * readings);
  std::array<std::vector<double>, kStages> shares;
  std::vector<double> clock_share;
  for (int i = 0; i <= kRepetitions; i++) {  // the first one warms up
    Clock clock;
    for (Input& blob : blobs) {
      if (decode_timed(blob, clock)) continue;
      std::fputs("decode_stages: a blob is malformed\n", stderr);
      return 2;
    }
    double total = 0;
    for (uint64_t spent : clock.spent) total += double(spent);
    if (i == 0) continue;
    for (size_t s = 0; s < kStages; s++)
      shares[s].push_back(std::max(0.0, double(clock.spent[s]) - cost) / (total - kStages * cost));
    clock_share.push_back(kStages * cost / total);
  }
  std::printf("{\"avx2\": %s, \"clock_share\": %.6g, \"shares\": {",
#ifdef __AVX2__
              "true",
#else
              "false",
#endif
              clock_share.back());
  for (size_t s = 0; s < kStages; s++) {
    std::printf("%s\"%s\": [", s ? ", " : "", kNames[s]);
    for (size_t i = 0; i < shares[s].size(); i++)
      std::printf("%s%.6g", i ? ", " : "", shares[s][i]);
    std::printf("]");
  }
  std::printf("}}\n");
}

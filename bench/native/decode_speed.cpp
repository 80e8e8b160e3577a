// decode_speed BLOB...
//
// Times decoding without Python. Prints one JSON object with a list per figure, one entry per
// repetition: decode_seconds, all blobs to float arrays on one thread; meshlet_microseconds, mean
// of single meshlets in random order; parallel_seconds, all meshlets one by one, one thread per
// processor. The first two are times of the processor, which other programs disturb little.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "decode/decoder.h"
#include "format/malformed.h"
#include "common/parallel.h"

namespace {

constexpr int kRepetitions = 7;

using Bytes = std::vector<uint8_t>;

// The arrays for one decoded blob, allocated once.
struct Output {
  std::vector<uint32_t> triangles;
  std::vector<std::vector<float>> values;
  std::vector<void*> pointers;

  explicit Output(const gltf_meshlet_codec::BlobHeader& header)
      : triangles(3 * size_t(header.triangle_count)) {
    for (const gltf_meshlet_codec::Stream& stream : header.streams) {
      values.emplace_back(size_t(header.vertex_count) * gltf_meshlet_codec::value_count(stream));
      pointers.push_back(values.back().data());
    }
  }
};

double processor_seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

// A decoder, open on a blob.
struct OpenDecoder {
  std::shared_ptr<const gltf_meshlet_codec::Blob> blob;
  std::unique_ptr<gltf_meshlet_codec::Decoder> decoder = gltf_meshlet_codec::make_decoder();

  explicit OpenDecoder(std::shared_ptr<const gltf_meshlet_codec::Blob> given)
      : blob(std::move(given)) {
    decoder->open(*blob);
  }
};

double decode_all(std::vector<OpenDecoder>& decoders, std::vector<Output>& outputs) {
  const double start = processor_seconds();
  for (size_t i = 0; i < decoders.size(); i++)
    gltf_meshlet_codec::throw_if(decoders[i].decoder->decode(
        {outputs[i].triangles.data(), nullptr, outputs[i].pointers.data()}));
  return processor_seconds() - start;
}

void decode_one(gltf_meshlet_codec::Decoder& decoder, uint32_t number) {
  gltf_meshlet_codec::DecodedMeshlet decoded;
  gltf_meshlet_codec::throw_if(decoder.meshlet(number, decoded));
}

double decode_meshlets(std::vector<OpenDecoder>& decoders,
                       const std::vector<std::pair<size_t, uint32_t>>& order) {
  const double start = processor_seconds();
  for (const auto& [blob, number] : order) decode_one(*decoders[blob].decoder, number);
  return (processor_seconds() - start) / double(order.size()) * 1e6;
}

// Consecutive meshlets of one blob, decoded by one thread.
struct Range {
  OpenDecoder open;
  uint32_t begin, end;
};

std::vector<Range> ranges_of(const std::vector<OpenDecoder>& decoders) {
  constexpr uint32_t kRange = 512;
  std::vector<Range> ranges;
  for (const OpenDecoder& open : decoders) {
    const uint32_t count = open.blob->header.meshlet_count;
    for (uint32_t m = 0; m < count; m += kRange)
      ranges.push_back({OpenDecoder(open.blob), m, std::min(m + kRange, count)});
  }
  return ranges;
}

double decode_parallel(std::vector<Range>& ranges) {
  const auto start = std::chrono::steady_clock::now();
  gltf_meshlet_codec::parallel_for(0, ranges.size(), [&](size_t i) {
    for (uint32_t m = ranges[i].begin; m < ranges[i].end; m++)
      decode_one(*ranges[i].open.decoder, m);
  });
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Measures kRepetitions times, and prints the figures as a member of a JSON object.
template <class Measure>
void print_figures(const char* name, const char* end, const Measure& measure) {
  std::printf("\"%s\": [", name);
  for (int i = 0; i < kRepetitions; i++) std::printf("%s%.9g", i ? ", " : "", measure());
  std::printf("]%s", end);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<Bytes> blobs;
  for (int i = 1; i < argc; i++) {
    std::ifstream file(argv[i], std::ios::binary);
    blobs.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  std::vector<OpenDecoder> decoders;
  std::vector<Output> outputs;
  std::vector<std::pair<size_t, uint32_t>> order;
  for (size_t i = 0; i < blobs.size(); i++) {
    const uint8_t* data = blobs[i].data();
    const size_t size = blobs[i].size();
    auto blob =
        std::make_shared<gltf_meshlet_codec::Blob>(gltf_meshlet_codec::Blob{data, size, {}});
    gltf_meshlet_codec::throw_if(gltf_meshlet_codec::read_blob_header(data, size, blob->header));
    decoders.emplace_back(std::move(blob));
    const gltf_meshlet_codec::BlobHeader& header = decoders[i].blob->header;
    outputs.emplace_back(header);
    for (uint32_t m = 0; m < header.meshlet_count; m++) order.emplace_back(i, m);
  }
  std::mt19937 random(1);
  for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);

  std::vector<Range> ranges = ranges_of(decoders);

  std::printf("{");
  print_figures("decode_seconds", ", ", [&] { return decode_all(decoders, outputs); });
  print_figures("meshlet_microseconds", ", ", [&] { return decode_meshlets(decoders, order); });
  print_figures("parallel_seconds", "}\n", [&] { return decode_parallel(ranges); });
}

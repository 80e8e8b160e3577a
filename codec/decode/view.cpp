#include "decode/view.h"

#include <algorithm>
#include <cstring>

namespace meshlet {
namespace {

// The size of the blob that starts at `data`, of which `rest` bytes are left in the view. A last
// blob may be malformed in its length: read_blob_header says so.
size_t blob_size(const uint8_t* data, size_t rest) {
  if (rest < BLOB_HEADER_BYTES) return rest;
  uint32_t size;
  std::memcpy(&size, data + 4 * BLOB_WORD_BYTES, sizeof size);
  return size >= BLOB_HEADER_BYTES && size % 4 == 0 && size < rest ? size : rest;
}

bool same_stream(const Stream& a, const Stream& b) {
  return a.kind == b.kind && a.elements == b.elements && a.bits == b.bits && a.step == b.step &&
         std::equal(a.offset, a.offset + 4, b.offset);
}

bool same_streams(const std::vector<Stream>& a, const std::vector<Stream>& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), same_stream);
}

}  // namespace

Problem View::open(const uint8_t* data, size_t size) {
  for (size_t at = 0; at < size || blobs.empty(); at += blobs.back().size) {
    const uint32_t number = blobs.empty() ? kNoBlob : uint32_t(blobs.size());
    Blob blob{data + at, blob_size(data + at, size - at), {}};
    if (Problem problem = read_blob_header(blob.data, blob.size, blob.header)) {
      problem.blob = number;
      return problem;
    }
    if (!blobs.empty() && !same_streams(blob.header.streams, streams()))
      return {"its streams differ from those of the first blob", 0, NO_MESHLET, number};
    blob.first_triangle = triangle_count;
    blob.first_vertex = vertex_count;
    blob.first_meshlet = meshlet_count;
    triangle_count += blob.header.triangle_count;
    vertex_count += blob.header.vertex_count;
    meshlet_count += blob.header.meshlet_count;
    blobs.push_back(std::move(blob));
  }
  if (vertex_count > 0xFFFFFFFFu || 3 * triangle_count > 0xFFFFFFFFu)
    return {"the blobs have more vertices or indices than 32 bits can count"};
  return {};
}

size_t View::blob_of_meshlet(uint64_t m) const {
  const auto after = [](uint64_t number, const Blob& blob) { return number < blob.first_meshlet; };
  return size_t(std::upper_bound(blobs.begin(), blobs.end(), m, after) - blobs.begin()) - 1;
}

Problem View::decode(size_t number, const Outputs& out) const {
  const size_t first_vertex = size_t(blobs[number].first_vertex);
  std::vector<uint32_t*> integers(streams().size());
  std::vector<void*> values(streams().size());
  for (size_t s = 0; s < streams().size(); s++) {
    const Stream& stream = streams()[s];
    if (out.integers && out.integers[s])
      integers[s] = out.integers[s] + first_vertex * stream.elements;
    if (out.values && out.values[s])  // floats have the size of integers
      values[s] = static_cast<uint32_t*>(out.values[s]) + first_vertex * value_count(stream);
  }
  Outputs own;
  own.triangles = out.triangles + 3 * size_t(blobs[number].first_triangle);
  own.integers = integers.data();
  own.values = values.data();
  own.first_vertex = uint32_t(first_vertex);
  own.shared = out.shared;
  const std::unique_ptr<Decoder> decoder = make_decoder();
  decoder->open(blobs[number]);
  return located(decoder->decode(own), number);
}

Problem View::validate(size_t number) const {
  const std::unique_ptr<Decoder> decoder = make_decoder();
  decoder->open(blobs[number]);
  return located(decoder->validate(), number);
}

}  // namespace meshlet

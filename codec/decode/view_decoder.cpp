#include "decode/view_decoder.h"

#include <algorithm>
#include <string>

#include "common/parallel.h"

namespace meshlet {
namespace {

uint32_t load_u32(const uint8_t* p) {
  return uint32_t(p[0]) | uint32_t(p[1]) << 8 | uint32_t(p[2]) << 16 | uint32_t(p[3]) << 24;
}

// The size of the blob that starts at `data`, of which `rest` bytes are left in the view. A last
// blob may be malformed in its length: read_blob_header says so.
size_t blob_size(const uint8_t* data, size_t rest) {
  if (rest < BLOB_HEADER_BYTES) return rest;
  const size_t size = load_u32(data + 4 * BLOB_WORD_BYTES);
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

ViewDecoder::ViewDecoder(const uint8_t* data, size_t size) {
  for (size_t at = 0; at < size || blobs_.empty();) {
    ViewBlob blob{data + at, blob_size(data + at, size - at), {}, 0, 0, 0};
    try {
      blob.header = read_blob_header(blob.data, blob.size);
    } catch (const Malformed& error) {
      if (blobs_.empty()) throw;
      throw Malformed("blob " + std::to_string(blobs_.size()) + ": " + error.what());
    }
    if (!blobs_.empty() && !same_streams(blob.header.streams, streams()))
      throw Malformed("blob " + std::to_string(blobs_.size()) +
                      ": its streams differ from those of the first blob");
    blob.first_triangle = triangle_count_;
    blob.first_vertex = vertex_count_;
    blob.first_meshlet = meshlet_count_;
    triangle_count_ += blob.header.triangle_count;
    vertex_count_ += blob.header.vertex_count;
    meshlet_count_ += blob.header.meshlet_count;
    at += blob.size;
    blobs_.push_back(std::move(blob));
  }
  if (vertex_count_ > 0xFFFFFFFFu || 3 * triangle_count_ > 0xFFFFFFFFu)
    throw Malformed("the blobs have more vertices or indices than 32 bits can count");
}

void ViewDecoder::decode_one(const ViewBlob& blob, uint32_t* triangles, uint32_t* const* integers,
                             void* const* values) const {
  std::vector<uint32_t*> blob_integers;
  std::vector<void*> blob_values;
  for (size_t s = 0; s < streams().size(); s++) {
    const size_t v = size_t(blob.first_vertex);
    uint32_t* const to_integers = integers ? integers[s] : nullptr;
    uint32_t* const to_values = values ? static_cast<uint32_t*>(values[s]) : nullptr;
    blob_integers.push_back(to_integers ? to_integers + v * streams()[s].elements : nullptr);
    // Floats and integers have the same size.
    blob_values.push_back(to_values ? to_values + v * value_count(streams()[s]) : nullptr);
  }
  uint32_t* const first = triangles + 3 * size_t(blob.first_triangle);
  DecoderContext(blob.data, blob.size).decode(first, blob_integers.data(), blob_values.data());
  if (blob.first_vertex == 0) return;
  uint32_t* const last = first + 3 * size_t(blob.header.triangle_count);
  for (uint32_t* index = first; index < last; index++) *index += uint32_t(blob.first_vertex);
}

void ViewDecoder::decode(uint32_t* triangles, uint32_t* const* integers, void* const* values,
                         int threads) const {
  parallel_for(threads, blobs_.size(),
               [&](size_t b) { decode_one(blobs_[b], triangles, integers, values); });
}

void ViewDecoder::validate(int threads) const {
  parallel_for(threads, blobs_.size(), [&](size_t b) {
    DecoderContext(blobs_[b].data, blobs_[b].size).validate();
  });
}

}  // namespace meshlet

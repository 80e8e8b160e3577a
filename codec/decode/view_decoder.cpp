#include "decode/view_decoder.h"

#include <algorithm>
#include <string>

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

void ViewDecoder::decode(size_t number, uint32_t* triangles, uint32_t* const* integers,
                         void* const* values) const {
  const ViewBlob& blob = blobs_[number];
  const size_t first_vertex = size_t(blob.first_vertex);
  std::vector<uint32_t*> blob_integers;
  std::vector<void*> blob_values;
  for (size_t s = 0; s < streams().size(); s++) {
    uint32_t* const all_integers = integers[s];
    uint32_t* const all_values = static_cast<uint32_t*>(values[s]);  // floats have the same size
    blob_integers.push_back(all_integers ? all_integers + first_vertex * streams()[s].elements
                                         : nullptr);
    blob_values.push_back(all_values ? all_values + first_vertex * value_count(streams()[s])
                                     : nullptr);
  }
  uint32_t* const first = triangles + 3 * size_t(blob.first_triangle);
  try {
    DecoderContext(blob.data, blob.size).decode(first, blob_integers.data(), blob_values.data());
  } catch (const Malformed& error) {
    throw Malformed(named(number, error.what()));
  }
  if (first_vertex == 0) return;
  uint32_t* const last = first + 3 * size_t(blob.header.triangle_count);
  for (uint32_t* index = first; index < last; index++) *index += uint32_t(first_vertex);
}

void ViewDecoder::validate(size_t number) const {
  try {
    DecoderContext(blobs_[number].data, blobs_[number].size).validate();
  } catch (const Malformed& error) {
    throw Malformed(named(number, error.what()));
  }
}

std::string ViewDecoder::named(size_t blob, const char* problem) const {
  return blobs_.size() == 1 ? problem : "blob " + std::to_string(blob) + ": " + problem;
}

size_t ViewDecoder::blob_of_meshlet(uint64_t m) const {
  const auto after = [](uint64_t number, const ViewBlob& blob) {
    return number < blob.first_meshlet;
  };
  return size_t(std::upper_bound(blobs_.begin(), blobs_.end(), m, after) - blobs_.begin()) - 1;
}

DecodedMeshlet ViewMeshlets::meshlet(uint64_t m) {
  const size_t number = view_.blob_of_meshlet(m);
  const ViewBlob& blob = view_.blobs()[number];
  if (number != blob_) {
    decoder_->open(blob.data, blob.size);
    blob_ = number;
  }
  const uint32_t local = uint32_t(m - blob.first_meshlet);
  const DecodedMeshlet decoded = decoder_->decode(local);
  if (decoded.error != ERROR_NONE) {
    const std::string problem =
        "meshlet " + std::to_string(local) + ": " + error_text(decoded.error);
    throw Malformed(view_.named(number, problem.c_str()));
  }
  return decoded;
}

}  // namespace meshlet

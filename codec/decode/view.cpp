#include "decode/view.h"

#include <atomic>
#include <cstring>

#include "common/parallel.h"

namespace gltf_meshlet_codec {

// Meshlets of one blob that a thread decodes.
struct Range {
  uint32_t blob, first, count;
};

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

// Calls action(decoder, i) for all i < count, with a decoder for each thread. Returns the problem
// of the first i that has one.
template <class Action>
Problem for_decoders(int threads, size_t count, const Action& action) {
  List<Problem> problems;
  if (!problems.resize(count)) return {kNoMemory};
  for (Problem& problem : problems) problem = {};
  const size_t workers = std::min<size_t>(size_t(resolve_threads(threads)), count);
  std::atomic<size_t> next{0};
  parallel_for(int(workers), workers, [&](size_t) {
    const std::unique_ptr<Decoder> decoder = make_decoder();
    for (size_t i; (i = next++) < count;)
      problems[i] = decoder ? action(*decoder, i) : Problem{kNoMemory};
  });
  for (const Problem& problem : problems)
    if (problem) return problem;
  return {};
}

// A range costs as much as some meshlets more, since it decodes those at its border alone. Fuzzers
// know only small blobs.
#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
constexpr uint64_t kLeastRange = 2;
#else
constexpr uint64_t kLeastRange = 256;
#endif

// Ranges for so many threads: whole blobs, but for those that are more than a thread's share.
bool list_ranges(const View& view, int threads, List<Range>& ranges, bool& parts) {
  const uint64_t share = std::max(kLeastRange, view.meshlet_count / uint64_t(threads) + 1);
  parts = false;
  for (uint32_t b = 0; b < view.blobs.size(); b++) {
    const uint32_t meshlets = view.blobs[b].meshlet_count;
    const uint32_t pieces = threads > 1 ? uint32_t((meshlets + share - 1) / share) : 1;
    parts = parts || pieces > 1;
    for (uint32_t i = 0; i < pieces; i++) {
      const uint32_t first = uint32_t(uint64_t(meshlets) * i / pieces),
                     end = uint32_t(uint64_t(meshlets) * (i + 1) / pieces);
      if (!ranges.push({b, first, end - first})) return false;
    }
  }
  return true;
}

}  // namespace

bool same_streams(const StreamTable& a, const StreamTable& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), same_stream);
}

Problem View::open(const uint8_t* data, size_t size) {
  StreamTable others;
  for (size_t at = 0; at < size || blobs.size() == 0; at += blobs.back().size) {
    const uint32_t number = blobs.size() == 0 ? kNoBlob : uint32_t(blobs.size());
    ViewBlob blob{};
    blob.data = data + at;
    blob.size = blob_size(data + at, size - at);
    if (Problem problem =
            read_blob_header(blob.data, blob.size, blob, number == kNoBlob ? streams : others)) {
      problem.blob = number;
      return problem;
    }
    if (number != kNoBlob && !same_streams(others, streams))
      return {"its streams differ from those of the first blob", 0, NO_MESHLET, number};
    blob.first_triangle = triangle_count;
    blob.first_vertex = vertex_count;
    blob.first_meshlet = meshlet_count;
    triangle_count += blob.triangle_count;
    vertex_count += blob.vertex_count;
    meshlet_count += blob.meshlet_count;
    if (!blobs.push(blob)) return {kNoMemory};
  }
  if (vertex_count > 0xFFFFFFFFu || 3 * triangle_count > 0xFFFFFFFFu)
    return {"the blobs have more vertices or indices than 32 bits can count"};
  return {};
}

size_t View::blob_of_meshlet(uint64_t m) const {
  const auto after = [](uint64_t number, const ViewBlob& blob) {
    return number < blob.first_meshlet;
  };
  return size_t(std::upper_bound(blobs.begin(), blobs.end(), m, after) - blobs.begin()) - 1;
}

Problem View::decode_blob(Decoder& decoder, size_t number, const Outputs& out) const {
  const size_t first_vertex = size_t(blobs[number].first_vertex);
  uint32_t* integers[BLOB_MAX_STREAMS] = {};
  void* values[BLOB_MAX_STREAMS] = {};
  for (size_t s = 0; s < streams.size(); s++) {
    if (out.integers && out.integers[s])
      integers[s] = out.integers[s] + first_vertex * streams[s].elements;
    if (out.values && out.values[s])  // floats have the size of integers
      values[s] = static_cast<uint32_t*>(out.values[s]) + first_vertex * value_count(streams[s]);
  }
  Outputs own;
  const size_t first_corner = 3 * size_t(blobs[number].first_triangle);
  if (out.triangles) own.triangles = out.triangles + first_corner;
  if (out.narrow_triangles) own.narrow_triangles = out.narrow_triangles + first_corner;
  own.attributes = out.attributes;
  own.attribute_count = out.attribute_count;
  own.attribute_row = first_vertex;
  if (out.bounds) own.bounds = out.bounds + blobs[number].first_meshlet;
  own.integers = integers;
  own.values = values;
  own.first_vertex = uint32_t(first_vertex);
  own.shared = out.shared;
  open_decoder(decoder, number);
  return located(decoder.decode(own), number);
}

Problem View::decode_range(Decoder& decoder, uint64_t first, uint64_t count, const Outputs& out,
                           DecodedCounts& counts) const {
  const size_t number = blob_of_meshlet(first);
  const ViewBlob& blob = blobs[number];
  Outputs own = out;
  own.triangle_begins += blob.first_meshlet;
  own.vertex_begins += blob.first_meshlet;
  own.vertex_limit = uint32_t(vertex_count);
  if (out.bounds) own.bounds += first;
  return located(
      decoder.decode(uint32_t(first - blob.first_meshlet), uint32_t(count), {}, own, counts),
      number);
}

Problem View::decode(int threads, const Outputs& out) const {
  threads = resolve_threads(threads);
  List<Range> ranges;
  bool parts;
  if (!list_ranges(*this, threads, ranges, parts)) return {kNoMemory};
  // What ranges share with earlier ones is not known in each of them.
  if (parts && !out.shared && !decode_in_ranges(threads, ranges, out)) return {};
  // Also after a problem, to have that of one thread.
  return for_decoders(threads, blobs.size(),
                      [&](Decoder& decoder, size_t b) { return decode_blob(decoder, b, out); });
}

Problem View::decode_in_ranges(int threads, const List<Range>& ranges, const Outputs& out) const {
  List<uint32_t> begins[2];
  for (auto& list : begins)
    if (!list.resize(size_t(meshlet_count) + 1)) return {kNoMemory};
  if (const Problem problem = list_begins(threads, begins[0].data(), begins[1].data()))
    return problem;
  return for_decoders(threads, ranges.size(), [&](Decoder& decoder, size_t i) {
    const Range& range = ranges[i];
    const ViewBlob& blob = blobs[range.blob];
    if (range.count == blob.meshlet_count) return decode_blob(decoder, range.blob, out);
    const uint64_t first = blob.first_meshlet + range.first;
    Outputs own = out;
    own.triangle_begins = begins[0].data();
    own.vertex_begins = begins[1].data();
    DecodedCounts counts;
    open_decoder(decoder, range.blob);
    return decode_range(decoder, first, range.count, own, counts);
  });
}

Problem View::list_begins(int threads, uint32_t* triangle_begins, uint32_t* vertex_begins) const {
  for (const ViewBlob& blob : blobs)
    if (triangle_begins)
      list_triangle_begins(blob.data, blob.meshlet_count, uint32_t(blob.first_triangle),
                           triangle_begins + blob.first_meshlet);
  if (!vertex_begins) return {};
  List<Range> ranges;
  bool parts;
  if (!list_ranges(*this, resolve_threads(threads), ranges, parts)) return {kNoMemory};
  const Problem problem = for_decoders(threads, ranges.size(), [&](Decoder& decoder, size_t i) {
    const Range& range = ranges[i];
    open_decoder(decoder, range.blob);
    const uint64_t first = blobs[range.blob].first_meshlet + range.first;
    return located(decoder.count_vertices(range.first, range.count, vertex_begins + first),
                   range.blob);
  });
  if (problem) return problem;
  for (size_t b = 0; b < blobs.size(); b++) {
    uint64_t number = blobs[b].first_vertex;
    for (uint32_t i = 0; i < blobs[b].meshlet_count; i++) {
      uint32_t& begin = vertex_begins[blobs[b].first_meshlet + i];
      const uint32_t count = begin;
      begin = uint32_t(number);
      number += count;
      if (number > 0xFFFFFFFFu) break;
    }
    if (number != blobs[b].first_vertex + blobs[b].vertex_count)
      return located({"the meshlets' new vertices do not sum to the header's count"}, b);
  }
  vertex_begins[meshlet_count] = uint32_t(vertex_count);
  return {};
}

Problem View::validate(int threads) const {
  return for_decoders(threads, blobs.size(), [&](Decoder& decoder, size_t b) {
    open_decoder(decoder, b);
    return located(decoder.validate(), b);
  });
}

}  // namespace gltf_meshlet_codec

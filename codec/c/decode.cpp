// The part of the C interface that decodes.
#include <atomic>

#include "c/objects.h"
#include "common/parallel.h"
#include "decode/view.h"
#include "transport/transport.h"

namespace meshlet {
namespace {

static_assert(sizeof(gltf_meshlet_stream) == BLOB_STREAM_BYTES);
static_assert(GLTF_MESHLET_TRIANGLES == MESHLET_TRIANGLES);
static_assert(GLTF_MESHLET_VERTICES == MESHLET_VERTICES);
static_assert(GLTF_MESHLET_STREAMS == BLOB_MAX_STREAMS);
static_assert(GLTF_MESHLET_ELEMENTS == STREAM_MAX_ELEMENTS);
static_assert(GLTF_MESHLET_GRID == KIND_GRID && GLTF_MESHLET_OCT == KIND_OCT);
static_assert(GLTF_MESHLET_INTEGER == KIND_INTEGER && GLTF_MESHLET_FLOAT32 == KIND_FLOAT32);
static_assert(GLTF_MESHLET_SIGN == KIND_SIGN && GLTF_MESHLET_COPY == PREDICT_COPY);
static_assert(GLTF_MESHLET_PARALLELOGRAM == PREDICT_PARALLELOGRAM);
static_assert(GLTF_MESHLET_MEAN == PREDICT_MEAN && GLTF_MESHLET_DAMPED == PREDICT_DAMPED);
static_assert(GLTF_MESHLET_GEO == PREDICT_GEO && GLTF_MESHLET_AFFINE == PREDICT_AFFINE);

struct OpenView : Object {
  static constexpr Kind kKind = Kind::kView;
  View view;
  std::atomic_flag in_use = ATOMIC_FLAG_INIT;  // the decoder is
  std::unique_ptr<Decoder> decoder;            // made when it is needed
  size_t open_blob = SIZE_MAX;                 // in the decoder

  OpenView() : Object(kKind) {}

  // Returns the decoder with the blob that holds meshlet m, which must exist.
  Decoder& decoder_at(uint64_t m) {
    const size_t number = view.blob_of_meshlet(m);
    if (!decoder) decoder = make_decoder();
    if (number != open_blob) decoder->open(view.blobs[number]);
    open_blob = number;
    return *decoder;
  }
};

int malformed(const Problem& problem) {
  return problem ? fail(GLTF_MESHLET_MALFORMED, sentence(problem).c_str()) : kOk;
}

// Runs action(number) for all blobs; returns the status of the first one that is malformed.
template <class Action>
int for_blobs(const View& view, int32_t threads, const Action& action) {
  std::vector<Problem> problems(view.blobs.size());
  parallel_for(thread_count(threads), problems.size(), [&](size_t b) { problems[b] = action(b); });
  for (const Problem& problem : problems)
    if (problem) return malformed(problem);
  return kOk;
}

// Runs action(view), if no other thread decodes with it.
template <class Action>
int alone_with(const void* handle, const Action& action) {
  return with<OpenView>(handle, [&](OpenView& open) {
    if (open.in_use.test_and_set()) return fail(GLTF_MESHLET_BUSY, "another thread uses the view");
    const std::unique_ptr<std::atomic_flag, void (*)(std::atomic_flag*)> end(
        &open.in_use, [](std::atomic_flag* flag) { flag->clear(); });
    return action(open);
  });
}

int no_such(const char* sentence) { return fail(GLTF_MESHLET_NUMBER, sentence); }

constexpr const char* kRoom = "an array has too little room";

// Copies vertices. A known number of elements saves calls of memmove.
template <uint32_t elements>
void copy_vertices(const uint32_t* from, uint32_t vertices, uint32_t* to) {
  for (uint32_t v = 0; v < vertices; v++, from += STREAM_MAX_ELEMENTS, to += elements)
    for (uint32_t c = 0; c < elements; c++) to[c] = from[c];
}

void copy_meshlet(const DecodedMeshlet& m, const std::vector<Stream>& streams, uint8_t* triangles,
                  uint32_t* integers) {
  constexpr decltype(&copy_vertices<1>) copy[] = {copy_vertices<1>, copy_vertices<2>,
                                                  copy_vertices<3>, copy_vertices<4>};
  if (triangles)
    for (uint32_t i = 0; i < m.triangle_count; i++, triangles += 3)
      for (uint32_t k = 0; k < 3; k++) triangles[k] = uint8_t(m.triangles[i] >> 8 * k);
  if (!integers) return;
  for (uint32_t s = 0; s < streams.size(); s++) {
    copy[streams[s].elements - 1](m.vertex(s, 0), m.vertex_count, integers);
    integers += MESHLET_VERTICES * streams[s].elements;
  }
}

}  // namespace

void copy_statistics(const BitStatistics& from, gltf_meshlet_statistics& to) {
  to.connectivity_bits = from.connectivity;
  to.reference_bits = from.references;
  std::copy(from.streams.begin(), from.streams.end(), to.stream_bits);
  std::copy(from.symbols, from.symbols + 5, to.symbols);
  to.disks = from.disks;
  to.owned_references = from.owned_references;
  to.private_references = from.private_references;
  to.foreign_references = from.foreign_references;
}

}  // namespace meshlet

using namespace meshlet;

int gltf_meshlet_open(const void* bytes, size_t size, gltf_meshlet_view** view) {
  return guarded([&] {
    if (!bytes || !view) return bad_argument(kNull);
    *view = nullptr;
    auto opened = std::make_shared<OpenView>();
    if (const Problem p = opened->view.open(static_cast<const uint8_t*>(bytes), size))
      return malformed(p);
    *view = static_cast<gltf_meshlet_view*>(new_handle(std::move(opened)));
    return kOk;
  });
}

int gltf_meshlet_get_counts(const gltf_meshlet_view* view, gltf_meshlet_counts* counts) {
  return with<OpenView>(view, [&](const OpenView& open) {
    const View& v = open.view;
    uint64_t decoded = 0, bytes = 0;
    for (const Blob& blob : v.blobs) {
      decoded += decoded_bytes(blob.header);
      bytes += blob.size;
    }
    return give({0, uint32_t(v.blobs.size()), uint32_t(v.streams().size()),
                 needs_proof(decoded, bytes), v.triangle_count, v.vertex_count, v.meshlet_count},
                counts);
  });
}

int gltf_meshlet_get_blob(const gltf_meshlet_view* view, uint32_t blob, gltf_meshlet_blob* out) {
  return with<OpenView>(view, [&](const OpenView& open) {
    if (blob >= open.view.blobs.size()) return no_such("there is no such blob");
    const Blob& b = open.view.blobs[blob];
    const BlobHeader& h = b.header;
    return give(
        {0, h.data_offset, uint64_t(b.data - open.view.blobs[0].data), b.size, h.triangle_count,
         h.vertex_count, h.meshlet_count, b.first_triangle, b.first_vertex, b.first_meshlet},
        out);
  });
}

int gltf_meshlet_get_stream(const gltf_meshlet_view* view, uint32_t blob, uint32_t stream,
                            gltf_meshlet_stream* out) {
  return with<OpenView>(view, [&](const OpenView& open) {
    if (!out) return bad_argument(kNull);
    if (blob >= open.view.blobs.size() || stream >= open.view.streams().size())
      return no_such("there is no such stream");
    const Stream& s = open.view.blobs[blob].header.streams[stream];
    *out = {s.kind,          s.elements,    s.bits, s.predictor, s.chain_base,
            s.interior_base, s.anchor_base, 0,      s.step,      {}};
    std::copy(s.offset, s.offset + STREAM_MAX_ELEMENTS, out->offset);
    return kOk;
  });
}

int gltf_meshlet_get_meshlet_triangles(const gltf_meshlet_view* view, uint32_t blob,
                                       uint32_t* triangles, size_t room) {
  return with<OpenView>(view, [&](const OpenView& open) {
    if (!triangles) return bad_argument(kNull);
    if (blob >= open.view.blobs.size()) return no_such("there is no such blob");
    const Blob& b = open.view.blobs[blob];
    if (room < b.header.meshlet_count) return bad_argument(kRoom);
    const std::vector<uint32_t> counts = meshlet_triangle_counts(b.data, b.header);
    std::copy(counts.begin(), counts.end(), triangles);
    return kOk;
  });
}

int gltf_meshlet_get_statistics(const gltf_meshlet_view* view, gltf_meshlet_statistics* out) {
  return with<OpenView>(view, [&](const OpenView& open) {
    BitStatistics bits, one;
    for (size_t b = 0; b < open.view.blobs.size(); b++) {
      if (const Problem problem = count_bits(open.view.blobs[b], one))
        return malformed(open.view.located(problem, b));
      bits.add(one);
    }
    gltf_meshlet_statistics found{};
    copy_statistics(bits, found);
    return give(found, out);
  });
}

int gltf_meshlet_validate(const gltf_meshlet_view* view, int32_t threads) {
  return with<OpenView>(view, [&](const OpenView& open) {
    return for_blobs(open.view, threads, [&](size_t b) { return open.view.validate(b); });
  });
}

int gltf_meshlet_decode(const gltf_meshlet_view* view, int32_t threads,
                        gltf_meshlet_arrays* arrays) {
  return with<OpenView>(view, [&](const OpenView& open) {
    const View& v = open.view;
    gltf_meshlet_arrays to;
    if (!take(arrays, to)) return bad_argument(kWrongSize);
    if (!to.triangles) return bad_argument(kNull);
    if (to.first_vertex) return bad_argument("the first vertex of a whole view is not 0");
    if (to.triangle_room < v.triangle_count || to.vertex_room < v.vertex_count)
      return bad_argument(kRoom);
    Outputs out{to.triangles, to.integers, to.values};
    out.shared = to.shared;
    arrays->triangles_out = v.triangle_count;
    arrays->vertices_out = v.vertex_count;
    return for_blobs(v, threads, [&](size_t b) { return v.decode(b, out); });
  });
}

int gltf_meshlet_decode_range(gltf_meshlet_view* view, uint64_t first, uint64_t count,
                              gltf_meshlet_arrays* arrays) {
  return alone_with(view, [&](OpenView& open) {
    gltf_meshlet_arrays to;
    if (!take(arrays, to)) return bad_argument(kWrongSize);
    if (!to.triangles) return bad_argument(kNull);
    if (to.shared) return bad_argument("shared vertices are found in whole views only");
    if (count == 0 || first >= open.view.meshlet_count)
      return no_such("there are no such meshlets");
    const Blob& blob = open.view.blobs[open.view.blob_of_meshlet(first)];
    const uint64_t local = first - blob.first_meshlet, meshlets = blob.header.meshlet_count;
    if (count > meshlets - local) return no_such("the blob has fewer meshlets");
    const bool whole = count == meshlets;
    if (to.triangle_room < (whole ? blob.header.triangle_count : MESHLET_TRIANGLES * count) ||
        to.vertex_room < (whole ? blob.header.vertex_count : MESHLET_VERTICES * count))
      return bad_argument(kRoom);
    DecodedCounts decoded;
    const Problem problem = open.decoder_at(first).decode(
        uint32_t(local), uint32_t(count), {},
        {to.triangles, to.integers, to.values, to.first_vertex}, decoded);
    arrays->triangles_out = decoded.triangles;
    arrays->vertices_out = decoded.vertices;
    return malformed(open.view.located(problem, open.open_blob));
  });
}

int gltf_meshlet_decode_meshlets(gltf_meshlet_view* view, const uint32_t* meshlets, size_t count,
                                 uint32_t* sizes, uint8_t* triangles, uint32_t* integers) {
  return alone_with(view, [&](OpenView& open) {
    if (!meshlets && count) return bad_argument(kNull);
    const std::vector<Stream>& streams = open.view.streams();
    size_t elements = 0;
    for (const Stream& s : streams) elements += s.elements;
    for (size_t i = 0; i < count; i++) {
      if (meshlets[i] >= open.view.meshlet_count) return no_such("no such meshlet");
      Decoder& decoder = open.decoder_at(meshlets[i]);
      const uint64_t first = open.view.blobs[open.open_blob].first_meshlet;
      DecodedMeshlet m;
      if (const Problem problem = decoder.meshlet(uint32_t(meshlets[i] - first), m))
        return malformed(open.view.located(problem, open.open_blob));
      copy_meshlet(m, streams, triangles ? triangles + 3 * MESHLET_TRIANGLES * i : nullptr,
                   integers ? integers + MESHLET_VERTICES * elements * i : nullptr);
      if (!sizes) continue;
      sizes[2 * i] = m.triangle_count;
      sizes[2 * i + 1] = m.vertex_count;
    }
    return kOk;
  });
}

int gltf_meshlet_get_unpacked_bytes(const void* packed, size_t size, size_t* bytes) {
  return guarded([&] {
    if (!packed || !bytes) return bad_argument(kNull);
    std::vector<PackedPage> pages;
    if (const Problem p = read_page_table(static_cast<const uint8_t*>(packed), size, pages))
      return malformed(p);
    *bytes = pages.back().begin + pages.back().bytes;
    return kOk;
  });
}

int gltf_meshlet_unpack(const void* packed, size_t size, int32_t threads, void* view, size_t room) {
  return guarded([&] {
    if (!packed || !view) return bad_argument(kNull);
    const auto* bytes = static_cast<const uint8_t*>(packed);
    std::vector<PackedPage> pages;
    if (const Problem p = read_page_table(bytes, size, pages)) return malformed(p);
    if (room < pages.back().begin + pages.back().bytes) return bad_argument(kRoom);
    std::vector<Problem> problems(pages.size());
    const size_t workers = std::min<size_t>(resolve_threads(thread_count(threads)), pages.size());
    std::atomic<size_t> next{0};
    parallel_for(int(workers), workers, [&](size_t) {
      const auto unpacker = make_page_unpacker();
      for (size_t p; (p = next++) < pages.size();)
        problems[p] =
            unpacker->unpack(bytes, pages[p], static_cast<uint8_t*>(view) + pages[p].begin);
    });
    for (const Problem& problem : problems)
      if (problem) return malformed(problem);
    return kOk;
  });
}

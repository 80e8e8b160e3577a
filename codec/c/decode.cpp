// The part of the C interface that decodes.
#include <atomic>

#include "c/objects.h"
#include "common/parallel.h"
#include "decode/view.h"
#include "transport/transport.h"

namespace gltf_meshlet_codec {
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
  const size_t number = next_number();  // of this view among all: addresses are given again

  OpenView() : Object(kKind) {}

  static size_t next_number() {
    static std::atomic<size_t> last{0};
    return ++last;
  }
};

// A decoder and the blob that it is open on.
struct Scratch : Object {
  static constexpr Kind kKind = Kind::kScratch;
  std::atomic_flag in_use = ATOMIC_FLAG_INIT;
  std::unique_ptr<Decoder> decoder;  // made when it is needed
  size_t view = 0, blob = 0;

  Scratch() : Object(kKind) {}

  // Returns the decoder, open on the blob; null if there is no memory.
  Decoder* decoder_at(const OpenView& open, size_t number) {
    if (!decoder) decoder = make_decoder();
    if (!decoder) return nullptr;
    if (view != open.number || blob != number) open.view.open_decoder(*decoder, number);
    view = open.number;
    blob = number;
    return decoder.get();
  }
};

// Runs action(view, scratch), if no other thread uses the scratch. Null: one for this call.
template <class Action>
int with_scratch(const gltf_meshlet_view* view, gltf_meshlet_scratch* scratch,
                 const Action& action) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    if (!scratch) {
      Scratch own;
      return action(open, own);
    }
    Scratch* const kept = object_of<Scratch>(scratch);
    if (!kept) return bad_argument(kWrongObject);
    if (kept->in_use.test_and_set(std::memory_order_acquire))
      return fail(GLTF_MESHLET_BUSY, "another thread uses the scratch");
    struct End {
      std::atomic_flag& flag;
      ~End() { flag.clear(std::memory_order_release); }
    } end{kept->in_use};
    return action(open, *kept);
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

void copy_meshlet(const DecodedMeshlet& m, const StreamTable& streams, uint8_t* triangles,
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

bool are_begins(const uint32_t* begins, uint64_t first, uint64_t count, uint64_t total) {
  for (uint64_t m = first; m < first + count; m++)
    if (begins[m] > begins[m + 1]) return false;
  return begins[first + count] <= total;
}

// Decodes a range to the caller's arrays of the whole view.
int decode_to_view(const View& view, Decoder& decoder, uint64_t first, uint64_t count,
                   const gltf_meshlet_arrays& to, DecodedCounts& decoded) {
  if (!to.vertex_begins || !to.triangle_begins) return bad_argument(kNull);
  if (to.first_vertex) return bad_argument("the first vertex of a whole view is not 0");
  if (to.triangle_room < view.triangle_count || to.vertex_room < view.vertex_count)
    return bad_argument(kRoom);
  if (!are_begins(to.triangle_begins, first, count, view.triangle_count) ||
      !are_begins(to.vertex_begins, first, count, view.vertex_count))
    return bad_argument("the begins are not those of the view");
  Outputs out{to.triangles, to.integers, to.values};
  out.triangle_begins = to.triangle_begins;
  out.vertex_begins = to.vertex_begins;
  return status_of(view.decode_range(decoder, first, count, out, decoded));
}

// Decodes a range to arrays that hold nothing else.
int decode_alone(const View& view, Decoder& decoder, uint64_t first, uint64_t count,
                 const gltf_meshlet_arrays& to, DecodedCounts& decoded) {
  const size_t number = view.blob_of_meshlet(first);
  const ViewBlob& blob = view.blobs[number];
  const bool whole = count == blob.meshlet_count;
  if (to.triangle_room < (whole ? blob.triangle_count : MESHLET_TRIANGLES * count) ||
      to.vertex_room < (whole ? blob.vertex_count : MESHLET_VERTICES * count))
    return bad_argument(kRoom);
  decoder.restart();
  return status_of(
      view.located(decoder.decode(uint32_t(first - blob.first_meshlet), uint32_t(count), {},
                                  {to.triangles, to.integers, to.values, to.first_vertex}, decoded),
                   number));
}

}  // namespace

void copy_statistics(const BitStatistics& from, gltf_meshlet_statistics& to) {
  to.connectivity_bits = from.connectivity;
  to.reference_bits = from.references;
  std::copy(from.streams, from.streams + BLOB_MAX_STREAMS, to.stream_bits);
  std::copy(from.symbols, from.symbols + 5, to.symbols);
  to.disks = from.disks;
  to.owned_references = from.owned_references;
  to.private_references = from.private_references;
  to.foreign_references = from.foreign_references;
}

}  // namespace gltf_meshlet_codec

using namespace gltf_meshlet_codec;

int gltf_meshlet_open(const void* bytes, size_t size, gltf_meshlet_view** view) {
  return guarded([&] {
    if (!bytes || !view) return bad_argument(kNull);
    *view = nullptr;
    std::unique_ptr<OpenView> opened(new OpenView);
    if (!opened) return fail({kNoMemory});
    if (const Problem p = opened->view.open(static_cast<const uint8_t*>(bytes), size))
      return fail(p);
    return give_object(std::move(opened), view);
  });
}

int gltf_meshlet_open_scratch(gltf_meshlet_scratch** scratch) {
  return guarded([&] {
    if (!scratch) return bad_argument(kNull);
    *scratch = nullptr;
    return give_object(std::unique_ptr<Scratch>(new Scratch), scratch);
  });
}

int gltf_meshlet_get_counts(const gltf_meshlet_view* view, gltf_meshlet_counts* counts) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    const View& v = open.view;
    uint64_t decoded = 0, bytes = 0;
    for (const ViewBlob& blob : v.blobs) {
      decoded += decoded_bytes(blob, v.streams);
      bytes += blob.size;
    }
    return give({0, uint32_t(v.blobs.size()), v.streams.size(), needs_proof(decoded, bytes),
                 v.triangle_count, v.vertex_count, v.meshlet_count},
                counts);
  });
}

int gltf_meshlet_get_blob(const gltf_meshlet_view* view, uint32_t blob, gltf_meshlet_blob* out) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    if (blob >= open.view.blobs.size()) return no_such("there is no such blob");
    const ViewBlob& b = open.view.blobs[blob];
    return give(
        {0, b.data_offset, uint64_t(b.data - open.view.blobs[0].data), b.size, b.triangle_count,
         b.vertex_count, b.meshlet_count, b.first_triangle, b.first_vertex, b.first_meshlet},
        out);
  });
}

int gltf_meshlet_get_stream(const gltf_meshlet_view* view, uint32_t blob, uint32_t stream,
                            gltf_meshlet_stream* out) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    if (!out) return bad_argument(kNull);
    if (blob >= open.view.blobs.size() || stream >= open.view.streams.size())
      return no_such("there is no such stream");
    const Stream s = read_stream(open.view.blobs[blob].data, stream);
    *out = {s.kind,          s.elements,    s.bits, s.predictor, s.chain_base,
            s.interior_base, s.anchor_base, 0,      s.step,      {}};
    std::copy(s.offset, s.offset + STREAM_MAX_ELEMENTS, out->offset);
    return kOk;
  });
}

int gltf_meshlet_get_begins(const gltf_meshlet_view* view, int32_t threads,
                            uint32_t* triangle_begins, uint32_t* vertex_begins, size_t room) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    if (threads < 0) return bad_argument(kThreads);
    if (room <= open.view.meshlet_count) return bad_argument(kRoom);
    return status_of(open.view.list_begins(thread_count(threads), triangle_begins, vertex_begins));
  });
}

int gltf_meshlet_get_statistics(const gltf_meshlet_view* view, gltf_meshlet_statistics* out) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    BitStatistics bits, one;
    for (size_t b = 0; b < open.view.blobs.size(); b++) {
      if (const Problem p = count_bits(open.view.blobs[b].data, open.view.blobs[b].size, one))
        return fail(open.view.located(p, b));
      bits.add(one);
    }
    gltf_meshlet_statistics found{};
    copy_statistics(bits, found);
    return give(found, out);
  });
}

int gltf_meshlet_validate(const gltf_meshlet_view* view, int32_t threads) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    if (threads < 0) return bad_argument(kThreads);
    return status_of(open.view.validate(thread_count(threads)));
  });
}

int gltf_meshlet_decode(const gltf_meshlet_view* view, int32_t threads,
                        const gltf_meshlet_arrays* arrays) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    const View& v = open.view;
    gltf_meshlet_arrays to;
    if (threads < 0) return bad_argument(kThreads);
    if (!take(arrays, to)) return bad_argument(kWrongSize);
    if (!to.triangles) return bad_argument(kNull);
    if (to.first_vertex) return bad_argument("the first vertex of a whole view is not 0");
    if (to.triangle_room < v.triangle_count || to.vertex_room < v.vertex_count)
      return bad_argument(kRoom);
    return status_of(v.decode(thread_count(threads), {to.triangles, to.integers, to.values}));
  });
}

int gltf_meshlet_decode_range(const gltf_meshlet_view* view, gltf_meshlet_scratch* scratch,
                              uint64_t first, uint64_t count, const gltf_meshlet_arrays* arrays,
                              uint32_t* sizes) {
  return with_scratch(view, scratch, [&](const OpenView& open, Scratch& s) {
    gltf_meshlet_arrays to;
    if (!take(arrays, to)) return bad_argument(kWrongSize);
    if (!to.triangles) return bad_argument(kNull);
    if (count == 0 || first >= open.view.meshlet_count)
      return no_such("there are no such meshlets");
    const size_t number = open.view.blob_of_meshlet(first);
    const ViewBlob& blob = open.view.blobs[number];
    if (count > blob.meshlet_count - (first - blob.first_meshlet))
      return no_such("the blob has fewer meshlets");
    Decoder* const decoder = s.decoder_at(open, number);
    if (!decoder) return fail({kNoMemory});
    DecodedCounts decoded;
    const int status = to.vertex_begins || to.triangle_begins
                           ? decode_to_view(open.view, *decoder, first, count, to, decoded)
                           : decode_alone(open.view, *decoder, first, count, to, decoded);
    if (sizes) {
      sizes[0] = decoded.triangles;
      sizes[1] = decoded.vertices;
    }
    return status;
  });
}

int gltf_meshlet_decode_meshlets(const gltf_meshlet_view* view, gltf_meshlet_scratch* scratch,
                                 const uint32_t* meshlets, size_t count, uint32_t* sizes,
                                 uint8_t* triangles, uint32_t* integers) {
  return with_scratch(view, scratch, [&](const OpenView& open, Scratch& s) {
    if (!meshlets && count) return bad_argument(kNull);
    const StreamTable& streams = open.view.streams;
    size_t elements = 0;
    for (const Stream& stream : streams) elements += stream.elements;
    for (size_t i = 0; i < count; i++) {
      if (meshlets[i] >= open.view.meshlet_count) return no_such("no such meshlet");
      const size_t blob = open.view.blob_of_meshlet(meshlets[i]);
      Decoder* const decoder = s.decoder_at(open, blob);
      if (!decoder) return fail({kNoMemory});
      DecodedMeshlet m;
      if (const Problem problem =
              decoder->meshlet(uint32_t(meshlets[i] - open.view.blobs[blob].first_meshlet), m))
        return fail(open.view.located(problem, blob));
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
    List<PackedPage> pages;
    if (const Problem p = read_page_table(static_cast<const uint8_t*>(packed), size, pages))
      return fail(p);
    *bytes = pages.back().begin + pages.back().bytes;
    return kOk;
  });
}

int gltf_meshlet_unpack(const void* packed, size_t size, int32_t threads, void* view, size_t room) {
  return guarded([&] {
    if (!packed || !view) return bad_argument(kNull);
    if (threads < 0) return bad_argument(kThreads);
    const auto* bytes = static_cast<const uint8_t*>(packed);
    List<PackedPage> pages;
    if (const Problem p = read_page_table(bytes, size, pages)) return fail(p);
    if (room < pages.back().begin + pages.back().bytes) return bad_argument(kRoom);
    List<Problem> problems;
    if (!problems.resize(pages.size())) return fail({kNoMemory});
    const size_t workers =
        std::min<size_t>(size_t(resolve_threads(thread_count(threads))), pages.size());
    std::atomic<size_t> next{0};
    parallel_for(int(workers), workers, [&](size_t) {
      const auto unpacker = make_page_unpacker();
      for (size_t p; (p = next++) < pages.size();)
        problems[p] = unpacker ? unpacker->unpack(bytes, pages[p],
                                                  static_cast<uint8_t*>(view) + pages[p].begin)
                               : Problem{kNoMemory};
    });
    for (const Problem& problem : problems)
      if (problem) return fail(problem);
    return kOk;
  });
}

// The part of the C interface that decodes.
#include <atomic>

#include "c/open_view.h"
#include "common/parallel.h"
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

// Copies vertices. A known number of elements saves calls of memmove.
template <uint32_t elements>
void copy_vertices(const uint32_t* from, uint32_t vertices, uint32_t* to) {
  for (uint32_t v = 0; v < vertices; v++, from += STREAM_MAX_ELEMENTS, to += elements)
    for (uint32_t c = 0; c < elements; c++) to[c] = from[c];
}

void copy_meshlet(const DecodedMeshlet& m, const StreamTable& streams, uint8_t* triangles,
                  uint32_t triangle_bytes, uint32_t* integers) {
  constexpr decltype(&copy_vertices<1>) copy[] = {copy_vertices<1>, copy_vertices<2>,
                                                  copy_vertices<3>, copy_vertices<4>};
  if (triangles)
    for (uint32_t i = 0; i < m.triangle_count; i++, triangles += triangle_bytes)
      for (uint32_t k = 0; k < triangle_bytes; k++)
        triangles[k] = k < 3 ? uint8_t(m.triangles[i] >> 8 * k) : uint8_t(0);
  if (!integers) return;
  for (uint32_t s = 0; s < streams.size(); s++) {
    copy[streams[s].elements - 1](m.vertex(s, 0), m.vertex_count, integers);
    integers += MESHLET_VERTICES * streams[s].elements;
  }
}

// The caller's layout, checked. `count` of the list is its length.
struct Attributes {
  VertexAttribute list[BLOB_MAX_STREAMS];

  // Returns what is wrong, or null.
  const char* take(const gltf_meshlet_attribute* given, uint32_t count,
                   const StreamTable& streams) {
    if (!given && count) return kNull;
    if (count > BLOB_MAX_STREAMS) return "there are more than 64 attributes";
    for (uint32_t i = 0; i < count; i++) {
      const gltf_meshlet_attribute& from = given[i];
      if (!from.data) return kNull;
      if (from.stream >= streams.size()) return "an attribute is of a stream that does not exist";
      if (from.format >= uint32_t(VertexFormat::kCount)) return "an attribute's format is unknown";
      const VertexFormat format = VertexFormat(from.format);
      const Stream& stream = streams[from.stream];
      if (holds_integers(format) && stream.bits > 8 * component_bytes(format))
        return "an attribute's format has fewer bits than its stream";
      const size_t bytes = component_bytes(format) *
                           (holds_integers(format) ? stream.elements : value_count(stream));
      if (from.stride && from.stride < bytes) return "an attribute's stride is less than its bytes";
      list[i] = {from.stream, format, static_cast<uint8_t*>(from.data),
                 from.stride ? from.stride : bytes};
    }
    return nullptr;
  }
};

// Returns what is wrong with asking for bounds, or null.
const char* bounds_problem(const gltf_meshlet_bounds* bounds, const StreamTable& streams) {
  return bounds && streams[0].elements != 3 ? "stream 0 has not three elements, for bounds"
                                            : nullptr;
}

static_assert(sizeof(gltf_meshlet_bounds) == sizeof(MeshletBounds), "they are the same");

// The caller's arrays, checked but for their room.
struct CallerArrays {
  gltf_meshlet_arrays to;
  Attributes attributes;
  Outputs out;

  // Returns what is wrong, or null.
  const char* take_from(const gltf_meshlet_arrays* arrays, const StreamTable& streams) {
    if (!take(arrays, to)) return kWrongSize;
    if (!to.triangles == !to.triangles_16) return "there are no triangles, or both kinds";
    if (to.reserved) return kReserved;
    if (const char* problem = attributes.take(to.attributes, to.attribute_count, streams))
      return problem;
    if (const char* problem = bounds_problem(to.bounds, streams)) return problem;
    out.triangles = to.triangles;
    out.narrow_triangles = to.triangles_16;
    out.integers = to.integers;
    out.values = to.values;
    out.attributes = attributes.list;
    out.attribute_count = to.attribute_count;
    out.bounds = reinterpret_cast<MeshletBounds*>(to.bounds);
    return nullptr;
  }

  // Do vertex numbers below `end` fit?
  bool can_number(uint64_t end) const { return !to.triangles_16 || end <= 1u << 16; }
};
constexpr const char* kNarrow = "16 bits are too few for the vertices";

bool are_begins(const uint32_t* begins, uint64_t first, uint64_t count, uint64_t total) {
  for (uint64_t m = first; m < first + count; m++)
    if (begins[m] > begins[m + 1]) return false;
  return begins[first + count] <= total;
}

// Decodes a range to the caller's arrays of the whole view.
int decode_to_view(const View& view, Decoder& decoder, uint64_t first, uint64_t count,
                   const CallerArrays& caller, DecodedCounts& decoded) {
  const gltf_meshlet_arrays& to = caller.to;
  if (!to.vertex_begins || !to.triangle_begins) return bad_argument(kNull);
  if (!caller.can_number(view.vertex_count)) return bad_argument(kNarrow);
  if (to.first_vertex) return bad_argument("the first vertex of a whole view is not 0");
  if (to.triangle_room < view.triangle_count || to.vertex_room < view.vertex_count)
    return bad_argument(kRoom);
  if (!are_begins(to.triangle_begins, first, count, view.triangle_count) ||
      !are_begins(to.vertex_begins, first, count, view.vertex_count))
    return bad_argument("the begins are not those of the view");
  Outputs out = caller.out;
  out.triangle_begins = to.triangle_begins;
  out.vertex_begins = to.vertex_begins;
  return status_of(view.decode_range(decoder, first, count, out, decoded));
}

// Decodes a range to arrays that hold nothing else.
int decode_alone(const View& view, Decoder& decoder, uint64_t first, uint64_t count,
                 const CallerArrays& caller, DecodedCounts& decoded) {
  const gltf_meshlet_arrays& to = caller.to;
  const size_t number = view.blob_of_meshlet(first);
  const ViewBlob& blob = view.blobs[number];
  const bool whole = count == blob.meshlet_count;
  const uint64_t vertices = whole ? blob.vertex_count : MESHLET_VERTICES * count;
  if (to.triangle_room < (whole ? blob.triangle_count : MESHLET_TRIANGLES * count) ||
      to.vertex_room < vertices)
    return bad_argument(kRoom);
  if (!caller.can_number(to.first_vertex + vertices)) return bad_argument(kNarrow);
  decoder.restart();
  Outputs out = caller.out;
  out.first_vertex = to.first_vertex;
  return status_of(view.located(
      decoder.decode(uint32_t(first - blob.first_meshlet), uint32_t(count), {}, out, decoded),
      number));
}

}  // namespace

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

int gltf_meshlet_get_page(const gltf_meshlet_view* view, uint32_t page, gltf_meshlet_page* out) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    if (page >= open.view.blobs.size()) return no_such("there is no such page");
    const ViewBlob& b = open.view.blobs[page];
    return give(
        {0, b.data_offset, uint64_t(b.data - open.view.blobs[0].data), b.size, b.triangle_count,
         b.vertex_count, b.meshlet_count, b.first_triangle, b.first_vertex, b.first_meshlet},
        out);
  });
}

int gltf_meshlet_get_stream(const gltf_meshlet_view* view, uint32_t page, uint32_t stream,
                            gltf_meshlet_stream* out) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    if (!out) return bad_argument(kNull);
    if (page >= open.view.blobs.size() || stream >= open.view.streams.size())
      return no_such("there is no such stream");
    const Stream s = read_stream(open.view.blobs[page].data, stream);
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
    CallerArrays caller;
    const gltf_meshlet_arrays& to = caller.to;
    if (threads < 0) return bad_argument(kThreads);
    if (const char* problem = caller.take_from(arrays, v.streams)) return bad_argument(problem);
    if (!caller.can_number(v.vertex_count)) return bad_argument(kNarrow);
    if (to.first_vertex) return bad_argument("the first vertex of a whole view is not 0");
    if (to.triangle_room < v.triangle_count || to.vertex_room < v.vertex_count)
      return bad_argument(kRoom);
    caller.out.shared = to.shared;
    return status_of(v.decode(thread_count(threads), caller.out));
  });
}

int gltf_meshlet_decode_range(const gltf_meshlet_view* view, gltf_meshlet_scratch* scratch,
                              uint64_t first, uint64_t count, const gltf_meshlet_arrays* arrays,
                              uint32_t* sizes) {
  return with_scratch(view, scratch, [&](const OpenView& open, Scratch& s) {
    CallerArrays caller;
    const gltf_meshlet_arrays& to = caller.to;
    if (const char* problem = caller.take_from(arrays, open.view.streams))
      return bad_argument(problem);
    if (to.shared) return bad_argument("shared vertices are found in whole views only");
    if (count == 0 || first >= open.view.meshlet_count)
      return no_such("there are no such meshlets");
    const size_t number = open.view.blob_of_meshlet(first);
    const ViewBlob& blob = open.view.blobs[number];
    if (count > blob.meshlet_count - (first - blob.first_meshlet))
      return no_such("the page has fewer meshlets");
    Decoder* const decoder = s.decoder_at(open, number);
    if (!decoder) return fail({kNoMemory});
    DecodedCounts decoded;
    const int status = to.vertex_begins || to.triangle_begins
                           ? decode_to_view(open.view, *decoder, first, count, caller, decoded)
                           : decode_alone(open.view, *decoder, first, count, caller, decoded);
    if (sizes) {
      sizes[0] = decoded.triangles;
      sizes[1] = decoded.vertices;
    }
    return status;
  });
}

int gltf_meshlet_decode_meshlets(const gltf_meshlet_view* view, gltf_meshlet_scratch* scratch,
                                 const uint32_t* meshlets, size_t count,
                                 const gltf_meshlet_meshlet_arrays* arrays) {
  return with_scratch(view, scratch, [&](const OpenView& open, Scratch& s) {
    const StreamTable& streams = open.view.streams;
    gltf_meshlet_meshlet_arrays to;
    Attributes attributes;
    if (!take(arrays, to)) return bad_argument(kWrongSize);
    if (!meshlets && count) return bad_argument(kNull);
    if (to.reserved) return bad_argument(kReserved);
    if (to.triangle_bytes && to.triangle_bytes != 3 && to.triangle_bytes != 4)
      return bad_argument("a triangle has neither 3 nor 4 bytes");
    if (const char* problem = attributes.take(to.attributes, to.attribute_count, streams))
      return bad_argument(problem);
    if (const char* problem = bounds_problem(to.bounds, streams)) return bad_argument(problem);
    const uint32_t triangle_bytes = to.triangle_bytes ? to.triangle_bytes : 3;
    Outputs out;
    out.attributes = attributes.list;
    out.attribute_count = to.attribute_count;
    size_t elements = 0;
    for (const Stream& stream : streams) elements += stream.elements;
    for (size_t i = 0; i < count; i++) {
      if (meshlets[i] >= open.view.meshlet_count) return no_such("no such meshlet");
      const size_t blob = open.view.blob_of_meshlet(meshlets[i]);
      Decoder* const decoder = s.decoder_at(open, blob);
      if (!decoder) return fail({kNoMemory});
      DecodedMeshlet m;
      DecodedCounts counts;
      out.meshlet = &m;
      out.attribute_row = MESHLET_VERTICES * i;
      out.bounds = to.bounds ? reinterpret_cast<MeshletBounds*>(to.bounds + i) : nullptr;
      const uint32_t number = uint32_t(meshlets[i] - open.view.blobs[blob].first_meshlet);
      if (const Problem problem = decoder->decode(number, 1, {}, out, counts))
        return fail(open.view.located(problem, blob));
      copy_meshlet(m, streams,
                   to.triangles ? to.triangles + triangle_bytes * MESHLET_TRIANGLES * i : nullptr,
                   triangle_bytes,
                   to.integers ? to.integers + MESHLET_VERTICES * elements * i : nullptr);
      if (!to.sizes) continue;
      to.sizes[2 * i] = m.triangle_count;
      to.sizes[2 * i + 1] = m.vertex_count;
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

int gltf_meshlet_get_packed_pages(const void* head, size_t head_bytes, uint64_t view_bytes,
                                  gltf_meshlet_packed_page* pages, size_t room, size_t* count) {
  return guarded([&] {
    if (!head || !count) return bad_argument(kNull);
    List<PackedPage> all;
    const auto* bytes = static_cast<const uint8_t*>(head);
    if (const Problem p = read_page_table(bytes, head_bytes, view_bytes, all)) return fail(p);
    *count = all.size();
    if (!pages) return kOk;
    if (room < all.size()) return bad_argument(kRoom);
    for (size_t i = 0; i < all.size(); i++)
      pages[i] = {all[i].packed_begin, uint32_t(all[i].packed_bytes), uint32_t(all[i].bytes)};
    return kOk;
  });
}

int gltf_meshlet_unpack_page(gltf_meshlet_scratch* scratch, const void* stored, size_t stored_bytes,
                             void* page, size_t page_bytes) {
  return guarded([&] {
    if (!stored || !page) return bad_argument(kNull);
    if (page_bytes == 0 || page_bytes > BLOB_MAX_BYTES || stored_bytes == 0 ||
        stored_bytes > BLOB_MAX_BYTES)
      return bad_argument("a page has an impossible length");
    return with_scratch(scratch, [&](Scratch& s) {
      const PackedPage whole = {0, stored_bytes, 0, page_bytes, stored_bytes == page_bytes};
      PageUnpacker* const unpacker = s.page_unpacker();
      if (!unpacker) return fail({kNoMemory});
      return status_of(unpacker->unpack(static_cast<const uint8_t*>(stored), whole,
                                        static_cast<uint8_t*>(page)));
    });
  });
}

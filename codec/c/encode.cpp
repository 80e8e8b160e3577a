// The part of the C interface that encodes, and that reads sources.
#include "c/encoder_input.h"
#include "common/polygons.h"
#include "common/text_lines.h"
#include "common/weld.h"
#include "lod/split_meshlets.h"
#include "segment/check_meshlets.h"
#include "transport/transport.h"

namespace gltf_meshlet_codec {
namespace {

// Sets the caller's meshlets and returns the begins of their groups.
std::vector<uint32_t> given_meshlets(const gltf_meshlet_mesh& m, const MeshView& mesh,
                                     const EncodeOptions& options, Meshlets& given) {
  std::vector<uint32_t> groups = vector_of(m.group_begin, m.group_begin_count);
  std::vector<uint32_t> begin = vector_of(m.meshlet_begin, m.meshlet_begin_count);
  if (!m.group_begin && !begin.empty()) groups = {0, uint32_t(begin.size() - 1)};
  if (m.disk_begin) {
    given.triangles = vector_of(m.order, m.triangle_count);
    given.disk_begin = vector_of(m.disk_begin, m.disk_begin_count);
    given.meshlet_begin = std::move(begin);
    return groups;
  }
  require(m.disk_begin_count == 0, kNull);
  GroupMeshlets split = split_meshlets(mesh, vector_of(m.order, m.triangle_count), begin, options);
  require(are_begins(groups, split.group_begin.size() - 1),
          "the groups' begins do not increase from 0 to the last meshlet");
  for (uint32_t& group : groups) group = split.group_begin[group];
  static_cast<MeshletList&>(given) = std::move(split);
  return groups;
}

std::vector<uint8_t> encode_view(const gltf_meshlet_mesh& m, const EncodeOptions& all,
                                 size_t page_bytes, EncoderStats& stats) {
  const MeshView mesh = mesh_of(m, m.triangles, m.triangle_count);
  const std::vector<Stream> streams = streams_of(m);
  check_input(mesh, streams);  // before values are read by the streams' elements
  const VertexValues values = values_of(m, streams);
  require(m.order || (!m.disk_begin && !m.meshlet_begin && !m.group_begin && !m.disk_begin_count &&
                      !m.meshlet_begin_count && !m.group_begin_count),
          "there are meshlets without an order of triangles");
  if (!m.order && !page_bytes) return encode(mesh, streams, values, all, stats);
  std::vector<Bytes> blobs;
  if (m.order) {
    Meshlets given;
    const std::vector<uint32_t> groups = given_meshlets(m, mesh, all, given);
    blobs = encode_given(mesh, given, groups, streams, values, all, page_bytes, stats);
  } else {
    blobs = encode_pages(mesh, streams, values, all, page_bytes, stats);
  }
  Bytes view;
  for (const Bytes& blob : blobs) view.insert(view.end(), blob.begin(), blob.end());
  return view;
}

// Gives a result with the view of the mesh to the caller.
int encode_to_result(const gltf_meshlet_mesh* mesh, const EncodeOptions& options, size_t page_bytes,
                     gltf_meshlet_statistics* statistics, gltf_meshlet_result** result) {
  require(result, kNull);
  require(!statistics || has_size(statistics), kWrongSize);
  EncoderStats stats;
  Bytes view = encode_view(PlainMesh(taken(mesh)).m, options, page_bytes, stats);
  give_statistics(stats, statistics);
  return open_object<Result>(result, std::move(view));
}

}  // namespace
}  // namespace gltf_meshlet_codec

using namespace gltf_meshlet_codec;

int gltf_meshlet_get_array(const gltf_meshlet_result* result, uint32_t array, const void** items,
                           size_t* bytes) {
  return with<Result>(result, [&](const Result& r) {
    if (!items || !bytes) return bad_argument(kNull);
    if (array >= r.arrays.size()) return fail(GLTF_MESHLET_NUMBER, "there is no such array");
    *items = r.arrays[array].data;
    *bytes = r.arrays[array].bytes;
    return kOk;
  });
}

int gltf_meshlet_encode(const gltf_meshlet_mesh* mesh, const gltf_meshlet_options* options,
                        gltf_meshlet_result** result) {
  return gltf_meshlet_encode_described(mesh, options, nullptr, result);
}

int gltf_meshlet_encode_described(const gltf_meshlet_mesh* mesh,
                                  const gltf_meshlet_options* options,
                                  gltf_meshlet_statistics* statistics,
                                  gltf_meshlet_result** result) {
  if (result) *result = nullptr;
  return guarded([&] {
    const gltf_meshlet_options all = known(options);
    return encode_to_result(mesh, options_of(all), size_t(all.page_bytes), statistics, result);
  });
}

#ifdef MESHLET_BENCH
// Regions as in the paper and by Choe et al., for bench/table1.py and others, and for the
// conformance vectors, which are older than the efforts of today: tools/paper_encoder.py.
struct PaperOptions {
  uint32_t size;
  uint32_t as_paper;        // 1: regions grow anew in each round
  uint32_t weight_of_choe;  // 1: without the paper's penalty for full regions
  uint32_t separate_seams;  // 1: shares nothing across seams
  float fill;               // mean share of a region that is full, for the number of centres; or 0
};

extern "C" GLTF_MESHLET_API int gltf_meshlet_encode_as_paper(const gltf_meshlet_mesh* mesh,
                                                             const gltf_meshlet_options* options,
                                                             const PaperOptions* paper,
                                                             gltf_meshlet_statistics* statistics,
                                                             gltf_meshlet_result** result) {
  if (result) *result = nullptr;
  return guarded([&] {
    const gltf_meshlet_options common = known(options);
    const PaperOptions p = taken(paper);
    EncodeOptions all = options_of(common);
    if (p.as_paper) all.effort = Effort::kPaper;
    if (p.fill > 0) all.fill = p.fill;
    if (p.weight_of_choe) all.weight = Weight::kChoe;
    all.share_seams = !p.separate_seams;
    return encode_to_result(mesh, all, size_t(common.page_bytes), statistics, result);
  });
}
#endif

int gltf_meshlet_pack(const void* view, size_t size, int32_t threads,
                      gltf_meshlet_result** result) {
  return guarded([&] {
    if (!view || !result) return bad_argument(kNull);
    *result = nullptr;
    require(threads >= 0, kThreads);
    std::vector<uint8_t> packed;
    if (const Problem p =
            pack_view(static_cast<const uint8_t*>(view), size, thread_count(threads), packed))
      return fail(p);
    return open_object<Result>(result, std::move(packed));
  });
}

int gltf_meshlet_weld(const void* rows, size_t count, size_t stride, uint32_t* numbers,
                      uint32_t* different) {
  return guarded([&] {
    require(different && ((rows && numbers) || count == 0), kNull);
    require(count < UINT32_MAX, "there are too many rows");
    *different = weld_rows(static_cast<const uint8_t*>(rows), count, stride, numbers);
    return kOk;
  });
}

int gltf_meshlet_scan_lines(const char* text, size_t size, const char* const* keywords,
                            const uint32_t* words, size_t count, gltf_meshlet_result** result) {
  return guarded([&] {
    require(result, kNull);
    *result = nullptr;
    require(text && ((keywords && words) || count == 0), kNull);
    require(size <= UINT32_MAX, "the text is too long");
    std::vector<Keyword> taken;
    for (size_t i = 0; i < count; i++) {
      require(keywords[i], kNull);
      require(words[i] <= GLTF_MESHLET_CORNERS, "the kind of words is unknown");
      constexpr Words kKinds[] = {Words::kAny, Words::kNumbers, Words::kCorners};
      taken.push_back({keywords[i], kKinds[words[i]]});
    }
    return open_object<Result>(result, scan_lines({text, size}, taken));
  });
}

int gltf_meshlet_triangulate(const float* points, size_t corners, const uint32_t* sizes,
                             size_t count, gltf_meshlet_result** result) {
  return guarded([&] {
    require(result, kNull);
    *result = nullptr;
    require((points || corners == 0) && (sizes || count == 0), kNull);
    require(corners <= UINT32_MAX, "there are too many corners");
    size_t left = corners;
    for (size_t i = 0; i < count; left -= sizes[i++])
      require(sizes[i] <= left, "the polygons have more corners than there are");
    require(left == 0, "the polygons have fewer corners than there are");
    return open_object<Result>(result, triangulate(points, sizes, count));
  });
}

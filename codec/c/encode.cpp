// The part of the C interface that encodes and builds levels of detail.
#include <cmath>
#include <optional>

#include "c/objects.h"
#include "c/plain_mesh.h"
#include "c/statistics.h"
#include "common/array.h"
#include "common/curve.h"
#include "common/polygons.h"
#include "common/text_lines.h"
#include "common/weld.h"
#include "encode/pages.h"
#include "lod/group_meshlets.h"
#include "lod/split_meshlets.h"
#include "lod/replacement_errors.h"
#include "segment/check_meshlets.h"
#include "transport/transport.h"

namespace gltf_meshlet_codec {
namespace {

constexpr size_t kPointsAtOnce = 1024;
constexpr uint8_t kChoose = GLTF_MESHLET_CHOOSE_PREDICTOR;

struct Result : Object {
  static constexpr Kind kKind = Kind::kResult;
  struct Items {
    std::shared_ptr<const void> owner;
    const void* data;
    size_t bytes;
  };
  std::vector<Items> arrays;

  template <class... Vectors>
  explicit Result(Vectors... vectors) : Object(kKind) {
    (add(std::move(vectors)), ...);
  }
  explicit Result(std::vector<TextLines> keywords) : Object(kKind) {
    for (TextLines& lines : keywords) {
      if (lines.corners.empty())
        add(std::move(lines.numbers));
      else
        add(std::move(lines.corners));
      add(std::move(lines.counts));
      add(std::move(lines.offsets));
    }
  }

 private:
  template <class Vector>
  void add(Vector vector) {
    const auto kept = std::make_shared<Vector>(std::move(vector));
    arrays.push_back({kept, kept->data(), kept->size() * sizeof(typename Vector::value_type)});
  }
};

template <class T>
T taken(const T* from) {
  T to;
  require(take(from, to), kWrongSize);
  return to;
}

// Opens a new T and gives it to the caller.
template <class T, class Handle, class... Arguments>
int open_object(Handle** out, Arguments&&... arguments) {
  return give_object(std::unique_ptr<T>(new T(std::forward<Arguments>(arguments)...)), out);
}

std::vector<uint32_t> vector_of(const uint32_t* numbers, uint64_t count) {
  require(numbers || count == 0, kNull);
  return {numbers, numbers + count};
}

void check_points(const float* points, uint64_t count) {
  require(points || count == 0, kNull);
  require(count <= UINT32_MAX, "there are more than 2^32 points");
  float sum = 0;  // becomes NaN by any infinity or NaN
  for (const float* p = points; p < points + 3 * count; p++) sum += *p * 0.0f;
  require(sum == 0, "a position is not finite");
}

void check_triangles(const uint32_t* triangles, uint64_t count, uint64_t vertices, bool distinct) {
  require(triangles || count == 0, kNull);
  require(count <= UINT32_MAX / 3, "there are too many triangles");
  const uint32_t* t = triangles;
  for (uint64_t i = 0; i < count; i++, t += 3) {
    require(t[0] < vertices && t[1] < vertices && t[2] < vertices,
            "a triangle index is out of range");
    require(!distinct || (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]),
            "a triangle repeats an index");
  }
}

// Vertices of one id have one position: seams would be closed that are open, or the reverse.
void check_position_ids(const gltf_meshlet_mesh& m) {
  Array<uint32_t> first(size_t(m.vertex_count));  // vertex of each id, with `known` ids
  std::vector<bool> known(size_t(m.vertex_count));
  for (uint64_t v = 0; v < m.vertex_count; v++) {
    const uint32_t id = m.position_ids[v];
    require(id < m.vertex_count, "a position id is out of range");
    if (!known[id]) {
      known[id] = true;
      first[id] = uint32_t(v);
      continue;
    }
    const float *a = m.positions + 3 * size_t(first[id]), *b = m.positions + 3 * v;
    require(a[0] == b[0] && a[1] == b[1] && a[2] == b[2],
            "vertices with one position id have different positions");
  }
}

MeshView mesh_of(const gltf_meshlet_mesh& m, const uint32_t* triangles, uint64_t triangle_count) {
  check_points(m.positions, m.vertex_count);
  check_triangles(triangles, triangle_count, m.vertex_count, true);
  require(m.position_ids || m.vertex_count == 0, kNull);
  check_position_ids(m);
  return {triangles, size_t(triangle_count), m.position_ids, m.positions, size_t(m.vertex_count)};
}

std::vector<Stream> streams_of(const gltf_meshlet_mesh& m) {
  require((m.streams && m.values) || m.stream_count == 0, kNull);
  std::vector<Stream> streams;
  for (uint32_t i = 0; i < m.stream_count && i <= BLOB_MAX_STREAMS; i++) {
    const gltf_meshlet_stream& from = m.streams[i];
    require(from.reserved == 0, "a reserved field of a stream is not 0");
    Stream s;
    s.kind = from.kind;
    s.elements = from.elements;
    s.bits = from.bits;
    s.predictor = from.predictor == kChoose ? uint8_t(kChoosePredictor) : from.predictor;
    s.step = from.step;
    std::copy(from.offset, from.offset + STREAM_MAX_ELEMENTS, s.offset);
    streams.push_back(s);
  }
  return streams;
}

VertexValues values_of(const gltf_meshlet_mesh& m, const std::vector<Stream>& streams) {
  VertexValues out;
  for (size_t s = 0; s < streams.size(); s++) {
    const uint32_t* values = m.values[s];
    require(values, kNull);
    const uint32_t mask = streams[s].bits >= 32 ? ~0u : (1u << streams[s].bits) - 1u;
    uint32_t over = 0;
    for (uint64_t i = 0; i < m.vertex_count * streams[s].elements; i++) over |= values[i] & ~mask;
    require(!over, "a stream's value does not fit its bits");
    out.values.push_back(values);
    out.elements.push_back(streams[s].elements);
  }
  return out;
}

EncodeOptions options_of(const gltf_meshlet_options& o) {
  EncodeOptions out;
  require(o.effort <= GLTF_MESHLET_EFFORT_FAST, "the effort is unknown");
  require(o.max_triangles <= MESHLET_TRIANGLES && o.max_vertices <= MESHLET_VERTICES &&
              (o.max_vertices >= 3 || o.max_vertices == 0),
          "a meshlet holds 1 to 64 triangles and 3 to 64 vertices");
  require(o.lambda >= 0 && o.lambda <= 1000, "lambda is above 1000 or below 0");
  out.effort = o.effort == GLTF_MESHLET_EFFORT_FAST ? Effort::kFast : Effort::kNormal;
  if (o.max_triangles) out.max_triangles = int(o.max_triangles);
  if (o.max_vertices) out.max_vertices = int(o.max_vertices);
  if (o.lambda > 0) out.lambda = o.lambda;
  require(o.threads >= 0, kThreads);
  out.threads = thread_count(o.threads);
  if (o.progress)
    out.progress = [call = o.progress, user = o.user](float fraction) {
      if (call(user, fraction)) throw Cancelled();
    };
  return out;
}

gltf_meshlet_options known(const gltf_meshlet_options* options) {
  return options ? taken(options) : gltf_meshlet_options{};
}

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
  gltf_meshlet_statistics found{};
  found.iterations = stats.iterations;
  std::copy(stats.histogram, stats.histogram + 4, found.histogram);
  copy_statistics(stats.bits, found);
  if (statistics) give(found, statistics);
  return open_object<Result>(result, std::move(view));
}

GroupTriangles groups_of(const gltf_meshlet_groups* groups, uint64_t vertices, bool distinct) {
  const gltf_meshlet_groups g = taken(groups);
  check_triangles(g.triangles, g.triangle_count, vertices, distinct);
  GroupTriangles out{g.triangles, vector_of(g.begin, g.begin_count)};
  require(are_begins(out.begin, size_t(g.triangle_count)),
          "begins do not increase from 0 to the number of triangles");
  return out;
}

// Level 0, to measure its replacements.
struct Surface : Object {
  static constexpr Kind kKind = Kind::kSurface;
  const uint64_t vertices;
  const ReplacementErrors errors;

  Surface(std::vector<const float*> shapes, uint64_t vertex_count, const GroupTriangles& level_0,
          float vertex_share, int threads)
      : Object(kKind),
        vertices(vertex_count),
        errors(std::move(shapes), size_t(vertex_count), level_0, vertex_share, threads) {}
};

CarriedVertices carried_of(const gltf_meshlet_samples* carried, size_t groups, uint64_t vertices) {
  const gltf_meshlet_samples c = taken(carried);
  require(c.areas || c.count == 0, kNull);
  CarriedVertices out{vector_of(c.vertices, c.count), {}, vector_of(c.begin, groups + 1), {}};
  out.areas.assign(c.areas, c.areas + c.count);
  require(out.begin.front() == 0 && out.begin.back() == c.count &&
              std::is_sorted(out.begin.begin(), out.begin.end()),
          "begins do not rise from 0 to the number of vertices");
  for (uint32_t v : out.vertices) require(v < vertices, "a vertex is out of range");
  return out;
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

int gltf_meshlet_generate(const gltf_meshlet_mesh* mesh, const gltf_meshlet_groups* groups,
                          const gltf_meshlet_options* options, gltf_meshlet_result** result) {
  return guarded([&] {
    require(result, kNull);
    *result = nullptr;
    const gltf_meshlet_mesh m = taken(mesh);
    const GroupTriangles in = groups_of(groups, m.vertex_count, true);
    const MeshView view = mesh_of(m, in.triangles, in.begin.back());
    GroupMeshlets made = generate_in_groups(view, in.begin, options_of(known(options)));
    return open_object<Result>(result, std::move(made.triangles), std::move(made.disk_begin),
                               std::move(made.meshlet_begin), std::move(made.group_begin));
  });
}

int gltf_meshlet_sort_points(const float* points, size_t count, uint32_t* order) {
  return guarded([&] {
    require(order || count == 0, kNull);
    check_points(points, count);
    if (count == 0) return kOk;
    std::vector<Vec3> all;
    for (const float* p = points; p < points + 3 * count; p += 3) all.push_back({p[0], p[1], p[2]});
    const Box box = box_of(all);
    const float longest = box.longest_side(), scale = longest > 0 ? 1 / longest : 0;
    const auto sorted = order_along_curve(
        count, 1, [&](size_t i) { return (all[i] - box.low) * scale * kCurveCells; });
    std::copy(sorted.begin(), sorted.end(), order);
    return kOk;
  });
}

int gltf_meshlet_open_surface(const float* const* shapes, uint32_t shape_count,
                              uint64_t vertex_count, const gltf_meshlet_groups* level_0,
                              float vertex_share, int32_t threads, gltf_meshlet_surface** surface) {
  return guarded([&] {
    require(surface && shapes, kNull);
    *surface = nullptr;
    require(shape_count, "there are no shapes");
    require(threads >= 0, kThreads);
    std::vector<const float*> all(shapes, shapes + shape_count);
    for (const float* shape : all) check_points(shape, vertex_count);
    return open_object<Surface>(surface, std::move(all), vertex_count,
                                groups_of(level_0, vertex_count, false), vertex_share,
                                thread_count(threads));
  });
}

int gltf_meshlet_measure(const gltf_meshlet_surface* surface, const gltf_meshlet_groups* before,
                         const gltf_meshlet_groups* after, const uint32_t* chosen,
                         size_t chosen_count, const gltf_meshlet_samples* carried, int32_t threads,
                         gltf_meshlet_result** result) {
  return with<Surface>(surface, [&](const Surface& level_0) {
    require(result, kNull);
    *result = nullptr;
    require(threads >= 0, kThreads);
    const GroupTriangles was = groups_of(before, level_0.vertices, false);
    const GroupTriangles is = groups_of(after, level_0.vertices, false);
    require(was.groups() == is.groups(), "before and after differ in their number of groups");
    const std::vector<uint32_t> groups = vector_of(chosen, chosen_count);
    for (uint32_t group : groups) require(group < was.groups(), "a group is out of range");
    CarriedVertices on = carried_of(carried, chosen_count, level_0.vertices);
    std::vector<float> found = level_0.errors.measure(was, is, groups, on, thread_count(threads));
    return open_object<Result>(result, std::move(found), std::move(on.vertices),
                               std::move(on.triangles), std::move(on.begin), std::move(on.areas));
  });
}

int gltf_meshlet_get_nearest(const gltf_meshlet_surface* surface, const float* points,
                             size_t point_count, int32_t threads, uint32_t* triangles) {
  return with<Surface>(surface, [&](const Surface& level_0) {
    require(triangles || point_count == 0, kNull);
    require(threads >= 0, kThreads);
    check_points(points, point_count);
    for_blocks(thread_count(threads), point_count, kPointsAtOnce,
               [&](size_t, size_t first, size_t last) {
                 uint32_t hint = 0;
                 for (size_t i = first; i < last; i++) {
                   const float* p = points + 3 * i;
                   triangles[i] = level_0.errors.nearest({p[0], p[1], p[2]}, hint);
                 }
               });
    return kOk;
  });
}

int gltf_meshlet_get_distances(const float* points, size_t point_count,
                               const gltf_meshlet_groups* triangles, const float* positions,
                               uint64_t vertex_count, float enough, int32_t threads,
                               float* distances, uint32_t* nearest) {
  return guarded([&] {
    require(distances || point_count == 0, kNull);
    require(threads >= 0, kThreads);
    check_points(points, point_count);
    check_points(positions, vertex_count);
    const GroupTriangles surface = groups_of(triangles, vertex_count, false);
    const TriangleTree tree(positions, surface.triangles, surface.begin, thread_count(threads));
    for_blocks(
        thread_count(threads), point_count, kPointsAtOnce, [&](size_t, size_t first, size_t last) {
          uint32_t hint = 0;
          for (size_t i = first; i < last; i++) {
            const float* p = points + 3 * i;
            const float squared = tree.squared_distance({p[0], p[1], p[2]}, hint, enough * enough);
            distances[i] = std::sqrt(squared);
            if (nearest) nearest[i] = tree.number(hint);
          }
        });
    return kOk;
  });
}

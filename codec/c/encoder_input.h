// What a caller gives the encoder, checked; and the arrays that he gets.
#pragma once
#include <cmath>
#include <memory>
#include <vector>

#include "c/gltf_meshlet_internal.h"
#include "c/objects.h"
#include "c/plain_mesh.h"
#include "c/statistics.h"
#include "common/array.h"
#include "common/text_lines.h"
#include "encode/pages.h"
#include "lod/replacement_errors.h"
#include "segment/check_meshlets.h"

namespace gltf_meshlet_codec {

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

inline std::vector<uint32_t> vector_of(const uint32_t* numbers, uint64_t count) {
  require(numbers || count == 0, kNull);
  return {numbers, numbers + count};
}

inline void check_points(const float* points, uint64_t count) {
  require(points || count == 0, kNull);
  require(count <= UINT32_MAX, "there are more than 2^32 points");
  float sum = 0;  // becomes NaN by any infinity or NaN
  for (const float* p = points; p < points + 3 * count; p++) sum += *p * 0.0f;
  require(sum == 0, "a position is not finite");
}

inline void check_triangles(const uint32_t* triangles, uint64_t count, uint64_t vertices,
                            bool distinct) {
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
inline void check_position_ids(const gltf_meshlet_mesh& m, const uint32_t* position_ids) {
  require(position_ids || m.vertex_count == 0, kNull);
  Array<uint32_t> first(size_t(m.vertex_count));  // vertex of each id, with `known` ids
  std::vector<bool> known(size_t(m.vertex_count));
  for (uint64_t v = 0; v < m.vertex_count; v++) {
    const uint32_t id = position_ids[v];
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

inline MeshView mesh_of(const gltf_meshlet_mesh& m, const uint32_t* triangles,
                        uint64_t triangle_count) {
  check_points(m.positions, m.vertex_count);
  check_triangles(triangles, triangle_count, m.vertex_count, true);
  check_position_ids(m, m.position_ids);
  return {triangles, size_t(triangle_count), m.position_ids, m.positions, size_t(m.vertex_count)};
}

inline std::vector<Stream> streams_of(const gltf_meshlet_mesh& m) {
  require((m.streams && m.values) || m.stream_count == 0, kNull);
  std::vector<Stream> streams;
  for (uint32_t i = 0; i < m.stream_count && i <= BLOB_MAX_STREAMS; i++) {
    const gltf_meshlet_stream& from = m.streams[i];
    require(from.reserved == 0, "a reserved field of a stream is not 0");
    Stream s;
    s.kind = from.kind;
    s.elements = from.elements;
    s.bits = from.bits;
    s.predictor = from.predictor == GLTF_MESHLET_CHOOSE_PREDICTOR ? uint8_t(kChoosePredictor)
                                                                  : from.predictor;
    s.step = from.step;
    std::copy(from.offset, from.offset + STREAM_MAX_ELEMENTS, s.offset);
    streams.push_back(s);
  }
  return streams;
}

inline VertexValues values_of(const gltf_meshlet_mesh& m, const std::vector<Stream>& streams) {
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

inline EncodeOptions options_of(const gltf_meshlet_options& o) {
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

inline gltf_meshlet_options known(const gltf_meshlet_options* options) {
  return options ? taken(options) : gltf_meshlet_options{};
}

inline GroupTriangles groups_of(const gltf_meshlet_groups* groups, uint64_t vertices,
                                bool distinct) {
  const gltf_meshlet_groups g = taken(groups);
  check_triangles(g.triangles, g.triangle_count, vertices, distinct);
  GroupTriangles out{g.triangles, vector_of(g.begin, g.begin_count)};
  require(are_begins(out.begin, size_t(g.triangle_count)),
          "begins do not increase from 0 to the number of triangles");
  return out;
}

// Gives what the encoder counted to the caller, unless he wants nothing.
inline void give_statistics(const EncoderStats& stats, gltf_meshlet_statistics* statistics) {
  if (!statistics) return;
  gltf_meshlet_statistics found{};
  found.iterations = stats.iterations;
  std::copy(stats.histogram, stats.histogram + 4, found.histogram);
  copy_statistics(stats.bits, found);
  give(found, statistics);
}

}  // namespace gltf_meshlet_codec

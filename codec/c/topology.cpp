// The part of the C interface that finds the source's vertices in decoded ones.
#include "c/objects.h"
#include "common/join_vertices.h"
#include "common/topology.h"

namespace gltf_meshlet_codec {
namespace {

constexpr const char* kNoVertex = "a triangle has a vertex that does not exist";

bool are_below(const uint32_t* triangles, uint64_t count, uint64_t vertex_count) {
  return std::all_of(triangles, triangles + 3 * count,
                     [&](uint32_t v) { return v < vertex_count; });
}

// Returns what is wrong with the arrays, or null.
const char* problem_of(const gltf_meshlet_vertices& d) {
  if (!d.elements || !d.integers || !d.first_vertices || (d.triangle_count && !d.triangles))
    return kNull;
  if (d.vertex_count == 0) return "there are no vertices";
  if (d.vertex_count >= UINT32_MAX) return "there are too many vertices";
  if (d.stream_count == 0 || d.stream_count > GLTF_MESHLET_STREAMS)
    return "there are too many streams, or none";
  for (uint32_t s = 0; s < d.stream_count; s++) {
    if (!d.integers[s]) return kNull;
    if (d.elements[s] == 0 || d.elements[s] > GLTF_MESHLET_ELEMENTS)
      return "a stream has not 1 to 4 elements";
  }
  if (!are_below(d.triangles, d.triangle_count, d.vertex_count)) return kNoVertex;
  for (uint64_t v = 0; d.shared && v < d.vertex_count; v++)
    if (d.shared[v] > v) return "a vertex shares the position of a later one";
  return nullptr;
}

}  // namespace
}  // namespace gltf_meshlet_codec

using namespace gltf_meshlet_codec;

int gltf_meshlet_join_vertices(const gltf_meshlet_vertices* decoded, uint32_t* numbers,
                               uint32_t* different) {
  return guarded([&] {
    gltf_meshlet_vertices d;
    if (!take(decoded, d)) return bad_argument(kWrongSize);
    if (!numbers || !different) return bad_argument(kNull);
    if (const char* problem = problem_of(d)) return bad_argument(problem);
    const uint32_t source = uint32_t(std::min(d.source_vertices, d.vertex_count));
    *different = join_vertices(
        {d.triangles, size_t(d.triangle_count), size_t(d.vertex_count), d.integers, d.elements,
         d.stream_count, d.shared, d.first_vertices, size_t(d.page_count)},
        source, numbers);
    return kOk;
  });
}

int gltf_meshlet_get_topology(const uint32_t* triangles, uint64_t triangle_count,
                              uint64_t vertex_count, gltf_meshlet_topology* out) {
  return guarded([&] {
    if (!triangles && triangle_count) return bad_argument(kNull);
    if (vertex_count >= UINT32_MAX) return bad_argument("there are too many vertices");
    if (!are_below(triangles, triangle_count, vertex_count)) return bad_argument(kNoVertex);
    const Topology t = topology_of(triangles, size_t(triangle_count), size_t(vertex_count));
    return give({0, 0, t.vertices, t.boundary_edges, t.islands}, out);
  });
}
